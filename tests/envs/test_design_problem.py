"""The objective, its intervals and how releases are simulated."""

from __future__ import annotations

import math
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import msgspec
import numpy as np
import pytest
from scipy import stats

import rigdda
from envs import DesignProblem, baseline
from envs.evaluation import student_interval
from envs.memory import Memory
from rigdda import BadInput, Site, Surface, Wall
from rigdda.site import BarrierZone, Costs, Road

SEEDS = (3, 1, 4, 5)
LAYOUT = (Wall(18.0, 1.0, 1.0),)


@pytest.fixture
def problem(ramp: Site) -> DesignProblem:
    return DesignProblem(ramp, 2, ("wall",), risk_weight=2.0, cost_weight=0.5)


def test_objective_is_that_of_the_releases(problem: DesignProblem, ramp: Site) -> None:
    for layout in ((), LAYOUT):
        outcomes = tuple(rigdda.release(ramp, layout, seed)[1] for seed in SEEDS)
        debris = [outcome.debris_fraction for outcome in outcomes]
        found = problem.evaluate(layout, SEEDS)
        assert found.outcomes == outcomes
        assert (found.layout, found.seeds, found.cost) == (layout, SEEDS, ramp.cost(layout))
        assert found.debris == pytest.approx(math.fsum(debris) / 4, rel=1e-14)
        charge = 0.5 * ramp.cost(layout) / ramp.costs.limit
        assert found.objective == pytest.approx(2.0 * found.debris + charge, rel=1e-14)
        nearest = min(range(4), key=lambda i: abs(debris[i] - found.debris))
        assert found.typical == SEEDS[nearest]


def test_cost_above_the_limit_is_charged_tenfold_and_simulated(ramp: Site) -> None:
    cost = ramp.cost(LAYOUT)
    problem = DesignProblem(ramp, cost_limit=0.4 * cost)
    assert problem.penalised(0.4 * cost) == 0.4 * cost
    assert problem.penalised(cost) == pytest.approx(6.4 * cost)
    dear = problem.evaluate(LAYOUT, SEEDS)
    assert dear.outcomes == DesignProblem(ramp).evaluate(LAYOUT, SEEDS).outcomes
    assert dear.cost == cost
    assert dear.objective == pytest.approx(dear.debris + 0.2 * 16.0)


def test_intervals_are_student_s(ramp: Site) -> None:
    near = msgspec.structs.replace(ramp, road=Road(23.0, 31.0))
    problem = DesignProblem(near, 2, ("wall",), risk_weight=2.0, cost_weight=0.5)
    found = problem.evaluate((), SEEDS)
    debris = np.array([outcome.debris_fraction for outcome in found.outcomes])
    assert debris.std() > 0.0
    for values, mean, interval in (
        (2.0 * debris, found.objective, found.ci),
        (debris, found.debris, found.debris_ci),
    ):
        low, high = stats.t.interval(0.95, 3, mean, stats.sem(values))
        if values is debris:
            low, high = max(low, 0.0), min(high, 1.0)
        assert interval == pytest.approx((low, high), rel=1e-12)


def test_one_release_tells_nothing_about_the_mean(problem: DesignProblem) -> None:
    found = problem.evaluate(LAYOUT, [7])
    assert found.ci == (-math.inf, math.inf)
    assert found.debris_ci == (0.0, 1.0)


def test_interval_covers_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    samples = rng.normal(3.0, 2.0, (4000, 6))
    covered = [low <= 3.0 <= high for low, high in map(student_interval, samples)]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.012)


def test_processes_give_what_threads_give(problem: DesignProblem) -> None:
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=spawn) as pool:
        there = problem.evaluate(LAYOUT, SEEDS, pool)
    assert there == problem.evaluate(LAYOUT, SEEDS)


