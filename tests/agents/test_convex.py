"""The mixed-integer programme against exhaustive choice, its numbers against closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from agents import convex
from agents.catalogue import CAPACITIES, HEIGHTS, Catalogue, room_behind, tabulate
from agents.crossings import CROSSING, Ensemble, ensemble
from agents.programme import choose
from envs import DesignProblem
from rigdda import Barrier, Fence, Site, Wall


def cvar(values: np.ndarray, beta: float) -> float:
    """Mean of the worst 1 - beta, the last of them in part (Rockafellar and Uryasev 2002)."""
    worst = np.sort(values)[::-1]
    share = np.clip((1 - beta) * len(values) - np.arange(len(values)), 0.0, 1.0)
    return float(worst @ share / ((1 - beta) * len(values)))


def cheapest_by_trying_all(table: Catalogue, slots: int, limit: float) -> float:
    """Return the least cost over every choice of barriers."""
    spots = [(k, j) for k in range(len(table.barriers)) for j in range(len(table.barriers[0]))]
    x = [row[0].x for row in table.barriers]
    best = math.inf
    for n in range(slots + 1):
        for chosen in itertools.combinations(spots, n):
            at = sorted(x[k] for k, _ in chosen)
            if any(b - a < 2.5 for a, b in itertools.pairwise(at)):
                continue
            relief = sum((table.relief[:, k, j] for k, j in chosen), np.zeros(len(table.base)))
            passing = np.maximum(table.base - relief, 0.0)
            cost = sum(table.cost[k, j] for k, j in chosen)
            if cost <= 1.0 and cvar(passing, 0.9) <= limit * cvar(table.base, 0.9) + 1e-9:
                best = min(best, cost)
    return best


@pytest.mark.parametrize("limit", [1.0, 0.6, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_the_programme_finds_the_cheapest_choice(seed: int, limit: float) -> None:
    rng = np.random.default_rng(seed)
    stations, heights = (10.0, 11.5, 14.0, 18.0, 19.9), (1.0, 2.0, 3.0)
    table = Catalogue(
        barriers=[[Wall(x, h, 0.5) for h in heights] for x in stations],
        base=rng.uniform(0.2, 0.5, 12),
        relief=np.cumsum(rng.uniform(0.0, 0.12, (12, 5, 3)), axis=2),
        cost=np.cumsum(rng.uniform(0.05, 0.4, (5, 3)), axis=1),
    )
    best = cheapest_by_trying_all(table, 2, limit)
    choice = choose(table, 2, limit)
    if choice is None:
        assert best == math.inf
        return
    assert choice.cost == pytest.approx(best, abs=1e-6)
    assert choice.bound <= choice.cost + 1e-6
    assert (limit < 1.0) == (choice.bound > 0.0)


def test_the_deposit_behind_a_wall_is_the_triangle_of_closed_form(site: Site) -> None:
    slope, friction = math.atan2(25.0, 20.0), math.radians(22.0)
    length = 3.0 / (math.tan(slope) - math.tan(friction))
    area = 3.0 * length / 2.0
    expected = 0.8 * site.source.density * area
    assert room_behind(site, Wall(20.0, 3.0)) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("locked", [True, False])
@pytest.mark.parametrize("kinds", [("wall",), ("fence",), ("ditch", "fence", "wall")])
def test_without_barriers_the_catalogue_says_what_the_simulation_says(
    locked: bool, kinds: tuple[str, ...], site: Site
) -> None:
    problem, seeds = DesignProblem(site, kinds=kinds), (3, 4, 5)
    looked = ensemble(problem.site, seeds)
    table = tabulate(problem, looked, locked)
    simulated = problem.evaluate((), seeds)
    debris = [outcome.debris_fraction for outcome in simulated.outcomes]
    assert table.base == pytest.approx(debris, abs=1e-9)
    assert looked.mass == pytest.approx([o.released_mass for o in simulated.outcomes])
    models = ("wall" in kinds) + CAPACITIES * ("fence" in kinds)
    assert table.relief.shape == (3, len(looked.stations), HEIGHTS * models)
    assert (table.relief >= 0.0).all()
    assert (table.relief <= table.base[:, None, None] + 1e-12).all()


@pytest.mark.parametrize(
    "locked, expected", [(True, [1.0, 2.0, 3.0, 3.0]), (False, [0.0, 0.0, 3.0, 3.0])]
)
def test_a_fence_stops_blocks_in_their_order_until_its_capacity_is_spent(
    locked: bool, expected: list[float], site: Site
) -> None:
    table = np.zeros(6, dtype=CROSSING)  # three blocks at the only station, then on the road
    table["station"] = [0, 0, 0, 1, 1, 1]
    table["block"] = [0, 1, 2, 0, 1, 2]
    table["time"] = [3.0, 1.0, 2.0, 4.0, 4.0, 4.0]
    table["energy"] = [1e6, 1e5, 2e5, 1e5, 1e5, 1e5]
    table["mass"] = 100.0
    looked = Ensemble(np.array([20.0]), table, np.array([1e4]), 0.5)
    made = tabulate(DesignProblem(site, kinds=("fence",)), looked, locked)
    fences = made.barriers[0]
    capacities = [b.capacity for b in fences[HEIGHTS - 1 :: HEIGHTS] if isinstance(b, Fence)]
    assert capacities == pytest.approx(np.geomspace(1e5, 5e6, 4))
    assert made.relief[0, 0, HEIGHTS - 1 :: HEIGHTS] == pytest.approx(np.array(expected) / 100.0)


@pytest.mark.parametrize("kinds", [("wall",), ("fence",), ("wall", "fence")])
def test_optima_are_layouts_that_may_be_built(kinds: tuple[str, ...], site: Site) -> None:
    problem = DesignProblem(site, kinds=kinds)
    found = convex.optima(problem, ensemble(site, (1, 2, 3, 4)))
    assert found and len(found) == len({choice.layout for choice in found})
    for choice in found:
        assert choice.cost == pytest.approx(site.cost(choice.layout) / problem.cost_limit)
        assert choice.bound <= choice.cost + 1e-9 <= 1.0 + 2e-9
        again = problem.decode(problem.encode(choice.layout))
        assert [b.x for b in again] == pytest.approx([b.x for b in choice.layout])
        assert [b.height for b in again] == pytest.approx([b.height for b in choice.layout])


@pytest.mark.parametrize("limit, layout", [(0.5, None), (1.0, ())])
def test_where_nothing_helps_nothing_is_built(limit: float, layout: tuple | None) -> None:
    walls: list[list[Barrier]] = [[Wall(10.0, 1.0)]]
    table = Catalogue(walls, np.full(4, 0.3), np.zeros((4, 1, 1)), np.ones((1, 1)))
    choice = choose(table, 2, limit)
    assert (choice and choice.layout) == layout
