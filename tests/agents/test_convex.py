"""The mixed-integer programme against exhaustive choice, its numbers against the simulation."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from valley import SITE

from rigdda import Ditch, Fence, GravityWall, Mesh, Site
from rigdda.agents.designers import convex
from rigdda.agents.designers.catalogue import (
    CROSSING,
    Catalogue,
    CrossingEnsemble,
    ensemble,
    tabulate,
    whole,
)
from rigdda.agents.designers.convex import GAP, choose
from rigdda.agents.designers.menu import Menu
from rigdda.envs import DesignProblem


def least_by_trying_all(table: Catalogue, slots: int, cost: float) -> float:
    """Return the least objective over every choice of barriers that do not meet."""
    best = np.inf
    for n in range(slots + 1):
        for chosen in itertools.combinations(range(len(table.barriers)), n):
            spans = sorted(table.span[list(chosen)].tolist())
            if any(b[0] < a[1] + 0.5 for a, b in itertools.pairwise(spans)):
                continue
            if table.capital[list(chosen)].sum() > cost:
                continue
            left = np.maximum(table.base - table.relief[:, list(chosen)].sum(axis=1), 0.0)
            best = min(best, table.annual[list(chosen)].sum() + table.weight @ left)
    return table.standing + best


@pytest.mark.parametrize("seed", range(4))
def test_the_programme_finds_the_best_choice(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = [10.0, 10.0, 10.3, 14.0, 14.0, 18.0, 19.9]
    table = Catalogue(
        barriers=[Fence(at, 2.0, energy_class=100) for at in x],
        weight=np.full(12, 0.01),
        base=rng.uniform(1e4, 5e4, 12),
        relief=rng.uniform(0.0, 3e4, (12, 7)),
        annual=rng.uniform(10.0, 1000.0, 7),
        capital=rng.uniform(300.0, 1500.0, 7),
        span=np.array([[at, at + 0.2] for at in x]),
        standing=250.0,
    )
    for slots, cost in ((1, None), (2, None), (3, None), (2, 2_000.0), (3, 1_200.0)):
        choice = choose(table, slots, max_cost=cost)
        best = least_by_trying_all(table, slots, math.inf if cost is None else cost)
        assert best * (1.0 - 1e-6) <= choice.objective <= best * (1.0 + 1.1 * GAP)
        assert choice.bound <= choice.objective + 1e-6
        assert len(choice.layout) <= slots


def test_where_nothing_helps_nothing_is_built() -> None:
    barrier = Fence(10.0, 1.0, energy_class=100)
    weight, base = np.ones(4), np.full(4, 0.3)
    span = np.array([[10.0, 10.2]])
    none = np.zeros((4, 1))
    table = Catalogue([barrier], weight, base, none, np.ones(1), np.ones(1), span, standing=5.0)
    for own in (table, table.take([])):
        choice = choose(own, 2)
        assert choice.layout == ()
        assert (choice.objective, choice.bound) == pytest.approx((6.2, 6.2))


def looked(energy: list[float], speed: float = 10.0, width: float = 1.0) -> CrossingEnsemble:
    """Return one release whose blocks cross the only station and then the road."""
    n = len(energy)
    table = np.zeros(2 * n, dtype=CROSSING)
    table["station"] = np.repeat([0, 1], n)
    table["block"] = np.tile(np.arange(n), 2)
    table["time"] = np.arange(2 * n)
    table["energy"] = np.tile(energy, 2)
    table["speed"], table["volume"], table["mass"] = speed, 1.0, 2600.0
    table["height"], table["radius"] = 1.0, 0.5
    return CrossingEnsemble(np.array([20.0]), table, np.zeros(1, dtype=int), np.array([width]))


def test_a_fence_stops_blocks_in_their_order_until_its_capacity_is_spent(site: Site) -> None:
    problem = DesignProblem(site)
    fences = [Fence(20.0, h, energy_class=c) for h, c in ((2.0, 250), (2.0, 500), (0.8, 500))]
    table = tabulate(problem, looked([2e5, 2e5, 2e5]), list(fences))
    harm = site.consequences.harm
    assert table.base == pytest.approx([harm(3.0, True)])
    expected = [harm(3.0, True) - harm(left, left > 0.0) for left in (2.0, 1.0, 3.0)]
    assert table.relief[0] == pytest.approx(expected)
    rate = site.rate(site.event_names[0], ())
    mended = rate * 10.0 * site.capital((fences[1],))
    assert table.annual[1] == pytest.approx(site.annual((fences[1],)) + mended)
    assert table.annual[2] == pytest.approx(site.annual((fences[2],)))


def test_walls_are_mended_ditches_hold_what_lands_in_them_mesh_its_share(site: Site) -> None:
    problem = DesignProblem(site)
    light, heavy = GravityWall(20.0, 1.5, 0.5), GravityWall(20.0, 3.0, 2.0)
    wide, narrow = Ditch(20.0, 1.5, 8.0), Ditch(20.0, 1.5, 2.0)
    barriers = [light, heavy, wide, narrow]
    table = tabulate(problem, looked([1e5], 9.0), list(barriers))
    whole_harm = site.consequences.harm(1.0, True)
    assert table.relief[0] == pytest.approx([whole_harm, whole_harm, whole_harm, 0.0])
    capital = [site.annual((b,)) for b in barriers]
    assert table.annual[0] > capital[0] and table.annual[1] == pytest.approx(capital[1])


def test_without_barriers_the_catalogue_says_what_the_simulation_says(site: Site) -> None:
    problem = DesignProblem("quick")
    seeds = {name: (3, 4, 5, 6) for name in problem.site.event_names}
    menu = Menu(problem)
    found = ensemble(problem.site, seeds, menu.stations)
    table = whole(problem, found, menu)
    outcomes = problem.sample((), seeds)
    assert table.base == pytest.approx([problem.site.bill((), o).harm for o in outcomes])
    assert found.width == pytest.approx([o.width for o in outcomes])
    nothing = problem.judge((), outcomes).objective
    assert table.weight @ table.base == pytest.approx(nothing)
    assert (table.relief <= table.base[:, None] + 1e-9).all() and (table.relief >= -1e-9).all()
    mesh = [j for j, b in enumerate(table.barriers) if isinstance(b, Mesh)]
    factor = problem.site.meshes[0].factors["block"]
    block = found.event == problem.site.event_names.index("block")
    assert table.relief[block][:, mesh[0]] == pytest.approx((1.0 - factor) * table.base[block])


def test_optima_are_layouts_that_may_be_built(site: Site) -> None:
    problem = DesignProblem(site)
    menu = Menu(problem)
    seeds = {name: tuple(range(12)) for name in site.event_names}
    found = convex.best_choices(problem, ensemble(site, seeds, menu.stations), menu)
    assert found and len(found) == len({choice.layout for choice in found})
    assert all(problem.fits(choice.layout) for choice in found)
    assert all(choice.bound <= choice.objective + 1e-6 for choice in found)
    assert SITE == site
