"""What may be built on a site: barriers of every allowed kind over stations and sizes.

With their neighbours, for searches by steps, and the bounds on which a layout lies.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import (
    Barrier,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    Mesh,
    Wall,
)
from rigdda.barriers import FENCE_CLASSES
from rigdda.envs import DesignProblem
from rigdda.envs.encoding import CLASSES
from rigdda.envs.siting import MIN_HEIGHT, SLENDER

Floats = NDArray[np.float64]

STATIONS = 32
"""Stations across the zone."""


HEIGHTS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
"""Heights of barriers [m]."""


CREST = 1.0
"""Least width of the crest of an embankment [m]: a machine builds it from above."""


FINEST = 0.1
"""Least step of a station in a search [m]; places in it are rounded to it."""


STEP = 0.5
"""Step of heights, depths and widths in a search [m]; of thickness half as much."""


class Menu:
    """Barriers that a problem allows.

    Parameters
    ----------
    problem : DesignProblem
        Its site, zone and kinds.
    """

    def __init__(self, problem: DesignProblem):
        self.problem, self.zone = problem, problem.zone
        self.room = problem.place

    @cached_property
    def stations(self) -> Floats:
        """Chainages where barriers are tried: evenly, and at the corners of the ground [m]."""
        zone = self.zone
        corners = [x for x, _ in self.problem.site.slope.points if zone.start < x < zone.end]
        even = np.linspace(zone.start, zone.end, STATIONS)
        apart = [x for x in even if not corners or np.abs(np.subtract(corners, x)).min() >= FINEST]
        return np.unique(np.round([*apart, *corners], 2))

    @property
    def crest(self) -> float:
        """Least width of the crest of an embankment [m]."""
        return min(max(CREST, self.zone.min_thickness), self.zone.max_thickness)

    def lone(self, kind: str) -> list[Barrier]:
        """Return every barrier of a kind that may be built, over stations and sizes."""
        if kind == "mesh":
            return [self.room.mesh(i) for i in range(len(self.problem.site.meshes))]
        found = []
        for barrier in self._sizes(kind):
            places = [*self.stations, *self._ends(barrier)]
            put = (self.put(barrier, float(x)) for x in places)
            found += [b for b in put if b is not None]
        return list(dict.fromkeys(found))

    def put(self, barrier: Barrier, x: float) -> Barrier | None:
        """Return a barrier moved to a chainage, None if it may not be built there."""
        moved = self.room.put(barrier, x)
        return moved if moved is not None and self.problem.fits((moved,)) else None

    def nearest(self, barrier: Barrier, x: float) -> Barrier | None:
        """Return a barrier where it may be built, as near to a chainage as there is a place."""
        places = [x, *self.stations.tolist(), *self._ends(barrier)]
        found = (self.put(barrier, at) for at in sorted(places, key=lambda at: abs(at - x)))
        return next((b for b in found if b is not None), None)

    def _ends(self, barrier: Barrier) -> list[float]:
        """Return the last chainages where a barrier may stand, as far as is told without trying."""
        last = self.zone.end - barrier.extent
        if isinstance(barrier, Fence):
            assert barrier.elongation is not None  # of its class
            last = min(last, self.problem.site.road.start - barrier.extent - barrier.elongation)
        return [math.floor(10.0 * last + 1e-6) / 10.0]

    def _sizes(self, kind: str) -> Iterator[Barrier]:
        """Yield barriers of a kind, of every size, at the start of the zone."""
        zone, x = self.zone, self.zone.start
        heights = [h for h in HEIGHTS if h <= zone.max_height]
        if kind == "fence":
            for name, row in FENCE_CLASSES.items():
                for h in heights:
                    if row.lowest <= h <= row.height:
                        yield Fence(x, h, energy_class=name)
        elif kind == "ditch":
            for depth in DEPTHS:
                for width in WIDTHS:
                    if depth <= zone.max_depth and zone.min_width <= width <= zone.max_width:
                        yield Ditch(x, depth, width)
        elif kind == "embankment":
            yield from (Embankment(x, h, self.crest) for h in heights)
        else:
            for h in heights:
                thick = round(SLENDER * h, 1)
                thick = min(max(thick, zone.min_thickness), zone.max_thickness)
                yield (GravityWall if kind == "gravity_wall" else Wall)(x, h, thick)

    def neighbours(self, layout: Layout, step: float, level: int) -> Iterator[Layout]:
        """Yield layouts that differ from one in one station or one size of one barrier.

        Parameters
        ----------
        step : float
            By how much stations differ [m].
        level : int
            By how many steps sizes and classes differ.
        """
        for i, barrier in enumerate(layout):
            for other in self._moved(barrier, step, level):
                changed = tuple(sorted((*layout[:i], other, *layout[i + 1 :]), key=lambda b: b.x))
                if changed != layout and self.problem.fits(changed):
                    yield changed

    def _moved(self, barrier: Barrier, step: float, level: int) -> Iterator[Barrier]:
        """Yield a barrier at other stations and of other sizes, whether they fit or not."""
        if isinstance(barrier, Mesh):
            yield from (b for b in self.lone("mesh") if b != barrier)
            return
        for way in (-1.0, 1.0):
            x = barrier.x + way * step
            yield from self._put(barrier, round(x, 1))
        for name, size in self._lengths(barrier):
            for way in (-level, level):
                value = max(getattr(barrier, name) + way * size, MIN_HEIGHT)
                yield from self._put(self._resized(barrier, name, value), barrier.x)
        if isinstance(barrier, Fence):
            assert barrier.energy_class is not None
            at = CLASSES.index(barrier.energy_class)
            for other in (at - level, at + level):
                if 0 <= other < len(CLASSES):
                    row = FENCE_CLASSES[CLASSES[other]]
                    tall = min(max(barrier.height, row.lowest), row.height, self.zone.max_height)
                    yield Fence(barrier.x, tall, energy_class=CLASSES[other])

    def _put(self, barrier: Barrier, x: float) -> list[Barrier]:
        moved = self.room.put(barrier, x)
        return [] if moved is None else [moved]

    def _lengths(self, barrier: Barrier) -> list[tuple[str, float]]:
        """Return which lengths of a barrier are decided, and their steps [m]."""
        match barrier:
            case Ditch():
                return [("depth", STEP), ("width", STEP)]
            case Embankment():
                return [("height", STEP), ("width", STEP)]
            case Fence():
                return [("height", STEP)]
        return [("height", STEP), ("thickness", 0.5 * STEP)]

    def _resized(self, barrier: Barrier, name: str, value: float) -> Barrier:
        """Return a barrier with another length, within the limits of the zone."""
        zone = self.zone
        if isinstance(barrier, Ditch):
            low, high = (MIN_HEIGHT, zone.max_depth)
            if name == "width":
                low, high = zone.min_width, zone.max_width
        elif name == "height":
            low, high = MIN_HEIGHT, zone.max_height
            if isinstance(barrier, Fence):
                assert barrier.energy_class is not None
                row = FENCE_CLASSES[barrier.energy_class]
                low, high = row.lowest, min(high, row.height)
        else:
            low, high = zone.min_thickness, zone.max_thickness
            if isinstance(barrier, Embankment):
                low = self.crest
        return msgspec.structs.replace(barrier, **{name: min(max(value, low), high)})


def spread(barriers: Sequence[Barrier], n: int) -> list[Barrier]:
    """Return at most `n` barriers of one kind that stand for all of them, the middle one first.

    They are nearest to the centres of k-means, in units of the range of each number; the station
    counts twice.
    """
    if len(barriers) <= n:
        return list(barriers)
    table = np.array([numbers(b) for b in barriers])
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
"""Steps of k-means."""


def _far_apart(table: Floats, n: int) -> list[int]:
    """Return `n` rows of a table, each the farthest from those before it."""
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


def numbers(barrier: Barrier) -> list[float]:
    """Return the numbers of a barrier that are decided."""
    match barrier:
        case Ditch():
            return [barrier.x, barrier.depth, barrier.width]
        case Fence():
            assert barrier.energy_class is not None
            return [barrier.x, barrier.height, math.log(barrier.energy_class)]
        case Mesh():
            return [barrier.x]
    return [barrier.x, barrier.height]


NEAR = 0.05
"""Distance from a bound at which a length lies on it [m]."""


def on_bound(problem: DesignProblem, layout: Layout) -> tuple[str, ...]:
    """Return what lies on a bound of the zone, of its kind or of the list of classes, in words.

    The bounds of mesh, and those by what stands next to a barrier, do not count; nor does the
    greatest height of a class of fence, as the next class is higher and dearer.
    """
    names = []
    for barrier in layout:
        if not isinstance(barrier, Mesh):
            found = [*_place(problem, barrier), *_size(problem, barrier)]
            names += [f"{barrier.words}: {words}" for words in found]
    return tuple(names)


def _place(problem: DesignProblem, barrier: Barrier) -> list[str]:
    """Return which ends of the zone a barrier stands at."""
    zone, road = problem.zone, problem.site.road.start
    start, end = problem.place.works(barrier)
    found = []
    if start - zone.start <= NEAR:
        found.append("start of the zone")
    if zone.end - end <= NEAR:
        found.append("end of the zone")
    if isinstance(barrier, Fence):
        assert barrier.elongation is not None  # of its class
        if road - end - barrier.elongation <= NEAR:
            found.append("clearance to the road")
    return found


def _size(problem: DesignProblem, barrier: Barrier) -> list[str]:
    """Return which sizes of a barrier are the least or greatest."""
    zone = problem.zone
    if isinstance(barrier, Fence):
        assert barrier.energy_class is not None
        found = _ends(barrier.height, MIN_HEIGHT, zone.max_height, "height")
        if barrier.energy_class in (CLASSES[0], CLASSES[-1]):
            found.append("lowest class" if barrier.energy_class == CLASSES[0] else "highest class")
        return found
    if isinstance(barrier, Ditch):
        depth = _ends(barrier.depth, MIN_HEIGHT, zone.max_depth, "depth")
        return depth + _ends(barrier.width, zone.min_width, zone.max_width, "width")
    assert isinstance(barrier, Embankment | GravityWall | Wall)
    what = "width" if isinstance(barrier, Embankment) else "thickness"
    height = _ends(barrier.height, MIN_HEIGHT, zone.max_height, "height")
    crest = Menu(problem).crest if isinstance(barrier, Embankment) else 0.0
    least, most = max(crest, zone.min_thickness), zone.max_thickness
    return height + _ends(getattr(barrier, what), least, most, what)


def _ends(value: float, low: float, high: float, name: str) -> list[str]:
    """Return whether a length is the least or the greatest."""
    found = [f"least {name}"] if value - low <= NEAR else []
    return found + ([f"greatest {name}"] if high - value <= NEAR else [])


DEPTHS, WIDTHS = (0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0), (2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
"""Depths and widths of ditches [m]."""
