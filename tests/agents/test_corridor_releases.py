"""Number of releases that a plan of a corridor uses, and the least numbers that it asks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from valley import SITE

from rigdda import Corridor, CorridorSection
from rigdda.agents.corridor import planning
from rigdda.agents.corridor.planning import LEAST_PER_LAYOUT, LEAST_REPORTED, Planner
from rigdda.agents.designers import catalogue, front
from rigdda.agents.designers.store import Store
from rigdda.envs import CorridorProblem, DesignProblem


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the numbers of releases that are asked for, as they are asked for."""
    asked: list[int] = []
    ensemble, evaluate_many, sample = catalogue.ensemble, Store.evaluate_many, Store.sample

    def count_crossings(site: Any, seeds: Mapping[str, Sequence[int]], stations: Any) -> Any:
        asked.append(sum(map(len, seeds.values())))
        return ensemble(site, seeds, stations)

    def count_many(self: Store, asks: Sequence[Any]) -> Any:
        asked.extend(len(seeds) for _, _, seeds in asks)
        return evaluate_many(self, asks)

    def count_sample(self: Store, problem: Any, layout: Any, seeds: Mapping[str, Any]) -> Any:
        asked.append(sum(map(len, seeds.values())))
        return sample(self, problem, layout, seeds)

    monkeypatch.setattr(catalogue, "ensemble", count_crossings)
    monkeypatch.setattr(Store, "evaluate_many", count_many)
    monkeypatch.setattr(Store, "sample", count_sample)
    return asked


@pytest.fixture
def road() -> CorridorProblem:
    sections = tuple(CorridorSection(SITE, 50.0, f"km {i}") for i in range(2))
    return CorridorProblem(Corridor("two", sections, (1e4, 5e4)))


def test_a_plan_counts_the_releases_that_it_used(
    simulated: list[int], road: CorridorProblem, tmp_path: Path
) -> None:
    plan = Planner(road, 200, folder=tmp_path).plan()
    assert plan.releases == sum(simulated)
    for own in plan.fronts:
        assert all(option.releases >= LEAST_PER_LAYOUT for option in own if option.layout)
        reported = [option.report for option in own if option.report is not None]
        assert all(report.releases >= LEAST_REPORTED for report in reported)
    (file, *_) = sorted(tmp_path.glob("front-*.json"))
    again = Planner(road, 200, folder=tmp_path).plan()
    assert again.releases == plan.releases
    assert [own.evaluation for own in again.plans] == [own.evaluation for own in plan.plans]
    file.write_text("[[]]")  # as an earlier version wrote it
    assert planning._read(file) is None


def test_a_search_of_a_front_counts_the_releases_that_it_used(simulated: list[int]) -> None:
    found = front.search(DesignProblem(SITE), 90)
    assert found.releases == sum(simulated) <= 90
    assert found.layouts == front.layouts(DesignProblem(SITE), 90)
    assert found.layouts[0] == ()
