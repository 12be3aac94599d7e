"""Stations and heights by mixed-integer linear programming on one barrier-free ensemble.

A wall is estimated to stop each block that crosses its station with the centroid below its top, as
long as there is room behind it; walls add up. With z[k, j] = 1 for a wall of height j at station
k, and p_r the share of release r that still reaches the road,

    minimise    risk_weight mean(p) + cost_weight cost.z / limit
    subject to  p_r >= base_r - sum_kj relief[r, k, j] z[k, j],  p_r >= 0
                CVaR_0.9(p) <= c CVaR_0.9(base),  cost.z <= limit,  sum z <= max_barriers
                walls at least MIN_GAP apart

with CVaR as in Rockafellar and Uryasev (2000, J. Risk 2, 21-41), a linear programme. The room is
between two bounds: what comes to rest loosely at the angle of friction, and without end where
blocks lock and lean on each other. Nor does the estimate know what a wall does to the flow further
down. So the programme is solved for both bounds and a ladder of limits c, and the simulation has
the last word.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from agents.crossings import Ensemble, ensemble_for
from agents.protocol import DesignResult, Ledger, Progress, Proposals, search
from agents.store import Store
from envs import DesignProblem
from envs.encoding import MIN_GAP, MIN_HEIGHT
from rigdda import Layout, Site, Wall, check

LEVELS = 8
"""Heights between the least and the largest."""
FILL = 0.8
"""Share of a deposit that is rock, the rest voids between blocks: assumed."""
TAIL = 0.9
LADDER = (1.0, 0.3)
"""Limits of CVaR, as shares of that without barriers; 1 binds nothing."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """The programme's numbers: R releases, K stations, J heights.

    Parameters
    ----------
    walls : K rows of J walls
        Those that may be built.
    base : (R,) array
        Share of the released mass that reaches the road without barriers.
    relief : (R, K, J) array
        Share of the released mass that a wall keeps off the road.
    cost : (K, J) array
        Prices of walls, as shares of the limit.
    """

    walls: list[list[Wall]]
    base: Floats
    relief: Floats
    cost: Floats


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the programme's layout that does best in simulation.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2, the seed below 0 or walls are not among the kinds; if a
        simulation diverges.
    """
    check.one_of("kind of convex", "wall", problem.kinds)
    ledger = Ledger(problem, simulations, seed, progress, store)
    return search(ledger, _propose(candidates(problem, ensemble_for(ledger))))


def _propose(layouts: list[Layout]) -> Proposals:
    """Yield the layouts and, so that the result is never worse, no barrier."""
    for layout in dict.fromkeys([*layouts, ()]):  # noqa: UP028, a list cannot be sent values
        yield layout


def candidates(problem: DesignProblem, ensemble: Ensemble) -> list[Layout]:
    """Return the different optima over both bounds and the ladder, loosest limits first."""
    tables = [tabulate(problem, ensemble, locked) for locked in (True, False)]
    found: dict[Layout, None] = {}
    for limit, table in product(LADDER, tables):
        chosen = solve(table, problem, limit)
        if chosen is not None:
            found[tuple(table.walls[k][j] for k, j in np.argwhere(chosen))] = None
    return list(found)


def tabulate(problem: DesignProblem, ensemble: Ensemble, locked: bool) -> Table:
    """Return the programme's numbers for a site and its barrier-free ensemble.

    Parameters
    ----------
    locked : bool
        Whether there is always room behind a wall, instead of that for a loose deposit.
    """
    site, zone = problem.site, problem.site.barrier_zone
    heights = np.linspace(MIN_HEIGHT, zone.max_height, LEVELS)
    walls = [
        [Wall(x, h, zone.min_thickness) for h in heights.tolist()]
        for x in ensemble.stations.tolist()
    ]
    room = np.array([[capacity(site, wall) for wall in row] for row in walls])
    stopped, risky = (
        _stopped(ensemble, heights, which)
        for which in (np.ones(len(ensemble.crossings), dtype=bool), ensemble.reach_road())
    )
    held = 1.0 if locked else np.minimum(1.0, room / np.maximum(stopped, 1e-9))
    at_road = ensemble.at(len(ensemble.stations))
    base = np.bincount(at_road["release"], at_road["mass"], minlength=len(ensemble.mass))
    return Table(
        walls=walls,
        base=base / ensemble.mass,
        relief=np.maximum.accumulate(risky * held, axis=2) / ensemble.mass[:, None, None],
        cost=np.array([[site.cost([w]) for w in row] for row in walls]) / problem.cost_limit,
    )


def _stopped(ensemble: Ensemble, heights: Floats, which: NDArray[np.bool_]) -> Floats:
    """Return the mass that crosses below each height, (R, K, J) [kg/m], of some crossings."""
    stations = len(ensemble.stations)
    out = np.zeros((len(ensemble.mass), stations, len(heights)))
    table = ensemble.crossings[which & (ensemble.crossings["station"] < stations)]
    for j, height in enumerate(heights):
        low = table[table["height"] <= height]
        np.add.at(out[:, :, j], (low["release"], low["station"]), low["mass"])
    return out


def capacity(site: Site, wall: Wall) -> float:
    """Return the rock that fits behind a wall [kg/m].

    Its surface rises uphill from the wall's top at the angle of friction until it meets the
    ground, as steep as a deposit that leans on the wall can be.
    """
    terrain = site.profile
    top = float(wall.outline(terrain)[:, 1].max())
    rise = math.tan(math.radians(min(s.friction_deg for s in site.surfaces.values())))
    x = np.linspace(wall.x, float(terrain.points[0, 0]), 1000)
    chainage, ground = terrain.points.T
    over = np.interp(x, np.maximum.accumulate(chainage), ground)  # overhangs are filled
    depth = top + rise * (wall.x - x) - over
    full = np.minimum.accumulate(depth) > 0.0
    area = float(np.sum(depth[full]) * abs(x[1] - x[0]))
    return FILL * site.source.density * area


def solve(table: Table, problem: DesignProblem, limit: float) -> NDArray[np.bool_] | None:
    """Return which walls to build, (K, J), or None if no choice keeps the CVaR limit.

    Parameters
    ----------
    limit : float
        Largest CVaR, as a share of that of `table.base`.
    """
    import cvxpy as cp

    releases, stations, heights = table.relief.shape
    z = cp.Variable((stations, heights), boolean=True)
    passing = cp.Variable(releases, nonneg=True)
    cost = cp.sum(cp.multiply(table.cost, z))
    built = cp.sum(z, axis=1)
    rules = [
        passing >= table.base - table.relief.reshape(releases, -1) @ cp.vec(z, order="C"),
        cp.cvar(passing, TAIL) <= limit * cp.cvar(table.base, TAIL).value,
        cost <= 1.0,
        cp.sum(built) <= problem.max_barriers,
        _near(table) @ built <= 1,
    ]
    goal = problem.risk_weight * cp.mean(passing) + problem.cost_weight * cost
    cp.Problem(cp.Minimize(goal), rules).solve(solver=cp.HIGHS)
    return None if z.value is None else z.value > 0.5


def _near(table: Table) -> Floats:
    """Return for each station which ones are too close downhill of it, itself included, (K, K)."""
    walls = [row[0] for row in table.walls]
    ahead = np.array([[down.x - up.x for down in walls] for up in walls])
    close = [[MIN_GAP + up.thickness] for up in walls]
    return ((ahead >= 0.0) & (ahead < close)).astype(np.float64)
