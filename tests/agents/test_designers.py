"""Designers keep their budget, repeat, count every release and are not fooled by noise."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from valley import SITE, Valley

import rigdda.agents
from rigdda import BadInput, Barrier, Fence, Layout, Outcome
from rigdda.agents import DESIGNERS
from rigdda.agents.designers.convex import starts
from rigdda.agents.designers.protocol import (
    MISSED_TARGET_PENALTY,
    DesignResult,
    Ledger,
    Plan,
    final_score,
    score,
    search,
    value,
    verify,
)
from rigdda.barriers import KINDS
from rigdda.envs import DesignProblem
from rigdda.envs.problem import Targets
from rigdda.seeds import is_of_stream

SEARCHES = ("cma", "pareto", "race", "random", "tpe")
FIXED = ("constant", "rule")
"""Designers that search, and those that give one layout."""

ALL = (*SEARCHES, "convex", "policy", "value", *FIXED)


def design(name: str, problem: DesignProblem, simulations: int, seed: int = 0) -> DesignResult:
    found: DesignResult = getattr(rigdda.agents, name).design(problem, simulations, seed)
    return found


@pytest.mark.parametrize(
    "simulations", [2, 17, 200, *(pytest.param(n, marks=pytest.mark.slow) for n in (5, 64))]
)
@pytest.mark.parametrize("name", ALL)
def test_a_budget_is_kept_and_what_is_reported_chose_nothing(
    name: str, simulations: int, valley: Valley
) -> None:
    result = design(name, valley, simulations)
    counts = [entry.simulations for entry in result.history.entries]
    assert counts == sorted(counts) and counts[-1] == result.simulations <= simulations
    assert result.layout == result.evaluation.layout
    last = result.history.entries[-1]
    assert last.stage == "report" and last.evaluation == result.evaluation
    assert len(result.history.stage("report")) == 1
    searched = {s for e in result.history.entries[:-1] for s in e.evaluation.seeds}
    assert not searched & set(result.evaluation.seeds)
    assert all(entry.evaluation.outcomes == () for entry in result.history.entries)


@pytest.mark.parametrize("name", ALL)
def test_the_same_seed_gives_the_same_result(name: str, valley: Valley) -> None:
    np.random.seed(5)  # noqa: NPY002
    first = design(name, valley, 150, seed=3)
    np.random.seed(6)  # noqa: NPY002
    assert design(name, valley, 150, seed=3) == first
    other = design(name, valley, 40, seed=4)
    assert not set(other.evaluation.seeds) & set(first.evaluation.seeds)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("kinds", [("wall",), ("gravity_wall", "ditch"), ("fence",)])
def test_a_designer_builds_only_what_is_allowed(name: str, kinds: tuple[str, ...]) -> None:
    problem = Valley(SITE, 2, kinds)
    result = design(name, problem, 100)
    tried = {b.kind for e in result.history.entries for b in e.evaluation.layout}
    assert tried <= set(kinds)
    assert all(problem.fits(e.evaluation.layout) for e in result.history.entries)


@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_is_better_than_no_barrier(name: str, valley: Valley) -> None:
    found = design(name, valley, 1500)
    assert valley.truth(found.layout) < valley.truth(())
    assert () in {e.evaluation.layout for e in found.history.stage("final")}


@pytest.mark.parametrize("name", ["cma", "tpe"])
def test_what_needs_no_search_is_in_the_final(name: str, valley: Valley) -> None:
    """Of two releases a layout the luckiest come out best."""
    found = design(name, valley, 400)
    last = {e.evaluation.layout for e in found.history.stage("final")}
    ledger = Ledger(valley, 400, 0, None, None)
    starts(ledger)
    assert ledger.known and {(), *ledger.known} < last


@pytest.mark.parametrize("name", ["cma", "tpe"])
def test_a_search_goes_on_from_its_starts(
    name: str, valley: Valley, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a fence that is too high and of too high a class, and 1 m off."""
    first: Layout = (Fence(21.0, 4.0, energy_class=500),)

    def starts(ledger: Ledger) -> list[Layout]:
        ledger.starts |= {first, ()}
        return [first, ()]

    monkeypatch.setattr(f"rigdda.agents.{name}.starts", starts)
    found = design(name, valley, 3000)
    assert found.origin == "search"
    gain = valley.truth(first) - valley.truth((Fence(20.0, 3.0, energy_class=250),))
    assert valley.truth(found.layout) < valley.truth(first) - 0.3 * gain


