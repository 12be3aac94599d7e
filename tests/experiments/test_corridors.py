"""The parts of the experiments on corridors."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from experiments import corridor_allocation, corridor_pools
from experiments.corridor_baselines import every_second
from rigdda import Site, release_many, sites

RECORDED = Path(__file__).parents[2] / "experiments" / "results"


def test_halves_of_outcomes_have_equal_shares_of_each_event() -> None:
    site = Site.load("quick")
    jobs = [(site, (), seed, event) for event in ("block", "group") for seed in range(7)]
    outcomes = release_many(jobs)
    first, second = (every_second(outcomes, half) for half in (0, 1))
    assert len(first) == 8 and len(second) == 6
    assert sorted(map(id, [*first, *second])) == sorted(map(id, outcomes))


def test_families_are_those_of_the_generator() -> None:
    for name in sites.split("test")[:6]:
        assert corridor_pools.family(name) == Site.load(name).family


def test_outcomes_are_read_again(tmp_path: Path) -> None:
    one = corridor_pools.Pool("verge", 20, tmp_path)
    layout = one.constants()["ditch"]
    found = one.outcomes(layout)
    again = corridor_pools.Pool("verge", 20, tmp_path)
    again.problem = None  # type: ignore[assignment]  # nothing is simulated
    again._file = one._file  # type: ignore[method-assign]
    assert again.outcomes(layout) == found and len(found) == 20


def test_ways_are_compared_with_an_even_spread_of_the_same_and_twice_the_releases() -> None:
    found = {("evenly", 120): [0.8, 0.9], ("evenly", 240): [0.9, 0.92],
             ("at the margin", 120): [0.89, 0.94]}  # fmt: skip
    rows = corridor_allocation.table(found, 2)
    assert rows[2]["ahead_of_twice"] == pytest.approx(np.mean([-0.01, 0.02]))
    assert rows[2]["ahead_of_same"] == pytest.approx(np.mean([0.09, 0.04]))
    assert np.isnan(rows[0]["ahead_of_twice"])


def test_the_recorded_reference_is_ahead_of_all_methods() -> None:
    with (RECORDED / "corridor_baselines.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        assert float(row["behind_optimum"]) >= 0.0, row["method"]
