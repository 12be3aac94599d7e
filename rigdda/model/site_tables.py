"""The tables of a site file: slope, events, road, zone, motion, scatter; what they say."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import msgspec

from rigdda import check
from rigdda.barriers import MeshOption
from rigdda.errors import BadInput
from rigdda.model.barrier_zone import BarrierZone
from rigdda.model.block import Block
from rigdda.model.prices import Consequences, Prices
from rigdda.model.settings import LARGEST_DT, SHORTEST_DT, USUAL_DT
from rigdda.model.source import Point, Source
from rigdda.model.surface import Interface, Surface
from rigdda.model.terrain import Roughness, Terrain


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


MASS_WIDTH = 10.0
"""Width of an event of a jointed mass or of given blocks that names none [m]."""

MOST_OFTEN = 1000.0
"""Greatest rate [1/year per 100 m]: three blocks a day are no rare event but a talus at work."""

LARGEST_AREA, WIDEST = 1000.0, 1000.0
"""Greatest area of a block [m2] and width of an event [m]."""


class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What comes down, and how often.

    Parameters
    ----------
    name : str
        Its name.
    rate : float
        How often it happens [1/year per 100 m of slope].
    source : str
        Name of the source that it comes from.
    area : (least, greatest)
        Area of each block of a band [m2], of one without `edges`.
    exponent : float
        The number of blocks larger than a volume V falls as V to the power of minus this [-],
        within `area`: 0.4 to 0.8 as a rule.
    number : (least, most)
        Number of blocks of a band, each number as likely.
    width : float
        Its width along the road [m]. Of a single block by default the root of its area, of a mass
        10 m.
    design : bool
        Whether it is a design event, for which targets are set.

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    name: str
    rate: float
    source: str = "rock"
    area: tuple[float, float] | None = None
    exponent: float = 0.6
    number: tuple[int, int] = (1, 1)
    width: float | None = None
    design: bool = False

    def __post_init__(self) -> None:
        where = self.words
        check.number(f"{where}.rate", self.rate, 0.0, MOST_OFTEN)
        check.number(f"{where}.exponent", self.exponent, 0.0, 5.0)
        if self.area is not None:
            check.interval(f"{where}.area", self.area, 1e-4, LARGEST_AREA)
        check.interval(f"{where}.number", self.number)
        for count in self.number:
            check.integer(f"{where}.number", count, 1, 1000)
        if self.width is not None:
            check.number(f"{where}.width", self.width, 0.0, WIDEST, open_low=True)
        if not isinstance(self.design, bool):
            raise BadInput(f"{where}.design", self.design, "give true or false")

    @property
    def words(self) -> str:
        """What errors call it."""
        return f"events.{self.name}"

    def check_source(self, source: Source) -> None:
        """Check that it says of its source what that needs, and nothing else.

        Raises
        ------
        BadInput
            If a band has no area of blocks, or a group no width, or a mass has either.
        """
        if source.band is None:
            if self.area is not None or self.number != (1, 1):
                what = "number" if self.area is None else "area"
                mend = f"leave it out: source {source.name} is no band, its blocks are given"
                raise BadInput(f"{self.words}.{what}", getattr(self, what), mend)
        elif source.edges is not None:
            if self.area is not None:
                mend = f"leave it out: source {source.name} says it by its edges"
                raise BadInput(f"{self.words}.area", self.area, mend)
        elif self.area is None:
            mend = f"give the least and the greatest area of a block of band {source.name} [m2]"
            raise BadInput(f"{self.words}.area", None, mend)
        if source.band is not None and self.number[1] > 1 and self.width is None:
            mend = "give the width along the road of an event of several blocks [m]"
            raise BadInput(f"{self.words}.width", None, mend)

    def block_size(self, source: Source) -> float:
        """Return the typical size of its blocks, which come from `source` [m]."""
        if source.edges is not None:
            return math.prod(source.edges) ** (1.0 / 3.0)
        if self.area is not None:
            return math.prod(self.area) ** 0.25
        return math.sqrt(source.mean_block_area)

    def width_of(self, areas: list[float]) -> float:
        """Return the width of a release with blocks of these areas [m]."""
        if self.width is not None:
            return self.width
        return math.sqrt(areas[0]) if areas else MASS_WIDTH


class Drawn(NamedTuple):
    """What a seed draws of an event, the same for every layout."""

    event: str
    """Its name."""
    blocks: tuple[Block, ...]
    width: float
    """Along the road [m]."""
    friction_deg: float
    """Shift of all friction angles [deg]."""
    strengths: tuple[tuple[float, float, float], ...] = ()
    """Standard normal numbers of friction, restitution and damping, for each surface of the site in
    turn; empty where no surface varies."""
    roughness: Roughness | None = None
    """Pits in the ground; None where it is smooth."""


DURATION = (1.0, 3600.0)
"""Least and greatest `motion.duration` [s]: in less than a second hardly a block reaches a road."""


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


class Motion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How releases are computed.

    Parameters
    ----------
    damping : float or None
        Mass-proportional damping [1/s] of surfaces that have none of their own. None: that of the
        ground that the name of the surface suggests, with a notice.
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

    damping: float | None = None
    damping_when: str = "contact"
    duration: float = 25.0
    dt: float = USUAL_DT

    def __post_init__(self) -> None:
        if self.damping is not None:
            check.number("motion.damping", self.damping, 0.0, 100.0)
        check.one_of("motion.damping_when", self.damping_when, ("always", "contact"))
        check.number("motion.duration", self.duration, *DURATION)
        check.number("motion.dt", self.dt, SHORTEST_DT, LARGEST_DT)


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
        check.number("normal", self.normal, 0.0, 1.0)
        check.number("tangential", self.tangential, 0.0, 1.0)
        check.number("friction_deg", self.friction_deg, 0.0, 80.0)


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


STEEP_SIDES, FLAT_SIDE = {"rock": 0.25}, 0.67
"""Side slope of a ditch, run over rise [-], by the surface that it is cut in: 4:1 stands in rock;
all else is taken for soil."""


class SiteTables(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A slope, its loose rock and how often it falls, the road below, and what protection costs.

    Parameters
    ----------
    name : str
        Its name.
    description : str
        What it is, and what of it is assumed.
    family : str
        Family of sites that it belongs to; "paper" for scenes of publications.
    slope : table
        The ground.
    sources : tables
        Where rock starts.
    events : tables
        What comes down and how often. By default each source that is no band, once a year on
        100 m of slope.
    road : table
        The road.
    barrier_zone : table
        Where barriers may stand.
    surfaces : tables
        The surfaces, by name. "soil" is that of
        embankments, "concrete" that of walls and fences, and of embankments where "soil" is
        missing; "rock" where they are missing.
    interfaces : tables
        How two surfaces meet.
    prices : table
        What barriers cost.
    consequences : table
        What rock on the road costs.
    meshes : tables
        Mesh that may be hung over the face.
    motion : table
        How releases are computed.
    scatter : table
        What varies at random.
    lumped : tables
        How points of the lumped-mass model rebound, by the name of the surface.
    """

    name: str
    description: str
    family: str = ""
    slope: Slope
    sources: tuple[Source, ...]
    events: tuple[Event, ...] = ()
    road: Road
    barrier_zone: BarrierZone
    surfaces: dict[str, Surface]
    interfaces: tuple[Interface, ...] = ()
    prices: Prices = msgspec.field(default_factory=Prices)
    consequences: Consequences = Consequences()
    meshes: tuple[MeshOption, ...] = ()
    motion: Motion = Motion()
    scatter: Scatter = Scatter()
    lumped: dict[str, Rebound] = {}

    @property
    def profile(self) -> Terrain:
        """The ground as a terrain, with a corner wherever its surface changes."""
        return _ground(self.slope.points, self.slope.surface, self.slope.surfaces)

    @property
    def friction_varies(self) -> bool:
        """Whether friction is drawn for each release."""
        own = any(surface.friction_sd_deg > 0.0 for surface in self.surfaces.values())
        return own or self.scatter.friction_deg > 0.0

    @property
    def pit_spacing(self) -> float:
        """Greatest spacing of pits in the ground in any event [m], 0 where the ground is smooth."""
        if all(surface.roughness == 0.0 for surface in self.surfaces.values()):
            return 0.0
        return max(event.block_size(self.source(event.source)) for event in self.events)

    @property
    def event_names(self) -> tuple[str, ...]:
        """Names of the events."""
        return tuple(event.name for event in self.events)

    def event(self, name: str) -> Event:
        """Return an event by its name.

        Raises
        ------
        BadInput
            If there is none.
        """
        return self.events[self.index(name)]

    def index(self, name: str) -> int:
        """Return the place of an event among the events. Raises as `event` does."""
        names = self.event_names
        if not isinstance(name, str) or name not in names:
            raise BadInput("event", name, "choose one of " + ", ".join(names))
        return names.index(name)

    def source(self, name: str) -> Source:
        """Return a source by its name.

        Raises
        ------
        BadInput
            If there is none.
        """
        for source in self.sources:
            if source.name == name:
                return source
        raise BadInput("source", name, "choose one of " + ", ".join(s.name for s in self.sources))

    def events_of(self, source: Source) -> list[Event]:
        """Return the events that come from a source."""
        return [event for event in self.events if event.source == source.name]

    def surface_at(self, x: float) -> str:
        """Return the surface of the ground at a chainage."""
        return self.slope.surface_at(x)

    @property
    def soil(self) -> str:
        """Name of the surface of embankments."""
        usual = "concrete" if "concrete" in self.surfaces else "rock"
        return "soil" if "soil" in self.surfaces else usual

    def ditch_side(self, x: float, width: float) -> float:
        """Return the side slope of a ditch [-], the flattest of the ground that it is cut in."""
        points, names = self.slope.chain()
        ends = zip(points, points[1:], names, strict=False)
        spanned = {name for (a, _), (b, _), name in ends if a < x + width and b > x}
        return max((STEEP_SIDES.get(name, FLAT_SIDE) for name in spanned), default=FLAT_SIDE)

    def mesh(self, name: str) -> MeshOption:
        """Return an option of mesh by its name.

        Raises
        ------
        BadInput
            If the site has no such option.
        """
        for option in self.meshes:
            if option.name == name:
                return option
        known = ", ".join(option.name for option in self.meshes) or "none: this site has no mesh"
        raise BadInput("mesh option", name, f"choose one of {known}")


@lru_cache(maxsize=256)
def _ground(points: tuple[Point, ...], surface: str, stretches: tuple[Stretch, ...]) -> Terrain:
    """Return the terrain of a slope; it is asked for several times in every episode."""
    return Terrain(*Slope(points, 0.0, surface, stretches).chain())
