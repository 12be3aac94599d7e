"""Tables of a site file: slope, events, road, barrier zone, motion and scatter."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Any, ClassVar, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import check, fields
from rigdda.barriers import MeshOption
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.prices import Consequences, Prices
from rigdda.ground.surface import Interface, Surface
from rigdda.ground.terrain import SAME_POINT, Roughness, Terrain
from rigdda.model.block import Block
from rigdda.model.existing import Existing
from rigdda.model.forest import Forest
from rigdda.model.partial_factors import PartialFactors
from rigdda.model.settings import LARGEST_DT, SHORTEST_DT, USUAL_DT, check_damping
from rigdda.model.source import Point, Source
from rigdda.model.traffic import Traffic
from rigdda.rounding import chainage


@documented
class Stretch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stretch of the slope with its own surface.

    Raises
    ------
    BadInput
        If a value is of the wrong type.
    """

    start: Annotated[float, about("Chainage where the stretch begins.", "m")]
    end: Annotated[float, about("Chainage where the stretch ends.", "m")]
    surface: Annotated[str, about("Name of the surface of the stretch.")]

    def __post_init__(self) -> None:
        fields.check(self, "stretch: ")


@documented
class Slope(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The ground profile and its surfaces.

    Raises
    ------
    BadInput
        If a value is of the wrong type, a stretch ends before it starts, or two stretches overlap.
    """

    points: Annotated[
        tuple[Point, ...],
        about(
            "Corners [x, y] of the ground, from the crest downhill to at least 30 m beyond the "
            "road. The ground may overhang, except at earthworks and if there is a band of loose "
            "rock.",
            "m",
            least=2,
        ),
    ]
    toe: Annotated[float, about("Chainage of the foot of the slope.", "m")]
    surface: Annotated[
        str, about("Name of the surface of the ground outside the stretches in `surfaces`.")
    ] = "rock"
    surfaces: Annotated[
        tuple[Stretch, ...], about("Stretches of the ground with a different surface.")
    ] = ()

    def __post_init__(self) -> None:
        fields.check(self, "slope.")
        last = -check.LARGEST_NUMBER
        for i, stretch in enumerate(self.surfaces):
            where = f"slope.surfaces[{i}]"
            if stretch.start < last - SAME_POINT:
                before = self.surfaces[i - 1].surface
                hint = (
                    f"let {stretch.surface} begin at {chainage(last)} or beyond, where {before} "
                    "ends"
                )
                raise BadInput(f"{where}.start", stretch.start, hint)
            if stretch.end <= stretch.start:
                hint = (
                    f"let {stretch.surface} end beyond {chainage(stretch.start)}, where it begins"
                )
                raise BadInput(f"{where}.end", stretch.end, hint)
            last = stretch.end

    def surface_at(self, x: float) -> str:
        """Return the name of the surface at a chainage."""
        found = (s.surface for s in self.surfaces if s.start <= x < s.end)
        return next(found, self.surface)

    def chain(self) -> tuple[tuple[Point, ...], tuple[str, ...]]:
        """Return the corners, including those of changes of surface, and the segments' surfaces.

        A vertical face has the surface of the ground just beyond it. The end of a stretch less than
        `SAME_POINT` from a corner or from the end of another stretch is moved there.
        """
        stretches = self._merged()
        cuts = {x for start, end, _ in stretches for x in (start, end)}
        points, names = [self.points[0]], []
        for (ax, ay), (bx, by) in pairwise(self.points):
            inner = sorted((x for x in cuts if min(ax, bx) < x < max(ax, bx)), reverse=bx < ax)
            for x in inner:
                points.append((x, ay + (by - ay) * (x - ax) / (bx - ax)))
            points.append((bx, by))
            for a, b in pairwise((ax, *inner, bx)):
                found = (name for start, end, name in stretches if start <= 0.5 * (a + b) < end)
                names.append(next(found, self.surface))
        return tuple(points), tuple(names)

    def _merged(self) -> list[tuple[float, float, str]]:
        """Return the ends and the surface of each stretch, with ends at the same point merged."""
        known = [x for x, _ in self.points]

        def merged(x: float) -> float:
            near = min(known, key=lambda other: abs(other - x))
            if abs(near - x) < SAME_POINT:
                return near
            known.append(x)
            return x

        return [(merged(part.start), merged(part.end), part.surface) for part in self.surfaces]


MASS_WIDTH = 10.0
"""Default width of an event of a jointed mass or of given blocks [m]."""

MOST_OFTEN = 1000.0
"""Maximum rate [1/year per 100 m]. Three blocks per day are an active talus, not a rare event."""

LARGEST_AREA, WIDEST = 1000.0, 1000.0
"""Maximum area of a block [m2] and maximum width of an event [m]."""

SECTION = 100.0
"""Length of slope that rates refer to [m]."""

VOLUME_EXPONENT = 2.0 / 3.0
"""Power of a block's volume that is its area: a block is as long along the road as the root of its
area, as its mass and the width of its release have it."""


EXPONENT = 0.6
"""Default of `Event.exponent` [-]."""

_OPEN: Any = msgspec.UNSET
"""Default of `Event.rate`, which may be given as a return period."""

Area = Annotated[float, about(ge=1e-4, le=LARGEST_AREA)]
Period = Annotated[float, about(gt=0.0, le=1e6)]
Length = Annotated[float, about(gt=0.0, le=1e5)]
Volume = Annotated[float, about(ge=1e-6, le=3e4)]
Spread = Annotated[float, about(gt=0.0, le=5.0)]
Portion = Annotated[float, about(ge=0.0, le=1.0)]
Width = Annotated[float, about(gt=0.0, le=WIDEST)]
Count = Annotated[int, about(ge=1, le=1000)]


RELEASE, ARRIVAL = "release", "arrival"
"""What the rate of an event counts."""


@documented
class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A type of rockfall event and its rate.

    An event that is given by a `volume` or a `return_period` has the `area` and the `rate` that
    follow from them, and these are what `Site.save` writes.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, or there is not exactly one of `rate`
        and `return_period`, or there are both `area` and `volume`.
    """

    name: Annotated[str, about("Name of the event.")]
    rate: Annotated[
        float,
        about(
            "Mean number of occurrences per year on 100 m of slope. Needed, unless the event gives "
            "a `return_period`.",
            "1/year per 100 m of slope",
            ge=0.0,
            le=MOST_OFTEN,
        ),
    ] = _OPEN
    source: Annotated[str, about("Name of the source of the rock.")] = "rock"
    area: Annotated[
        tuple[Area, Area] | None,
        about(
            "Least and greatest cross-sectional area of a block. Needed for a band, unless "
            "the event gives a `volume` or the band gives `edges`.",
            "m2",
            rising=True,
        ),
    ] = None
    exponent: Annotated[
        float,
        about(
            "Exponent b of the distribution of block volumes within `area`: the number of blocks "
            "larger than V is proportional to V to the power of -b. Usual values are 0.4 to 0.8.",
            "-",
            ge=0.0,
            le=5.0,
        ),
    ] = EXPONENT
    number: Annotated[
        tuple[Count, Count],
        about(
            "Least and greatest number of blocks that a band releases at once. All numbers "
            "between them are equally likely.",
            "-",
            rising=True,
        ),
    ] = (1, 1)
    width: Annotated[
        Width | None,
        about(
            "Width of the event along the road. Needed if several blocks come from a band. "
            "The default is the square root of its area for a single block of a band, and 10 m "
            "for a mass or for given blocks. "
            "The volume of a release is the sum of the cross-sections of its blocks times the "
            "width, and a fence has its energy class divided by the width per metre. For a few "
            "blocks that fall one after the other at the same place, give the size of a block.",
            "m",
        ),
    ] = None
    design: Annotated[
        bool, about("Whether it is a design event, for which targets can be set.")
    ] = False
    volume: Annotated[
        tuple[Volume, Volume] | None,
        about(
            "Instead of `area`, the least and the greatest volume of a block. The area is the "
            "volume to the power of 2/3: a block is taken to be as long along the road as the root "
            "of its area.",
            "m3",
            rising=True,
        ),
    ] = None
    volume_median: Annotated[
        Volume | None,
        about(
            "Median of lognormal block volumes, in place of the power law with `exponent`. "
            "Volumes are limited to `volume`. It goes with `volume_spread`.",
            "m3",
        ),
    ] = None
    volume_spread: Annotated[
        Spread | None,
        about("Standard deviation of the natural logarithm of lognormal block volumes.", "-"),
    ] = None
    volumes: Annotated[
        tuple[Volume, ...] | None,
        about(
            "Surveyed volumes of blocks, rising, in place of `volume` and the power law. They go "
            "with `volume_shares`.",
            "m3",
        ),
    ] = None
    volume_shares: Annotated[
        tuple[Portion, ...] | None,
        about(
            "Share of blocks below each of `volumes`, from 0 to 1. Between two of them, the share "
            "grows with the logarithm of the volume.",
            "-",
        ),
    ] = None
    return_period: Annotated[
        Period | None,
        about(
            "Instead of `rate`, the mean time between two such events on 100 m of slope, or on "
            "`section_length`.",
            "years",
        ),
    ] = None
    section_length: Annotated[
        Length | None,
        about(
            "Length of slope that `return_period` refers to. The default is 100 m.",
            "m",
        ),
    ] = None

    rate_of: Annotated[
        str,
        about(
            "What `rate` or `return_period` counts: all releases of rock, or arrivals, which are "
            "releases in which rock reaches the road without new barriers. A log of rock on the "
            "road counts arrivals. The commands convert arrivals to releases.",
            choices=(RELEASE, ARRIVAL),
        ),
    ] = RELEASE
    array: ClassVar[str] = "events"

    def __post_init__(self) -> None:
        fields.check(self, f"{self.words}.")
        _set = msgspec.structs.force_setattr
        _set(self, "rate", self._yearly())
        self._check_volumes()
        if self.volumes:
            ends = self.volumes[0], self.volumes[-1]
            _set(self, "area", (ends[0] ** VOLUME_EXPONENT, ends[1] ** VOLUME_EXPONENT))
        if self.volume is not None:
            if self.area is not None:
                hint = "leave it out: the event gives its area, too"
                raise BadInput(f"{self.words}.volume", list(self.volume), hint)
            low, high = (volume**VOLUME_EXPONENT for volume in self.volume)
            _set(self, "area", (low, high))
        for name in ("volume", "return_period", "section_length"):
            _set(self, name, None)

    def _check_volumes(self) -> None:
        """Check that a distribution of volumes is complete and the only one."""
        where = self.words
        if self.volumes is not None or self.volume_shares is not None:
            hint = "leave it out: the event gives volumes and volume_shares"
            for name in ("volume", "volume_median", "volume_spread"):
                if getattr(self, name) is not None:
                    raise BadInput(f"{where}.{name}", getattr(self, name), hint)
            volumes, shares = self.volumes or (), self.volume_shares or ()
            if len(volumes) < 2 or any(a >= b for a, b in pairwise(volumes)):
                raise BadInput(f"{where}.volumes", volumes, "give at least two volumes, rising")
            rising = all(a < b for a, b in pairwise(shares))
            if len(shares) != len(volumes) or not rising or (shares[0], shares[-1]) != (0.0, 1.0):
                told = f"give {len(volumes)} shares below the volumes, rising from 0 to 1"
                raise BadInput(f"{where}.volume_shares", shares, told)
            ends = volumes[0] ** VOLUME_EXPONENT, volumes[-1] ** VOLUME_EXPONENT
            if self.area not in (None, ends):
                raise BadInput(f"{where}.area", self.area, hint)
            self._check_no_exponent("the event gives volumes and volume_shares")
        elif (self.volume_median, self.volume_spread) != (None, None):
            self._check_lognormal()
            self._check_no_exponent("the event gives volume_median and volume_spread")

    def _check_lognormal(self) -> None:
        """Check that lognormal volumes have a median within their limits and a spread."""
        where = self.words
        if self.volume_median is None or self.volume_spread is None:
            missing = "volume_spread" if self.volume_spread is None else "volume_median"
            hint = "give both volume_median and volume_spread"
            raise BadInput(f"{where}.{missing}", None, hint)
        limits = self.volume_limits
        if limits is None:
            hint = "give the least and the greatest volume, to which lognormal volumes are cut"
            raise BadInput(f"{where}.volume", None, hint)
        rounding = 1.0 + 1e-9  # the limits are stored as areas
        if not limits[0] / rounding <= self.volume_median <= limits[1] * rounding:
            hint = f"give a median within the limits, {limits[0]:.3g} to {limits[1]:.3g} m3"
            raise BadInput(f"{where}.volume_median", self.volume_median, hint)

    def _check_no_exponent(self, reason: str) -> None:
        """Check that the exponent of the power law is not given where another law holds.

        The default counts as left out because `Site.save` writes it.
        """
        if self.exponent != EXPONENT:
            raise BadInput(f"{self.words}.exponent", self.exponent, f"leave it out: {reason}")

    @property
    def volume_limits(self) -> tuple[float, float] | None:
        """Least and greatest volume of a block [m3]; None if its source determines them."""
        if self.volume is not None:
            return self.volume
        if self.area is None:
            return None
        low, high = (area ** (1.0 / VOLUME_EXPONENT) for area in self.area)
        return low, high

    def _yearly(self) -> float:
        """Return its rate, as given or by its return period [1/year per 100 m of slope]."""
        period, length = self.return_period, self.section_length
        if period is None:
            if self.rate is _OPEN:
                hint = "add how often it happens on 100 m of slope a year, or a return_period"
                raise BadInput(f"{self.words}.rate", None, hint)
            if length is not None:
                hint = "leave it out: it belongs to a return_period, and the event gives a rate"
                raise BadInput(f"{self.words}.section_length", length, hint)
            return self.rate
        if self.rate is not _OPEN:
            hint = "leave it out: the event gives its rate, too"
            raise BadInput(f"{self.words}.return_period", period, hint)
        rate = SECTION / (period * (length or SECTION))
        if rate > MOST_OFTEN:
            hint = f"give years: this is {rate:g} events a year on 100 m, at most {MOST_OFTEN:g}"
            raise BadInput(f"{self.words}.return_period", period, hint)
        return rate

    @property
    def release_rate(self) -> float:
        """Rate of its releases [1/year per 100 m of slope].

        Raises
        ------
        BadInput
            If its rate is that of arrivals.
        """
        self.check_released()
        return self.rate

    def check_released(self) -> None:
        """Check that its rate is that of releases.

        Raises
        ------
        BadInput
            If it is that of arrivals.
        """
        if self.rate_of != RELEASE:
            hint = (
                "convert it to the rate of releases first: "
                "site = rigdda.envs.with_release_rates(site)"
            )
            raise BadInput(f"{self.words}.rate_of", self.rate_of, hint)

    @property
    def words(self) -> str:
        """Path of the event in error messages."""
        return f"{self.array}.{self.name}"

    def check_source(self, source: Source) -> None:
        """Check that the event specifies exactly what its source requires.

        Raises
        ------
        BadInput
            If blocks of a band lack an area or a group lacks a width, or the area, the exponent or
            the number of blocks is given although the source determines it.
        """
        if source.band is None:
            if self.area is not None or self.number != (1, 1):
                what = "number" if self.area is None else "area"
                hint = (
                    f"leave it (or volume) out: source {source.name} is not a band and defines its "
                    "blocks"
                )
                raise BadInput(f"{self.words}.{what}", getattr(self, what), hint)
            self._check_no_exponent(f"source {source.name} is not a band and defines its blocks")
        elif source.edges is not None:
            if self.area is not None:
                hint = f"leave it (or volume) out: the edges of source {source.name} determine it"
                raise BadInput(f"{self.words}.area", self.area, hint)
            self._check_no_exponent(f"the edges of source {source.name} determine the volumes")
        elif self.area is None:
            hint = (
                f"give the least and the greatest area of a block of band {source.name} [m2], or a "
                "volume [m3]"
            )
            raise BadInput(f"{self.words}.area", None, hint)
        if source.band is not None and self.number[1] > 1 and self.width is None:
            hint = "give the width along the road of an event of several blocks [m]"
            raise BadInput(f"{self.words}.width", None, hint)

    def block_size(self, source: Source) -> float:
        """Return the typical size of its blocks from `source` [m]."""
        if source.edges is not None:
            return math.prod(source.edges) ** (1.0 / 3.0)
        if self.area is not None:
            return math.prod(self.area) ** 0.25
        return math.sqrt(source.mean_block_area)

    def block_count(self, source: Source) -> float:
        """Return the mean number of its blocks from `source`; the nominal one of a jointed mass."""
        if source.band is not None:
            return 0.5 * sum(self.number)
        return source.area / source.mean_block_area

    def width_of(self, areas: list[float]) -> float:
        """Return the width of a release with blocks of these areas [m]."""
        if self.width is not None:
            return self.width
        return math.sqrt(areas[0]) if areas else MASS_WIDTH


class Drawn(NamedTuple):
    """Random properties of a release, which do not depend on the layout."""

    event: str
    """Name of the event."""
    blocks: tuple[Block, ...]
    width: float
    """Width along the road [m]."""
    friction_deg: float
    """Shift of all friction angles [deg]."""
    strengths: tuple[tuple[float, float, float], ...] = ()
    """Standard normal numbers for friction, restitution and rolling resistance of each surface of
    the site in order; empty if no surface varies."""
    roughness: Roughness | None = None
    """Pits in the ground; None if it is smooth."""
    stems: tuple[NDArray[np.float64], ...] = ()
    """Stems that each block strikes, see `Scene.stems`; empty if the site has no forest."""


@documented
class Origin(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Position of the point x = 0, y = 0 of the site in the survey.

    Computation uses short coordinates that increase downhill. This table stores the offsets that
    were subtracted from the survey coordinates, so that results can also be given in survey
    coordinates.

    Raises
    ------
    BadInput
        If a value is of the wrong type.
    """

    chainage: Annotated[float, about("Chainage of the survey at x = 0.", "m")] = 0.0
    elevation: Annotated[float, about("Elevation of the survey at y = 0.", "m")] = 0.0
    reversed: Annotated[
        bool, about("Whether the chainage of the survey decreases where x increases (downhill).")
    ] = False
    easting: Annotated[
        float | None,
        about("Easting on the grid at x = 0, if the survey has plan coordinates.", "m"),
    ] = None
    northing: Annotated[
        float | None,
        about("Northing on the grid at x = 0, if the survey has plan coordinates.", "m"),
    ] = None
    azimuth_deg: Annotated[
        float | None,
        about(
            "Direction in which x grows, clockwise from grid north, if the survey has plan "
            "coordinates.",
            "deg",
        ),
    ] = None

    def __post_init__(self) -> None:
        fields.check(self, "origin.")

    def chainage_of(self, x: float) -> float:
        """Return the chainage of the survey at a chainage `x` of the site [m]."""
        return self.chainage - x if self.reversed else self.chainage + x

    @property
    def surveyed(self) -> bool:
        """Whether coordinates of the survey differ from those of the site."""
        return bool(self.chainage or self.elevation or self.reversed)

    def elevation_of(self, y: float) -> float:
        """Return the elevation of the survey at an elevation `y` of the site [m]."""
        return self.elevation + y

    def x_of(self, chainage: float) -> float:
        """Return the chainage of the site at a chainage of the survey [m]."""
        return self.chainage - chainage if self.reversed else chainage - self.chainage


DURATION = (1.0, 3600.0)
"""Least and greatest `motion.duration` [s]; in less than one second hardly any block reaches a
road."""


@documented
class Road(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The road.

    Raises
    ------
    BadInput
        If a value is of the wrong type.
    """

    start: Annotated[float, about("Chainage of the uphill edge of the road.", "m")]
    end: Annotated[float, about("Chainage of the downhill edge of the road.", "m")]

    def __post_init__(self) -> None:
        fields.check(self, "road.")


@documented
class Motion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Numerical and damping parameters of the simulation of releases.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, or damping would act only in contact.
    """

    damping: Annotated[
        float,
        about(
            "Mass-proportional damping of all blocks, also in flight, as in the paper. It requires "
            '`damping_when` = "always".',
            "1/s",
            ge=0.0,
            le=100.0,
        ),
    ] = 0.0
    damping_when: Annotated[
        str,
        about(
            'Damping above 0 is permitted with "always" only. It limits the speed of a fall, so '
            "that energies at a barrier are too low by a factor of four to ten. Loss of energy at "
            "the ground is described by the rolling resistance of the surfaces.",
            choices=("always", "contact"),
        ),
    ] = "contact"
    duration: Annotated[
        float, about("Maximum simulated time.", "s", ge=DURATION[0], le=DURATION[1])
    ] = 25.0
    dt: Annotated[
        float,
        about(
            "Time step. For small blocks it is divided by the smallest whole number that makes it "
            "short enough for their size.",
            "s",
            ge=SHORTEST_DT,
            le=LARGEST_DT,
        ),
    ] = USUAL_DT

    def __post_init__(self) -> None:
        fields.check(self, "motion.")
        check_damping(self.damping, self.damping_when, "motion.")


@documented
class Rebound(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Rebound parameters of a surface in the lumped-mass model, see `rigdda.lumped`.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    normal: Annotated[float, about("Normal coefficient of restitution.", "-", ge=0.0, le=1.0)] = (
        0.35
    )
    tangential: Annotated[
        float,
        about(
            "Tangential coefficient of restitution: the share of the speed along the ground that a "
            "point retains in an impact.",
            "-",
            ge=0.0,
            le=1.0,
        ),
    ] = 0.85
    friction_deg: Annotated[
        float,
        about(
            "Friction angle of a point that slides or rolls after its last bounce.",
            "deg",
            ge=0.0,
            le=80.0,
        ),
    ] = 30.0

    def __post_init__(self) -> None:
        fields.check(self)


@documented
class Scatter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Random variation between releases, in addition to that of the blocks.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    friction_deg: Annotated[
        float,
        about(
            "Standard deviation of the friction angles. All surfaces vary together.",
            "deg",
            ge=0.0,
            le=10.0,
        ),
    ] = 0.0

    def __post_init__(self) -> None:
        fields.check(self, "scatter.")


STEEP_SIDES, FLAT_SIDE = {"rock": 0.25}, 0.67
"""Side slope of a ditch, run over rise [-], by ground surface: 4:1 is stable in rock; all other
surfaces count as soil."""


@documented
class SiteTables(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A slope, its loose rock and event rates, the road below, and the costs of protection."""

    name: Annotated[str, about("Name of the site.")]
    description: Annotated[str, about("Description of the site and of the assumptions.")]
    family: Annotated[
        str,
        about('Family to which the site belongs. "paper" is for scenes from publications.'),
    ] = ""
    slope: Annotated[Slope, about("The ground profile.")]
    sources: Annotated[tuple[Source, ...], about("The sources of rock.")]
    events: Annotated[
        tuple[Event, ...],
        about(
            "The types of rockfall event and their rates. By default, each source that is not a "
            "band releases its rock once a year on 100 m of slope."
        ),
    ] = ()
    origin: Annotated[
        Origin, about("Position of the point x = 0, y = 0 of the site in the survey.")
    ] = Origin()
    road: Annotated[Road, about("The road.")]
    barrier_zone: Annotated[
        BarrierZone, about("Where barriers may stand, and how large they may be.")
    ]
    surfaces: Annotated[
        dict[str, Surface],
        about(
            'The surfaces by name. Walls and fences have the surface "concrete", embankments have '
            '"soil". Without "soil", embankments have "concrete"; without "concrete", "rock" is '
            "used instead."
        ),
    ]
    interfaces: Annotated[
        tuple[Interface, ...], about("Contact properties of pairs of surfaces, if known.")
    ] = ()
    prices: Annotated[Prices, about("Prices of barriers.")] = msgspec.field(default_factory=Prices)
    consequences: Annotated[Consequences, about("Costs of rock on the road.")] = Consequences()
    forest: Annotated[
        tuple[Forest, ...],
        about("Forest on the slope. Its stems take energy from the blocks that strike them."),
    ] = ()
    existing: Annotated[
        tuple[Existing, ...],
        about("Barriers that stand already. They are part of every layout."),
    ] = ()
    traffic: Annotated[
        Traffic | None,
        about("Traffic on the road. Without this table the risk to life is not computed."),
    ] = None
    meshes: Annotated[tuple[MeshOption, ...], about("Mesh options for the rock face.")] = ()
    rule: Annotated[
        PartialFactors, about("Partial factors of the engineering rule for fences.")
    ] = PartialFactors()
    motion: Annotated[Motion, about("Parameters of the simulation of releases.")] = Motion()
    scatter: Annotated[
        Scatter, about("Random variation between releases, in addition to that of the blocks.")
    ] = Scatter()
    lumped: Annotated[
        dict[str, Rebound],
        about("Rebound parameters of the lumped-mass model by name of the surface."),
    ] = {}

    @property
    def profile(self) -> Terrain:
        """The ground as a terrain, with a corner wherever its surface changes."""
        return _ground(self.slope.points, self.slope.surface, self.slope.surfaces)

    @property
    def friction_varies(self) -> bool:
        """Whether friction varies from release to release."""
        own = any(surface.friction_sd_deg > 0.0 for surface in self.surfaces.values())
        return own or self.scatter.friction_deg > 0.0

    @property
    def pit_spacing(self) -> float:
        """Greatest spacing of pits in the ground over all events [m]; 0 if the ground is smooth."""
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
            If there is no such event.
        """
        return self.events[self.index(name)]

    def index(self, name: str) -> int:
        """Return the index of an event.

        Raises
        ------
        BadInput
            If there is no such event.
        """
        names = self.event_names
        if not isinstance(name, str) or name not in names:
            raise BadInput("event", name, "choose one of " + ", ".join(names))
        return names.index(name)

    def source(self, name: str) -> Source:
        """Return a source by its name.

        Raises
        ------
        BadInput
            If there is no such source.
        """
        for source in self.sources:
            if source.name == name:
                return source
        raise BadInput("source", name, "choose one of " + ", ".join(s.name for s in self.sources))

    def events_of(self, source: Source) -> list[Event]:
        """Return the events of a source."""
        return [event for event in self.events if event.source == source.name]

    def surface_at(self, x: float) -> str:
        """Return the name of the ground surface at a chainage."""
        return self.slope.surface_at(x)

    @property
    def soil(self) -> str:
        """Name of the surface of embankments."""
        usual = "concrete" if "concrete" in self.surfaces else "rock"
        return "soil" if "soil" in self.surfaces else usual

    def ground_between(self, start: float, end: float) -> NDArray[np.float64]:
        """Return the (n, 2) corners of the ground between two chainages, with both ends [m]."""
        inner = [x for x, _ in self.slope.points if start < x < end]
        return np.array([(x, self.profile.height(x)) for x in (start, *inner, end)])

    def ditch_side(self, x: float, width: float) -> float:
        """Return the side slope of a ditch [-], the flattest that the ground it cuts requires."""
        chain, names = self.profile.points[:, 0], self.profile.surfaces
        cut = np.flatnonzero((chain[:-1] < x + width) & (chain[1:] > x))
        spanned = {names[k] for k in cut}
        return max((STEEP_SIDES.get(name, FLAT_SIDE) for name in spanned), default=FLAT_SIDE)

    def mesh(self, name: str) -> MeshOption:
        """Return a mesh option by its name.

        Raises
        ------
        BadInput
            If the site has no such option.
        """
        for option in self.meshes:
            if option.name == name:
                return option
        known = (
            ", ".join(option.name for option in self.meshes)
            or "none: this site has no mesh options"
        )
        raise BadInput("mesh option", name, f"choose one of {known}")

    def mesh_span(self, name: str) -> tuple[float, float]:
        """Return the chainages of the sources whose events a mesh option makes less frequent [m].

        If it changes no event, they are those of all sources.

        Raises
        ------
        BadInput
            If the site has no option of this name.
        """
        factors = self.mesh(name).factors
        sources = {event.source for event in self.events if factors.get(event.name, 1.0) < 1.0}
        rock = [source for source in self.sources if source.name in sources or not sources]
        ends = [s.band if s.band is not None else s.outline[:, 0].tolist() for s in rock]
        return min(min(x) for x in ends), max(max(x) for x in ends)


@lru_cache(maxsize=256)
def _ground(points: tuple[Point, ...], surface: str, stretches: tuple[Stretch, ...]) -> Terrain:
    """Return the terrain of a slope; cached because every episode needs it several times."""
    return Terrain(*Slope(points, 0.0, surface, stretches).chain())