def test_what_happens_without_barriers_is_remembered(
    problem: DesignProblem, ramp: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated: list[tuple[tuple[Wall, ...], int]] = []

    def count(jobs: list) -> list:
        simulated.extend((layout, seed) for _, layout, seed in jobs)
        return [rigdda.release(*job)[1] for job in jobs]

    monkeypatch.setattr(rigdda, "release_many", count)
    monkeypatch.setattr(baseline, "memory", Memory(8))
    first = problem.evaluate((), [8, 9, 8])
    assert simulated == [((), 8), ((), 9)]
    assert first.outcomes[0] == first.outcomes[2]
    assert DesignProblem(ramp).evaluate((), [9, 10, 8]).outcomes[::2] == first.outcomes[1::-1]
    assert simulated[2:] == [((), 10)]
    other = msgspec.structs.replace(ramp, surfaces={"rock": Surface(24.0)})
    DesignProblem(other).evaluate((), [8])
    for _ in range(2):
        problem.evaluate(LAYOUT, [8])
    assert simulated[3:] == [((), 8), (LAYOUT, 8), (LAYOUT, 8)]


def test_memory_is_bounded() -> None:
    memory: Memory[int, str] = Memory(2)
    memory.remember({1: "a", 2: "b"})
    assert memory.recall([1, 5]) == {1: "a"}  # and so it is the latest
    memory.remember({3: "c"})
    assert memory.recall(range(5)) == {1: "a", 3: "c"}


def test_sites_by_name_file_and_object(ramp: Site, tmp_path: Path) -> None:
    ramp.save(tmp_path / "ramp.toml")
    assert DesignProblem(tmp_path / "ramp.toml") == DesignProblem(ramp)
    assert DesignProblem("quick").site == Site.load("quick")
    assert DesignProblem(ramp).cost_limit == ramp.costs.limit
    assert pickle.loads(pickle.dumps(DesignProblem(ramp))) == DesignProblem(ramp)


def test_bounds_and_vectors(problem: DesignProblem) -> None:
    low, high = problem.bounds
    np.testing.assert_array_equal([low, high], [[-1.0] * 6, [1.0] * 6])
    assert problem.decode(low) == ()
    (wall,) = problem.decode(problem.encode(LAYOUT))
    assert (wall.x, wall.height, wall.thickness) == pytest.approx((18.0, 1.0, 1.0), abs=1e-9)
    with pytest.raises(BadInput, match=r"shape of vector = \(9,\): give 6 numbers"):
        problem.decode(np.zeros(9))


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"site": "nowhere"}, "site = 'nowhere': choose one of"),
        ({"site": "nowhere.toml"}, "site = 'nowhere.toml': name an existing"),
        ({"site": 5}, "site = 5: give a name"),
        ({"max_barriers": 0}, "max_barriers = 0: give a whole number"),
        ({"max_barriers": 2.0}, "max_barriers = 2.0"),
        ({"max_barriers": 10**6}, "max_barriers = 1000000"),
        ({"kinds": ("moat",)}, "kinds = 'moat': choose one of ditch, .*, wall"),
        ({"kinds": ()}, "kinds = .*: name each kind once"),
        ({"kinds": ("wall", "wall")}, "kinds = .*: name each kind once"),
        ({"risk_weight": -1.0}, "risk_weight = -1.0"),
        ({"cost_weight": math.nan}, "cost_weight = nan: give a finite number"),
        ({"cost_limit": 0.0}, "cost_limit = 0.0: give a number above 1e-12"),
        ({"cost_limit": 1e-308}, "cost_limit = 1e-308: give a number above 1e-12"),
        ({"risk_weight": 1e14}, "risk_weight = .*at most 1e\\+12"),
        ({"cost_weight": 1e14}, "cost_weight = .*at most 1e\\+12"),
    ],
)
def test_bad_keywords_are_refused(keywords: dict, message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        DesignProblem(**{"site": "quick", **keywords})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", [field.name for field in msgspec.structs.fields(Costs)])
def test_a_price_that_makes_no_objective_is_refused(name: str, ramp: Site) -> None:
    costs = msgspec.structs.replace(ramp.costs, **{name: 1e14})
    with pytest.raises(BadInput, match=rf"costs\.{name} = .*at most 1e\+12"):
        DesignProblem(msgspec.structs.replace(ramp, costs=costs))


def test_sites_without_room_or_matter_for_barriers_are_refused(ramp: Site) -> None:
    short = msgspec.structs.replace(ramp, barrier_zone=BarrierZone(10.0, 11.0))
    with pytest.raises(BadInput, match=r"barrier_zone\.end = 11\.0: put it at least max_thickness"):
        DesignProblem(short, kinds=("wall",))
    clay = msgspec.structs.replace(
        ramp,
        surfaces={"clay": Surface(25.0)},
        slope=msgspec.structs.replace(ramp.slope, surface="clay"),
        source=msgspec.structs.replace(ramp.source, surface="clay"),
    )
    with pytest.raises(BadInput, match=r"surfaces = \['clay'\]: define concrete"):
        DesignProblem(clay)


@pytest.mark.parametrize(
    ("layout", "seeds", "message"),
    [
        ((), [], "seeds = .*: give at least one"),
        ((), 5, "seeds = 5: give a sequence"),
        ((), [1, -1], r"seeds\[1\] = -1: give a whole number of at least 0"),
        ((), [1.5], r"seeds\[0\] = 1.5"),
        ((Wall(5.0, 1.0),), [1], r"layout\[0\]\.x = 5\.0"),
        ((Wall(15.0, 9.0),), [1], r"layout\[0\]\.height = 9\.0"),
    ],
)
def test_bad_layouts_and_seeds_are_refused(
    problem: DesignProblem, layout: tuple, seeds: list, message: str
) -> None:
    with pytest.raises(BadInput, match=message):
        problem.evaluate(layout, seeds)
