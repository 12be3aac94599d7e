"""Designers keep their budget, repeat, count every release and are not fooled by noise."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from valley import Valley

import agents
from agents import DESIGNERS
from agents.protocol import DesignResult, Ledger, Plan, search
from agents.seeds import STREAMS, release_seeds
from agents.verify import verify
from envs import DesignProblem
from rigdda import BadInput, Site, Wall
from rigdda.barriers import KINDS

LOOKED = {"policy": 4, "ppo": 0, "random": 0}
"""Releases that a designer looks at first; the others look at an ensemble."""


def design(name: str, problem: DesignProblem, simulations: int, seed: int = 0) -> DesignResult:
    return getattr(agents, name).design(problem, simulations, seed)


@pytest.mark.parametrize("simulations", [2, 5, 17, 64])
@pytest.mark.parametrize("name", DESIGNERS)
def test_a_budget_is_kept_to_the_release(
    name: str, simulations: int, problem: DesignProblem
) -> None:
    if name == "policy" and simulations <= LOOKED[name]:
        with pytest.raises(BadInput, match="looks at 4 releases first"):
            design(name, problem, simulations)
        return
    result = design(name, problem, simulations)
    assert result.simulations <= simulations
    counts = [entry.simulations for entry in result.history.entries]
    spent = np.diff([0, *counts])
    releases = [len(entry.evaluation.seeds) for entry in result.history.entries]
    ensemble = spent[0] - releases[0]
    assert ensemble == LOOKED.get(name, min(16, max(1, simulations // 8)))
    assert spent[1:].tolist() == releases[1:]
    assert counts[-1] == result.simulations
    assert result.layout == result.evaluation.layout
    assert result.evaluation in [entry.evaluation for entry in result.history.entries]


@pytest.mark.parametrize("name", DESIGNERS)
def test_the_same_seed_gives_the_same_result(name: str, problem: DesignProblem) -> None:
    np.random.seed(5)  # noqa: NPY002
    first = design(name, problem, 40, seed=3)
    np.random.seed(6)  # noqa: NPY002
    second = design(name, problem, 40, seed=3)
    assert first == second
    other = design(name, problem, 40, seed=4)
    assert other.evaluation.seeds != first.evaluation.seeds


@pytest.mark.parametrize("name", ["cma", "pareto", "ppo", "random", "tpe"])
@pytest.mark.parametrize("kinds", [("wall",), ("gravity_wall", "ditch"), tuple(KINDS)])
def test_a_search_designs_with_any_kinds(name: str, kinds: tuple[str, ...], site: Site) -> None:
    problem = DesignProblem(site, 2, kinds)
    result = design(name, problem, 40)
    assert result == design(name, problem, 40)
    tried = {b.kind for e in result.history.entries for b in e.evaluation.layout}
    assert tried <= set(kinds) and (tried or name not in ("ppo", "random"))


@pytest.mark.parametrize("name", ["convex", "rule"])
def test_what_knows_walls_and_fences_only_refuses_other_problems(name: str, site: Site) -> None:
    with pytest.raises(BadInput, match="= 'wall': choose one of ditch"):
        design(name, DesignProblem(site, 2, ("ditch",)), 40)


@pytest.mark.parametrize("name", ["cma", "convex", "pareto", "rule", "tpe"])
def test_an_informed_designer_beats_no_barrier_on_unseen_releases(name: str, site: Site) -> None:
    problem = DesignProblem(site, kinds=("wall",), cost_limit=200.0)  # worth their price there
    found = verify(problem, design(name, problem, 160).layout, 32)
    nothing = verify(problem, (), 32)
    assert found.ci[1] < nothing.ci[0]
    assert set(found.seeds) == set(nothing.seeds)


def test_all_layouts_of_a_search_meet_the_same_releases_and_the_finals_others(
    problem: DesignProblem,
) -> None:
    result = design("random", problem, 130)
    assert len({entry.evaluation.seeds for entry in result.history.stage("search")}) == 1
    assert len({entry.evaluation.seeds for entry in result.history.stage("final")}) == 1
    searched = set(result.history.stage("search")[0].evaluation.seeds)
    final = set(result.evaluation.seeds)
    verified = set(verify(problem, (), 8).seeds)
    assert not searched & final and not (searched | final) & verified


def test_streams_of_release_seeds_never_meet() -> None:
    drawn = [
        {s for seed in range(20) for s in release_seeds(stream, seed, 200)} for stream in STREAMS
    ]
    assert len(set.union(*drawn)) == sum(map(len, drawn)) == len(STREAMS) * 20 * 200
    assert release_seeds("search", 3, 8) == release_seeds("search", 3, 32)[:8]


@pytest.mark.parametrize(
    "simulations, plan",
    [
        (1, Plan(1, 0, 2, 0)),
        (16, Plan(1, 0, 2, 3)),
        (80, Plan(2, 0, 2, 16)),
        (240, Plan(6, 0, 5, 19)),
        (320, Plan(8, 0, 5, 25)),
        (400, Plan(8, 0, 5, 32)),
        (1200, Plan(8, 10, 5, 32)),
        (2000, Plan(8, 20, 5, 32)),
    ],
)
def test_a_plan_shrinks_with_the_budget(simulations: int, plan: Plan) -> None:
    assert Plan.of(simulations) == plan


def test_a_search_finds_a_known_optimum(valley: Valley) -> None:
    found = design("cma", valley, 2400)
    assert found.evaluation.objective < 0.01
    assert len(found.layout) == 1


@pytest.mark.parametrize("name", ["cma", "tpe"])
def test_a_search_beats_random_search(name: str, valley: Valley) -> None:
    searched, drawn = design(name, valley, 1200), design("random", valley, 1200)
    assert searched.evaluation.objective < drawn.evaluation.objective


class Lucky(Valley):
    """One layout looks better than it is, but only on the releases of the search."""

    def noise(self, layout: tuple[Wall, ...], seed: int) -> float:
        lucky = bool(layout) and layout[0].height == 1.0
        searching = seed % len(STREAMS) == STREAMS.index("search")
        return -10.0 if lucky and searching else 0.0


def test_the_finals_unmask_a_layout_that_was_lucky_in_the_search(problem: DesignProblem) -> None:
    layouts = [(Wall(16.0, h),) for h in (1.0, 2.0, 2.5, 4.5)]
    result = search(Ledger(Lucky(problem.site), 400, 0, None, None), (x for x in layouts))
    searched = result.history.stage("search")
    assert min(searched, key=lambda e: e.evaluation.objective).evaluation.layout == layouts[0]
    assert result.layout == layouts[2]
    assert len(result.history.stage("final")) == 4


def test_the_best_so_far_never_rises(valley: Valley) -> None:
    at, best = design("random", valley, 300).history.best_so_far()
    assert len(at) == len(best) > 10
    assert (np.diff(at) > 0).all() and (np.diff(best) <= 0).all()


@pytest.mark.parametrize("name", DESIGNERS)
@pytest.mark.parametrize(
    "simulations, seed", [(1, 0), (2.5, 0), (10**9, 0), (8, -1), (8, 0.5), (8, 2**32)]
)
def test_an_unsound_budget_or_seed_is_refused(
    name: str, simulations: float, seed: float, problem: DesignProblem
) -> None:
    with pytest.raises(BadInput, match="whole number"):
        getattr(agents, name).design(problem, simulations, seed)


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = (
        "import agents, agents.cli, sys; heavy = {'torch', 'stable_baselines3', 'matplotlib', "
        "'rerun', 'cvxpy', 'numba', 'cma', 'optuna', 'safetensors'} & set(sys.modules); "
        "assert not heavy, heavy; "
        "import random; random.random()"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
