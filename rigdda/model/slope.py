"""The slope of a site and its surfaces."""

from __future__ import annotations

from itertools import pairwise

import msgspec

from rigdda import check
from rigdda.model.source import Point


class Stretch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stretch of the slope with a surface of its own.

    Parameters
    ----------
    start : float
        Chainage where it begins [m].
    end : float
        Chainage where it ends [m].
    surface : str
        Name of its surface.
    """

    start: float
    end: float
    surface: str


class Slope(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The ground.

    Parameters
    ----------
    points : sequence of (x, y)
        Corners from the crest down to at least 30 m beyond the road, x growing downhill [m]. There
        may be overhangs, as the base of a toppling slope has; earthworks and bands need ground
        without.
    toe : float
        Chainage where the slope ends [m].
    surface : str
        Name of the surface of all that `surfaces` leaves out.
    surfaces : tables
        Stretches with surfaces of their own.

    Raises
    ------
    BadInput
        If a stretch ends before it starts, or two overlap.
    """

    points: tuple[Point, ...]
    toe: float
    surface: str = "rock"
    surfaces: tuple[Stretch, ...] = ()

    def __post_init__(self) -> None:
        points = check.points("slope.points", self.points, 2)
        msgspec.structs.force_setattr(self, "points", tuple(map(tuple, points.tolist())))
        last = -check.LARGEST
        for i, stretch in enumerate(self.surfaces):
            where = f"slope.surfaces[{i}]"
            check.number(f"{where}.start", stretch.start, last)
            last = check.number(f"{where}.end", stretch.end, stretch.start, open_low=True)

    def surface_at(self, x: float) -> str:
        """Return the name of the surface at a chainage."""
        found = (s.surface for s in self.surfaces if s.start <= x < s.end)
        return next(found, self.surface)

    def chain(self) -> tuple[tuple[Point, ...], tuple[str, ...]]:
        """Return the corners with those where a surface changes, and the surface of each segment.

        A vertical face has the surface of what is just beyond it.
        """
        cuts = {x for stretch in self.surfaces for x in (stretch.start, stretch.end)}
        points, names = [self.points[0]], []
        for (ax, ay), (bx, by) in pairwise(self.points):
            inner = sorted((x for x in cuts if min(ax, bx) < x < max(ax, bx)), reverse=bx < ax)
            for x in inner:
                points.append((x, ay + (by - ay) * (x - ax) / (bx - ax)))
            points.append((bx, by))
            ends = [ax, *inner, bx]
            names += [self.surface_at(0.5 * (a + b)) for a, b in pairwise(ends)]
        return tuple(points), tuple(names)
