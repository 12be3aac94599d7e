"""Tables of a site: slope, road, where barriers may stand, how releases move and vary."""

from __future__ import annotations

from itertools import pairwise

import msgspec

from rigdda import check
from rigdda.errors import BadInput
from rigdda.model.settings import USUAL_DT
from rigdda.model.source import Point
from rigdda.model.surface import Surface


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


class Road(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The road.

    Parameters
    ----------
    start : float
        Chainage of its uphill edge [m].
    end : float
        Chainage of its downhill edge [m].
    """

    start: float
    end: float


class BarrierZone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where barriers may stand, and how large they may be.

    Parameters
    ----------
    start : float
        Chainage where it begins [m]. No barrier stands in a band of loose rock within the zone.
    end : float
        Chainage where it ends, at the road at the latest [m].
    max_height : float
        Greatest height of all kinds but ditches [m].
    min_thickness : float
        Least thickness of walls, the width of an embankment's crest included [m].
    max_thickness : float
        Greatest of these [m].
    max_depth : float
        Greatest depth of ditches [m].
    min_width : float
        Least width of ditches [m].
    max_width : float
        Greatest width of ditches [m].

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    start: float
    end: float
    max_height: float = 5.0
    min_thickness: float = 0.5
    max_thickness: float = 2.0
    max_depth: float = 3.0
    min_width: float = 1.0
    max_width: float = 8.0

    def __post_init__(self) -> None:
        for name, low in (
            ("max_height", 0.5),
            ("min_thickness", 0.0),
            ("max_depth", 0.5),
            ("min_width", 0.0),
        ):
            check.number(f"barrier_zone.{name}", getattr(self, name), low, 100.0, open_low=True)
        for name, low in (("max_thickness", self.min_thickness), ("max_width", self.min_width)):
            check.number(f"barrier_zone.{name}", getattr(self, name), low, 100.0)


class Interface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How two surfaces meet, instead of what follows from each.

    Without one, rock on the ground meets the ground's surface, and otherwise the smaller of each
    property counts.

    Parameters
    ----------
    first : str
        Name of the one surface.
    second : str
        Name of the other.
    friction_deg : float
        Coulomb friction angle [deg].
    cohesion, tension : float
        Strength of a joint that is closed at the start [Pa].
    restitution : float
        Coefficient of restitution [-].
    """

    first: str
    second: str
    friction_deg: float = 30.0
    cohesion: float = 0.0
    tension: float = 0.0
    restitution: float | None = 0.0

    @property
    def surface(self) -> Surface:
        """Its properties."""
        return Surface(self.friction_deg, self.cohesion, self.tension, self.restitution)


class Motion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How releases are computed.

    Parameters
    ----------
    damping : float
        Mass-proportional damping [1/s].
    damping_when : str
        "contact": of blocks that touch something, or did within 0.1 s; "always": the paper's, in
        flight, too, with which energies at a barrier are four to ten times too low.
    duration : float
        Longest simulated time [s].
    dt : float
        Time step [s], of small blocks the longest whole part of it that suits their size.

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    damping: float = 0.0
    damping_when: str = "contact"
    duration: float = 25.0
    dt: float = USUAL_DT

    def __post_init__(self) -> None:
        check.number("motion.damping", self.damping, 0.0, 100.0)
        check.one_of("motion.damping_when", self.damping_when, ("always", "contact"))
        check.number("motion.duration", self.duration, 0.0, open_low=True)
        check.number("motion.dt", self.dt, 0.0, open_low=True)


class Rebound(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a point of the lumped-mass model rebounds from a surface, see `rigdda.lumped`.

    Parameters
    ----------
    normal : float
        Normal coefficient of restitution [-].
    tangential : float
        Tangential coefficient of restitution [-]: the share of its speed along the ground that a
        point keeps in an impact.
    friction_deg : float
        Friction angle at which it slides on, or rolls, when it no longer bounces [deg].

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    normal: float = 0.35
    tangential: float = 0.85
    friction_deg: float = 30.0

    def __post_init__(self) -> None:
        check.number("lumped.normal", self.normal, 0.0, 1.0)
        check.number("lumped.tangential", self.tangential, 0.0, 1.0)
        check.number("lumped.friction_deg", self.friction_deg, 0.0, 80.0)


class Scatter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What varies at random from release to release, beside the blocks.

    Parameters
    ----------
    friction_deg : float
        Standard deviation of the friction angles, all surfaces together [deg].

    Raises
    ------
    BadInput
        If it is outside its range.
    """

    friction_deg: float = 0.0

    def __post_init__(self) -> None:
        check.number("scatter.friction_deg", self.friction_deg, 0.0, 10.0)


def check_surface(where: str, surface: Surface) -> None:
    """Check that the friction of a surface can be meant.

    Raises
    ------
    BadInput
        If it looks like a tangent or an angle in radians.
    """
    angle = surface.friction_deg
    if 0.0 < angle < 1.0:
        mend = f"give degrees, such as 30: {angle:g} looks like a tangent or radians"
        raise BadInput(f"{where}.friction_deg", angle, mend)
