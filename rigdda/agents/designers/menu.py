"""Barriers that may be built on a site: all allowed kinds at a grid of stations and sizes.

The module also provides the neighbours of a layout, for local searches, and the bounds on which a
layout lies.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Layout, Mesh
from rigdda.barriers import KINDS, Built, Removal
from rigdda.barriers.base import BOUND_MARGIN
from rigdda.envs import DesignProblem

Floats = NDArray[np.float64]

STATIONS = 32
"""Number of evenly spaced stations in the zone."""


FINEST = 0.1
"""Least step of a station in a search [m]; chainages are rounded to it."""


class Menu:
    """Barriers that a problem allows.

    Parameters
    ----------
    problem : DesignProblem
        The problem with its site, zone and kinds.
    """

    def __init__(self, problem: DesignProblem):
        self.problem, self.zone = problem, problem.zone
        self.room = problem.place

    @cached_property
    def stations(self) -> Floats:
        """Chainages at which barriers are tried: evenly spaced and at corners of the ground [m]."""
        zone = self.zone
        corners = [x for x, _ in self.problem.site.slope.points if zone.start < x < zone.end]
        even = np.linspace(zone.start, zone.end, STATIONS)
        apart = [x for x in even if not corners or np.abs(np.subtract(corners, x)).min() >= FINEST]
        rounded = np.round([*apart, *corners], 2)
        return np.unique(np.clip(rounded, zone.start, zone.end))  # the ends of the zone exactly

    def singles(self, kind: str) -> list[Barrier]:
        """Return all barriers of a kind that may be built, at all stations and of all sizes."""
        if kind == "mesh":
            options = (self.room.mesh(i) for i in range(len(self.problem.site.meshes)))
            return [mesh for mesh in options if self.problem.fits((mesh,))]
        if kind == "removal":
            return [one for one in self.problem.site.removals if self.problem.fits((one,))]
        return self._at_stations(KINDS[kind].catalogue(self.zone))

    def smallest(self) -> list[Barrier]:
        """Return barriers of all kinds of the least sizes of a design, at all stations.

        They are smaller than those of the catalogue, which are meant for a single site. If several
        sites share a budget, a wall of half the height may save more per cost.
        """
        sizes = []
        for kind in (k for k in self.problem.kinds if k in KINDS and KINDS[k].lengths):
            for barrier in itertools.islice(KINDS[kind].catalogue(self.zone), 1):
                small = barrier
                for name, (least, _) in barrier.bounds(self.zone).items():
                    small = small.resized(name, least, self.zone)
                sizes.append(small)
        return self._at_stations(sizes)

    def _at_stations(self, sizes: Iterable[Barrier]) -> list[Barrier]:
        """Return barriers of given sizes at all stations where they may be built."""
        found = []
        for barrier in sizes:
            places = [*self.stations, *self._ends(barrier)]
            put = (self.put(barrier, float(x)) for x in places)
            found += [b for b in put if b is not None]
        return list(dict.fromkeys(found))

    def put(self, barrier: Barrier, x: float) -> Barrier | None:
        """Return a barrier moved to a chainage, or None if it may not be built there."""
        moved = self.room.put(barrier, x)
        return moved if moved is not None and self.problem.fits((moved,)) else None

    def nearest(self, barrier: Barrier, x: float) -> Barrier | None:
        """Return a barrier at the nearest place to a chainage where it may be built, or None."""
        places = [x, *self.stations.tolist(), *self._ends(barrier)]
        found = (self.put(barrier, at) for at in sorted(places, key=lambda at: abs(at - x)))
        return next((b for b in found if b is not None), None)

    def _ends(self, barrier: Barrier) -> list[float]:
        """Return the estimated last chainage in the zone at which a barrier may be built [m]."""
        last = self.zone.end - barrier.extent
        if barrier.deflection > 0.0:
            road = self.problem.site.road.start
            last = min(last, road - barrier.extent - barrier.deflection)
        rounded = math.floor(10.0 * last + 1e-6) / 10.0
        return [rounded if rounded >= self.zone.start else self.zone.start]

    def neighbours(self, layout: Layout, step: float, level: int) -> Iterator[Layout]:
        """Yield layouts that differ from a layout in one station or one size of one barrier.

        Parameters
        ----------
        layout : Layout
            The layout.
        step : float
            Difference of stations [m].
        level : int
            Number of steps by which sizes and classes differ.
        """
        for i, barrier in enumerate(layout):
            for other in self._moved(barrier, step, level):
                changed = tuple(sorted((*layout[:i], other, *layout[i + 1 :]), key=lambda b: b.x))
                if changed != layout and self.problem.fits(changed):
                    yield changed

    def _moved(self, barrier: Barrier, step: float, level: int) -> Iterator[Barrier]:
        """Yield a barrier at other stations and of other sizes, including some that do not fit."""
        if isinstance(barrier, Mesh):
            yield from (b for b in self.singles("mesh") if b != barrier)
            return
        if isinstance(barrier, Removal):
            yield from (b for b in self.problem.site.removals if b != barrier)
            return
        for way in (-1.0, 1.0):
            x = barrier.x + way * step
            yield from self._put(barrier, round(x, 1))
        for other in barrier.varied(level, self.zone):
            yield from self._put(other, barrier.x)

    def _put(self, barrier: Barrier, x: float) -> list[Barrier]:
        moved = self.room.put(barrier, x)
        return [] if moved is None else [moved]


def spread(barriers: Sequence[Barrier], n: int) -> list[Barrier]:
    """Return at most `n` barriers that represent all barriers of one kind, the middle one first.

    They are the barriers nearest to the centres of k-means. Distances are in units of the range of
    each number, and the station has twice the weight.
    """
    if len(barriers) <= n:
        return list(barriers)
    table = np.array([b.numbers for b in barriers])
    table = (table - table.min(axis=0)) / np.maximum(np.ptp(table, axis=0), 1e-9)
    table[:, 0] *= 2.0
    centres = table[_far_apart(table, n)]
    for _ in range(MEANS):
        own = np.argmin(_distances(table, centres), axis=1)
        centres = np.array([table[own == k].mean(axis=0) for k in range(n) if (own == k).any()])
        if len(centres) < n:
            break
    nearest = np.argmin(_distances(table, centres), axis=0).tolist()
    return [barriers[i] for i in dict.fromkeys(nearest)]


MEANS = 5
"""Number of iterations of k-means."""


def _far_apart(table: Floats, n: int) -> list[int]:
    """Return the indices of `n` rows of a table, each the farthest from the rows before it."""
    chosen = [int(np.argmin(np.linalg.norm(table - np.median(table, axis=0), axis=1)))]
    away = np.linalg.norm(table - table[chosen[0]], axis=1)
    while len(chosen) < n:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(table - table[chosen[-1]], axis=1))
    return chosen


def _distances(table: Floats, centres: Floats) -> Floats:
    """Return the distance of every row of a table from every centre, (n, k)."""
    apart: Floats = np.linalg.norm(table[:, None] - centres, axis=2)
    return apart


def on_bound(problem: DesignProblem, layout: Layout) -> tuple[str, ...]:
    """Return descriptions of the bounds of the zone, kind or class list on which a layout lies.

    Bounds of mesh and removals and bounds due to a neighbouring barrier are left out. The greatest
    height of a class of fence is also left out, because the next class is higher and more
    expensive.
    """
    names = []
    for barrier in layout:
        if isinstance(barrier, Built):
            found = [*_place(problem, barrier), *barrier.sizes_at_bounds(problem.zone)]
            names += [f"{barrier.words}: {words}" for words in found]
    return tuple(names)


def _place(problem: DesignProblem, barrier: Barrier) -> list[str]:
    """Return descriptions of the ends of the zone at which a barrier lies."""
    zone, road = problem.zone, problem.site.road.start
    start, end = problem.place.works(barrier)
    found = []
    if start - zone.start <= BOUND_MARGIN:
        found.append("start of the zone")
    if zone.end - end <= BOUND_MARGIN:
        found.append("end of the zone")
    if barrier.deflection > 0.0 and road - end - barrier.deflection <= BOUND_MARGIN:
        found.append("clearance to the road")
    return found
