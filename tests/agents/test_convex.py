"""The linear programme against exhaustive choice, its numbers against closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from agents import convex
from agents.convex import Table, capacity, solve, tabulate
from agents.crossings import ensemble
from envs import DesignProblem
from rigdda import Site, Wall


def cvar(values: np.ndarray, beta: float) -> float:
    """Mean of the worst 1 - beta, the last of them in part (Rockafellar and Uryasev 2002)."""
    worst = np.sort(values)[::-1]
    share = np.clip((1 - beta) * len(values) - np.arange(len(values)), 0.0, 1.0)
    return float(worst @ share / ((1 - beta) * len(values)))


def best_by_trying_all(table: Table, problem: DesignProblem, limit: float) -> float:
    """Return the least objective over every choice of walls."""
    spots = [(k, j) for k in range(len(table.walls)) for j in range(len(table.walls[0]))]
    x = [row[0].x for row in table.walls]
    best = math.inf
    for n in range(problem.max_barriers + 1):
        for chosen in itertools.combinations(spots, n):
            at = sorted(x[k] for k, _ in chosen)
            if any(b - a < 2.5 for a, b in itertools.pairwise(at)):
                continue
            relief = sum((table.relief[:, k, j] for k, j in chosen), np.zeros(len(table.base)))
            passing = np.maximum(table.base - relief, 0.0)
            cost = sum(table.cost[k, j] for k, j in chosen)
            if cost <= 1.0 and cvar(passing, 0.9) <= limit * cvar(table.base, 0.9) + 1e-9:
                best = min(best, problem.risk_weight * passing.mean() + problem.cost_weight * cost)
    return best


@pytest.mark.parametrize("limit", [1.0, 0.6, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_the_programme_finds_the_best_choice(seed: int, limit: float, site: Site) -> None:
    rng = np.random.default_rng(seed)
    problem = DesignProblem(site, max_barriers=2)
    stations, heights = (10.0, 11.5, 14.0, 18.0, 19.9), (1.0, 2.0, 3.0)
    table = Table(
        walls=[[Wall(x, h, 0.5) for h in heights] for x in stations],
        base=rng.uniform(0.2, 0.5, 12),
        relief=np.cumsum(rng.uniform(0.0, 0.12, (12, 5, 3)), axis=2),
        cost=np.cumsum(rng.uniform(0.05, 0.4, (5, 3)), axis=1),
    )
    best = best_by_trying_all(table, problem, limit)
    chosen = solve(table, problem, limit)
    if chosen is None:
        assert best == math.inf
        return
    passing = np.maximum(table.base - (table.relief * chosen).sum(axis=(1, 2)), 0.0)
    cost = (table.cost * chosen).sum()
    objective = problem.risk_weight * passing.mean() + problem.cost_weight * cost
    assert objective == pytest.approx(best, abs=1e-6)


def test_the_deposit_behind_a_wall_is_the_triangle_of_closed_form(site: Site) -> None:
    slope, friction = math.atan2(25.0, 20.0), math.radians(22.0)
    length = 3.0 / (math.tan(slope) - math.tan(friction))
    area = 3.0 * length / 2.0
    expected = 0.8 * site.source.density * area
    assert capacity(site, Wall(20.0, 3.0)) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("locked", [True, False])
def test_without_walls_the_table_says_what_the_simulation_says(
    locked: bool, problem: DesignProblem
) -> None:
    seeds = (3, 4, 5)
    looked = ensemble(problem.site, seeds)
    table = tabulate(problem, looked, locked)
    simulated = problem.evaluate((), seeds)
    debris = [outcome.debris_fraction for outcome in simulated.outcomes]
    assert table.base == pytest.approx(debris, abs=1e-9)
    assert looked.mass == pytest.approx([o.released_mass for o in simulated.outcomes])
    assert (table.relief >= 0.0).all()
    assert (table.relief <= table.base[:, None, None] + 1e-12).all()
    assert (np.diff(table.relief, axis=2) >= -1e-12).all(), "a higher wall never stops less"


def test_candidates_are_layouts_that_may_be_built(problem: DesignProblem) -> None:
    found = convex.candidates(problem, ensemble(problem.site, (1, 2, 3, 4)))
    assert found and len(found) == len(set(found))
    for layout in found:
        assert problem.site.cost(layout) <= problem.cost_limit
        again = problem.decode(problem.encode(layout))
        assert [w.x for w in again] == pytest.approx([w.x for w in layout])
        assert [w.height for w in again] == pytest.approx([w.height for w in layout])