@pytest.mark.parametrize("name", ["cma", "random", "tpe"])
def test_all_layouts_of_a_search_meet_the_same_releases(name: str, valley: Valley) -> None:
    result = design(name, valley, 400)
    for stage in ("search", "final"):
        assert len({entry.evaluation.seeds for entry in result.history.stage(stage)}) == 1
    verified = set(verify(valley, (), 50).seeds)
    assert not verified & {s for e in result.history.entries for s in e.evaluation.seeds}


@pytest.mark.parametrize("name", FIXED)
def test_what_does_not_search_says_so(name: str, valley: Valley) -> None:
    result = design(name, valley, 200)
    assert result.origin == "start"
    assert len(result.history.entries) == 1


@pytest.mark.parametrize("simulations", [1, 2, 16, 80, 240, 1000, 20_000])
def test_a_plan_leaves_half_of_the_budget_to_the_search(simulations: int) -> None:
    plan = Plan.of(simulations)
    assert plan.reserve <= max(1, simulations // 2)
    assert plan.report >= 1 and 1 <= plan.releases <= max(1, simulations // 160)
    assert plan.finalists == 0 or plan.final_releases >= 16


class Lucky(Valley):
    """One layout looks better than it is, but only on the releases of the search."""

    def outcome(self, layout: Layout, seed: int, event: str) -> Outcome:
        if layout and layout[0].x == 30.0 and is_of_stream(seed, "search"):
            return super().outcome((BEST,) * 9, seed, event)
        return super().outcome(layout, seed, event)


BEST: Barrier = Fence(20.0, 3.0, energy_class=250)


def test_the_finals_unmask_a_layout_that_was_lucky_in_the_search() -> None:
    problem = Lucky(SITE)
    layouts = [(Fence(x, 3.0, energy_class=250),) for x in (30.0, 15.0, 20.0, 12.0)]
    result = search(Ledger(problem, 4000, 0, None, None), (x for x in layouts))
    searched = result.history.stage("search")
    best = min(searched, key=lambda e: e.evaluation.objective)
    assert best.evaluation.layout == layouts[0]
    assert result.layout == layouts[2]
    assert len(result.history.stage("final")) == 5  # and no barrier


def test_layouts_that_miss_a_target_rank_behind() -> None:
    problem = Valley(SITE, targets=Targets(reach=0.1))
    seeds = tuple(range(400))
    good = problem.evaluate((BEST, Fence(24.0, 3.0, energy_class=8500)), seeds)
    bad, none = problem.evaluate((Fence(18.5, 3.0, energy_class=250),), seeds), problem.nothing
    assert (good.targets, bad.targets, none.targets) == ("met", "missed", "missed")
    assert good.objective > none.objective > bad.objective
    order = sorted([none, bad, good], key=lambda e: score(problem, e))
    assert order == sorted([none, bad, good], key=lambda e: value(problem, e)) == [good, bad, none]
    assert value(problem, bad) > MISSED_TARGET_PENALTY > value(problem, good) == good.objective
    few = problem.evaluate((BEST,), seeds[:12])
    assert few.targets == "undecided"
    assert score(problem, few)[0] == 0.0 < final_score(problem, few)[0]


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize(
    "simulations, seed",
    [(1, 0), (2.5, 0), (10**9, 0), ("x", 0), (None, 0), (8, -1), (8, 0.5), (8, 2**32), (8, "x")],
)
def test_an_unsound_budget_or_seed_is_refused(
    name: str, simulations: Any, seed: Any, valley: Valley
) -> None:
    with pytest.raises(BadInput, match="whole number"):
        getattr(rigdda.agents, name).design(valley, simulations, seed)


def test_every_designer_has_a_name() -> None:
    assert set(DESIGNERS) == {*ALL, "ppo"}
    assert rigdda.agents.designers.DEFAULT in DESIGNERS
    assert {"fence", "ditch", "embankment"} <= set(KINDS)


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = (
        "import rigdda.app.cli, sys; heavy = {'torch', 'stable_baselines3', 'matplotlib', "
        "'rerun', 'cvxpy', 'numba', 'cma', 'optuna', 'safetensors'} & set(sys.modules); "
        "assert not heavy, heavy; "
        "import random; random.random()"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_site_is_no_problem() -> None:
    with pytest.raises(BadInput, match="DesignProblem"):
        rigdda.agents.designers.race.design(SITE, simulations=10)
