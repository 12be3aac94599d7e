"""The default designer without its parts."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments import race_ablation
from rigdda.agents.designers import race


def test_losses_are_shares_of_the_cost_without_barriers() -> None:
    rows = [
        {"site": site, "budget": 500, "without": part, "z": z, "z_nothing": 200.0}
        for site, part, z in (
            ("a", "whole", 80.0), ("a", "pairs", 100.0), ("b", "whole", 60.0), ("b", "pairs", 50.0),
        )
    ]  # fmt: skip
    assert race_ablation.losses(rows, "pairs", 500) == pytest.approx([0.1, -0.05])
    assert race_ablation.losses(rows, "pairs", 2_000) == []


def test_parts_are_names_of_the_designer() -> None:
    for patches in race_ablation.PATCHES.values():
        assert all(hasattr(race, name) for name in patches)


@pytest.mark.slow
def test_every_part_can_be_left_out(tmp_path: Path) -> None:
    before = {name: getattr(race, name) for own in race_ablation.PATCHES.values() for name in own}
    race_ablation.run(True, tmp_path)
    rows = race_ablation.resumed(tmp_path / "race_ablation.csv")
    assert {row["without"] for row in rows} == {*race_ablation.PARTS}
    assert len({row["layout"] for row in rows}) > 2
    assert {name: getattr(race, name) for name in before} == before
