"""Barriers that may be built at each station, and what each is estimated to keep off the road.

A barrier is estimated to stop each block that crosses its station with the centroid below its top,
as long as there is room behind it and, for a fence, until the energies of what it stopped exceed
its capacity. Both the room and what becomes of the blocks behind a failed fence are between two
bounds: blocks that come to rest loosely, at the angle of friction and no longer than the fence
stands, and blocks that lock and lean on each other, without end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.crossings import Ensemble
from envs import DesignProblem
from envs.encoding import MIN_HEIGHT
from rigdda import Barrier, Fence, Site, Wall
from rigdda.site import BarrierZone

HEIGHTS = 8
"""Heights between the least and the greatest."""
CAPACITIES = 4
"""Capacities of fences between the least and the greatest, in equal ratios."""
FILL = 0.8
"""Share of a deposit that is rock, the rest voids between blocks: assumed."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Catalogue:
    """Numbers of what may be built: R releases, K stations, J barriers a station.

    Parameters
    ----------
    barriers : K rows of J barriers
        Those that may be built.
    base : (R,) array
        Share of the released mass that reaches the road without barriers.
    relief : (R, K, J) array
        Share of the released mass that a barrier keeps off the road.
    cost : (K, J) array
        Prices, as shares of the limit.
    """

    barriers: list[list[Barrier]]
    base: Floats
    relief: Floats
    cost: Floats


def tabulate(problem: DesignProblem, ensemble: Ensemble, locked: bool) -> Catalogue:
    """Return the catalogue of a problem's walls and fences on its barrier-free ensemble.

    Parameters
    ----------
    locked : bool
        Whether blocks lock behind a barrier, instead of resting there loosely.
    """
    zone, stations = problem.site.barrier_zone, ensemble.stations.tolist()
    at_road = ensemble.at(len(stations))
    base = np.bincount(at_road["release"], at_road["mass"], minlength=len(ensemble.mass))
    barriers: list[list[Barrier]] = [[] for _ in stations]
    parts = []
    heights = np.linspace(MIN_HEIGHT, zone.max_height, HEIGHTS).tolist()
    for capacity in _capacities(zone, problem.kinds):
        rows = [[_barrier(zone, x, h, capacity) for h in heights] for x in stations]
        parts.append(_relief(problem.site, ensemble, rows, capacity, locked))
        for row, new in zip(barriers, rows, strict=True):
            row += new
    cost = [[problem.site.cost([b]) for b in row] for row in barriers]
    return Catalogue(
        barriers=barriers,
        base=base / ensemble.mass,
        relief=np.concatenate(parts, axis=2) / ensemble.mass[:, None, None],
        cost=np.array(cost) / problem.cost_limit,
    )


def _capacities(zone: BarrierZone, kinds: Sequence[str]) -> list[float]:
    """Return the capacity of each model that may be built [J/m]; that of a wall has no end."""
    fences = np.geomspace(zone.min_capacity, zone.max_capacity, CAPACITIES).tolist()
    return [math.inf] * ("wall" in kinds) + fences * ("fence" in kinds)


def _barrier(zone: BarrierZone, x: float, height: float, capacity: float) -> Wall | Fence:
    """Return a barrier of a model at a chainage [m] and of a height [m]."""
    if math.isinf(capacity):
        return Wall(x, height, zone.min_thickness)
    return Fence(x, height, capacity)


def _relief(
    site: Site, ensemble: Ensemble, rows: list[list[Wall | Fence]], capacity: float, locked: bool
) -> Floats:
    """Return the mass that barriers of one capacity keep off the road, (R, K, J) [kg/m]."""
    heights = [barrier.height for barrier in rows[0]]
    stopped, risky, failed = (
        np.stack(part, axis=2)
        for part in zip(*(_stopped(ensemble, h, capacity) for h in heights), strict=True)
    )
    if locked:
        return np.maximum.accumulate(risky, axis=2)
    room = np.array([[room_behind(site, barrier) for barrier in row] for row in rows])
    held = np.minimum(1.0, room / np.maximum(stopped, 1e-9)) * ~failed
    return risky * held if failed.any() else np.maximum.accumulate(risky * held, axis=2)


def _stopped(
    ensemble: Ensemble, height: float, capacity: float
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return what barriers of a height and capacity stop at every station, each (R, K).

    The mass, that of blocks which would reach the road [kg/m], and whether the capacity was
    exceeded.
    """
    shape = len(ensemble.mass), len(ensemble.stations)
    low = (ensemble.crossings["station"] < shape[1]) & (ensemble.crossings["height"] <= height)
    table, risky = ensemble.crossings[low], ensemble.reach_road()[low]
    order = np.lexsort((table["time"], table["station"], table["release"]))
    table, risky = table[order], risky[order]
    group = table["release"] * shape[1] + table["station"]
    total = np.cumsum(table["energy"])
    first = np.searchsorted(group, group)  # where the group of each crossing begins
    taken = total - total[first] + table["energy"][first]
    stands = taken <= capacity

    def sums(weights: Floats) -> Floats:
        out = np.zeros(shape[0] * shape[1])
        np.add.at(out, group, weights)
        return out.reshape(shape)

    mass = table["mass"] * stands
    return sums(mass), sums(mass * risky), sums(1.0 - stands) > 0.0


def room_behind(site: Site, barrier: Wall | Fence) -> float:
    """Return the rock that fits behind a barrier [kg/m].

    Its surface rises uphill from the barrier's top at the angle of friction until it meets the
    ground, as steep as a deposit that leans on it can be.
    """
    terrain = site.profile
    top = float(barrier.outline(terrain)[:, 1].max())
    rise = math.tan(math.radians(min(s.friction_deg for s in site.surfaces.values())))
    x = np.linspace(barrier.x, float(terrain.points[0, 0]), 1000)
    chainage, ground = terrain.points.T
    over = np.interp(x, np.maximum.accumulate(chainage), ground)  # overhangs are filled
    depth = top + rise * (barrier.x - x) - over
    full = np.minimum.accumulate(depth) > 0.0
    area = float(np.sum(depth[full]) * abs(x[1] - x[0]))
    return FILL * site.source.density * area
