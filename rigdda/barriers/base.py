"""Base classes of barriers: `Barrier`, `Earthwork` and `Standing`."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, NamedTuple, Protocol, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import fields
from rigdda.errors import BadInput
from rigdda.fields import about
from rigdda.geometry import polygon_properties
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.prices import Prices
from rigdda.ground.surface import Surface
from rigdda.ground.terrain import Terrain

Floats = NDArray[np.float64]
Drawn = Literal["solid", "moving", "line"]

STANDS = "stands"
"""State of an intact barrier."""

GONE = ("failed", "overturned", "pushed")
"""States in which a barrier holds no rock."""

ELEMENT = 5.0
"""Length along the slope of an element, which acts as a unit and is the least that is repaired
[m]."""

THINNEST, LARGEST = 1e-3, 1e3
"""Least and greatest length of a barrier [m]. Values beyond them are regarded as typing errors, and
rounding errors would dominate thinner faces."""

DENSEST = 1e5
"""Greatest density of a barrier [kg/m3]."""

Metres = Annotated[float, about(ge=THINNEST, le=LARGEST)]


class Reach(NamedTuple):
    """Region in which a barrier holds rock, between two chainages and below a rising line."""

    start: float
    end: float
    top: float
    """Elevation of the line at `end` [m]."""
    rise: float
    """Slope of the line: the steepest surface of a deposit, rise over run [-]."""

    def includes(self, x: float, y: float) -> bool:
        """Return whether a point is inside."""
        return self.start <= x < self.end and y < self.top + self.rise * (self.end - x)


MIN_HEIGHT = 0.5
"""Minimum height of a barrier, and minimum depth of a ditch, in a design [m]."""

SIZE_STEP = 0.5
"""Increment of heights, depths and widths in a search [m]; thickness has half of it."""

LIMIT_ROUNDING = 1e-9
"""Rounding error that is tolerated at limits, relative to the limit or, if larger, 1 [m]."""

BOUND_MARGIN = 0.05
"""Distance from a bound within which a length counts as being at the bound [m]."""

CATALOGUE_HEIGHTS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
"""Heights of barriers in the catalogue of a search [m]."""


class Length(NamedTuple):
    """A dimension of a kind of barrier that is a design variable."""

    field: str
    """Field of the barrier."""
    most: str
    """Field of the zone with its greatest value."""
    least: str | None = None
    """Field of the zone with its least value; None: `MIN_HEIGHT` in a design."""
    step: float = SIZE_STEP
    """Increment in a search [m]."""

    def limits(self, zone: BarrierZone) -> tuple[float, float]:
        """Return the least and the greatest value that the zone permits [m]."""
        return getattr(zone, self.least) if self.least else 0.0, getattr(zone, self.most)

    def range(self, zone: BarrierZone) -> tuple[float, float]:
        """Return the range of the design variable [m]."""
        low, high = self.limits(zone)
        return (low if self.least else MIN_HEIGHT), high


def at_ends(value: float, low: float, high: float, name: str) -> list[str]:
    """Return in words whether a length is at its least or greatest value."""
    found = [f"least {name}"] if value - low <= BOUND_MARGIN else []
    return found + ([f"greatest {name}"] if high - value <= BOUND_MARGIN else [])


class MeshPrice(Protocol):
    """Interface of a mesh option with its area per metre of road and its price."""

    @property
    def area(self) -> float:
        """Area per metre of road [m2/m]."""

    @property
    def price(self) -> float:
        """Price [EUR/m2]."""


class KnownSite(Protocol):
    """Interface of a site as barriers use it; implemented by `rigdda.Site`."""

    @property
    def profile(self) -> Terrain:
        """The natural ground."""

    @property
    def prices(self) -> Prices:
        """Prices of the site."""

    def surface_at(self, x: float) -> str:
        """Return the name of the ground surface at a chainage."""

    def ditch_side(self, x: float, width: float) -> float:
        """Return the side slope of a ditch, run over rise [-]."""

    def mesh(self, name: str) -> MeshPrice:
        """Return a mesh option by its name."""

    def removal_price(self, x: float) -> float:
        """Return the cost of removing the existing barrier at a chainage [EUR/m]."""


class Subsoil(Protocol):
    """Interface of a scene for the resistance of barriers; implemented by `rigdda.Scene`."""

    @property
    def terrain(self) -> Terrain | None:
        """The natural ground."""

    @property
    def gravity_vector(self) -> tuple[float, float]:
        """Acceleration of gravity [m/s2]."""

    @property
    def fill(self) -> str:
        """Name of the surface of embankments."""

    @property
    def barrier_surface(self) -> str:
        """Name of the surface of barriers."""

    def interface(self, first: str, second: str) -> Surface:
        """Return the contact properties of two surfaces."""


class Barrier(msgspec.Struct, frozen=True, tag_field="kind", forbid_unknown_fields=True):
    """Base class of barriers; in files a barrier is a table with its `kind`.

    Attributes
    ----------
    fails : str
        State after a failure found by the kernels, due to energy or thrust.
    repaired : float
        Least length that is rebuilt after a failure [m].
    drawn : str
        How replays and images show it: as a fixed body, as a moving body, or as a line.
    designed : bool
        Whether designers use the kind by default.
    fallible : bool
        Whether it can fail.
    upkeep : float
        Annual maintenance cost as a share of the capital cost if `Prices.upkeep` has no value for
        the kind [1/year].
    by_friction : bool
        Whether its resistance depends on the friction of the ground.
    steepest : float or None
        Greatest mean inclination of the ground under it [deg]; None: no limit.
    has_sides : bool
        Whether its works end where its downhill side meets the ground instead of after `extent`.
    lengths : tuple of Length
        Its design variables, height or depth first; at most two.
    """

    x: Annotated[float, about("Chainage of its uphill face.", "m")]
    fails: ClassVar[str] = "failed"
    repaired: ClassVar[float] = ELEMENT
    drawn: ClassVar[Drawn] = "solid"
    designed: ClassVar[bool] = True
    fallible: ClassVar[bool] = False
    upkeep: ClassVar[float] = 0.01
    by_friction: ClassVar[bool] = False
    steepest: ClassVar[float | None] = None
    has_sides: ClassVar[bool] = False
    lengths: ClassVar[tuple[Length, ...]] = ()

    def __post_init__(self) -> None:
        fields.check(self, f"{self.words} ")

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed the barrier [m]."""
        raise NotImplementedError

    @property
    def extent(self) -> float:
        """Length along the slope, on level ground [m]."""
        raise NotImplementedError

    @property
    def deflection(self) -> float:
        """Clear distance downhill that it needs for its deflection [m]."""
        return 0.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the capital cost without the surcharge for height [EUR per metre of road].

        Parameters
        ----------
        site : KnownSite
            The site with its prices.
        outline : (n, 2) array or None
            Corners of the soil that an earthwork moves [m].
        """
        raise NotImplementedError

    def resistance(self, scene: Subsoil, outline: Floats) -> float:
        """Return the thrust that it resists, standing as `outline` [N/m]; inf if it cannot move."""
        return math.inf

    def changes(self, times: Floats, poses: Floats, failure: float) -> list[tuple[float, str]]:
        """Return the times [s] and new states of its changes, from poses or failure time [s]."""
        return [(failure, self.fails)] if math.isfinite(failure) else []

    def holds(self, outline: Floats, ground: Terrain | None, rise: float) -> Reach:
        """Return the region in which it holds rock with deposits of slope `rise`."""
        return Reach(-math.inf, float(outline[:, 0].min()), float(outline[:, 1].max()), rise)

    def left_height(self, displacement: float) -> float:
        """Return the remaining height after a displacement [m]."""
        raise NotImplementedError

    def area_beyond(self, x: float, outline: Floats) -> float:
        """Return its area beyond a chainage, given its final `outline` [m2]."""
        return 0.0

    def idle_resistance(self, other: Barrier, resistance: float) -> float:
        """Return the thrust that it resists, scaled from that of `other` [N/m].

        `other` is the same barrier at the same place, but for another width of event.
        """
        return resistance

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its dimensions in words; `metres` formats a length."""
        raise NotImplementedError

    @property
    def label(self) -> str:
        """Kind, class and main dimension in words, for the label in an image."""
        raise NotImplementedError

    @property
    def label_and_place(self) -> str:
        """Label and chainage in words."""
        return f"{self.label} at x = {self.x:.1f} m"

    def order(self, road: float) -> tuple[str, str]:
        """Return what a specification adds to `label`: dimensions and notes on the location.

        `road` is the chainage of the uphill edge of the road [m].
        """
        return "", ""

    # Design variables and siting.

    def works(self, ground: Terrain) -> tuple[float, float]:
        """Return the chainages between which it occupies the natural ground [m]."""
        return self.x, self.x + self.extent

    def check_design(self, where: str, site: KnownSite) -> None:
        """Check the design rules of its kind, in addition to the limits of the zone.

        Raises
        ------
        BadInput
            If it breaks a rule; the message begins with `where`.
        """

    def placed(self, x: float, site: KnownSite, zone: BarrierZone) -> Self | None:
        """Return it at another chainage with the sizes required there; None if impossible."""
        return msgspec.structs.replace(self, x=x)

    @classmethod
    def of_shares(cls, zone: BarrierZone, x: float, first: float, second: float) -> Self:
        """Return a barrier whose dimensions are given as shares of their ranges, from 0 to 1."""
        sizes = {}
        for length, share in zip(cls.lengths, (first, second), strict=False):
            low, high = length.range(zone)
            sizes[length.field] = low + share * (high - low)
        return cls(x=x, **sizes)

    def shares(self, zone: BarrierZone) -> tuple[float, float]:
        """Return its dimensions as shares of their ranges; the inverse of `of_shares`."""
        found = [share_of(getattr(self, n.field), *n.range(zone)) for n in self.lengths]
        first, second, *_ = [*found, 0.5, 0.5]
        return first, second

    @classmethod
    def catalogue(cls, zone: BarrierZone) -> Iterator[Self]:
        """Yield barriers of the sizes that a search tries first, at the start of the zone."""
        raise NotImplementedError

    def bounds(self, zone: BarrierZone) -> dict[str, tuple[float, float]]:
        """Return the range of each dimension in a search [m]."""
        return {length.field: length.range(zone) for length in self.lengths}

    def resized(self, name: str, value: float, zone: BarrierZone) -> Self:
        """Return it with one dimension changed, clipped to its range."""
        low, high = self.bounds(zone)[name]
        return msgspec.structs.replace(self, **{name: min(max(value, low), high)})

    def varied(self, level: int, zone: BarrierZone) -> Iterator[Self]:
        """Yield it with each dimension reduced and increased by `level` increments."""
        for length in self.lengths:
            for way in (-level, level):
                value = max(getattr(self, length.field) + way * length.step, MIN_HEIGHT)
                yield self.resized(length.field, value, zone)

    def thickest(self, zone: BarrierZone) -> Self:
        """Return it with the greatest thickness that the zone permits."""
        return self

    @property
    def numbers(self) -> list[float]:
        """Chainage and sizes by which a search compares barriers of the same kind."""
        return [self.x, *(getattr(self, length.field) for length in self.lengths[:1])]

    @property
    def size(self) -> float:
        """Measure of size among barriers of its kind."""
        return float(getattr(self, self.lengths[0].field)) if self.lengths else 0.0

    def sizes_at_bounds(self, zone: BarrierZone) -> list[str]:
        """Return in words which of its dimensions are at their least or greatest value."""
        found = []
        for name, (low, high) in self.bounds(zone).items():
            found += at_ends(getattr(self, name), low, high, name)
        return found

    @property
    def kind(self) -> str:
        """Name of the kind in layout files."""
        return str(type(self).__struct_config__.tag)

    def _with(self, **values: float | None) -> Self:
        """Return a copy with other, valid values, which are not checked."""
        other = copy.copy(self)
        for name, value in values.items():
            msgspec.structs.force_setattr(other, name, value)
        return other

    @property
    def words(self) -> str:
        """Name of the kind in words."""
        return self.kind.replace("_", " ")


def share_of(value: float, low: float, high: float) -> float:
    """Return the position of a value in a range as a share; 0.5 for an empty range."""
    return (value - low) / (high - low) if high > low else 0.5


class Earthwork(Barrier, frozen=True):
    """A barrier that changes the ground."""

    def for_width(self, width: float) -> Earthwork:
        """Return an equivalent barrier per metre that resists an event of this width [m]."""
        return self

    def build(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        """Return the (n, 2) corners of the soil moved from or onto `ground`, and the new ground.

        `surface` names the surface of a fill.

        Raises
        ------
        BadInput
            If it does not fit.
        """
        raise NotImplementedError


def section(outline: Floats) -> float:
    """Return the area of an outline [m2], independent of its orientation."""
    return abs(polygon_properties(outline)[0])


def base_friction(
    scene: Subsoil, density: float, own: str, outline: Floats, inclination_deg: float
) -> float:
    """Return the thrust in the direction of x that makes a body slide on the ground [N/m].

    The friction is the least of those that the scene has between its surface `own` and each of the
    surfaces under it, see `Scene.interface`. In a release of a site, the friction of blocks of rock
    on soil is used for a fill on bare rock. The inclination of the base is positive where it falls
    in the direction of x, see `sliding_angle`.
    """
    assert scene.terrain is not None
    below = surfaces_below(scene.terrain, outline)
    angle = min(scene.interface(own, name).friction_deg for name in below)
    angle = sliding_angle(angle, inclination_deg)
    return sliding_resistance(-scene.gravity_vector[1], density, section(outline), angle)


def surfaces_below(terrain: Terrain, outline: Floats) -> list[str]:
    """Return the surface name of each terrain segment below an outline."""
    low, high = outline[:, 0].min(), outline[:, 0].max()
    extents = (sorted(ends) for ends in pairwise(terrain.points[:, 0]))
    return [
        name
        for (start, end), name in zip(extents, terrain.surfaces, strict=True)
        if start < high and end > low
    ]


def sliding_angle(friction_deg: float, inclination_deg: float) -> float:
    """Return the angle phi - b of the resistance W tan(phi - b) to sliding on a slope [deg].

    The resistance is the horizontal thrust at which a body of weight W slides, from the equilibrium
    on ground that falls at an angle b in the direction of the thrust, with the friction angle phi.
    The angle is 0 if b is greater than phi. Ground that rises in this direction counts as level.
    """
    return max(friction_deg - max(inclination_deg, 0.0), 0.0)


def sliding_resistance(gravity: float, density: float, area: float, angle_deg: float) -> float:
    """Return the horizontal thrust at which a body slides on the ground [N/m].

    Parameters
    ----------
    gravity, density, area : float
        Gravity [m/s2], density [kg/m3] and area of the section [m2].
    angle_deg : float
        Friction angle less the inclination of the ground, see `sliding_angle` [deg].
    """
    return gravity * density * area * math.tan(math.radians(angle_deg))


FOUNDATION = 1.0
"""Depth of the foundations of walls and fences below the lowest ground under them [m]."""


SLENDER = 0.4
"""Least ratio of thickness to height of a gravity wall [-], for stability under its own weight,
wind and settlement of the ground."""


class Standing(Barrier, frozen=True):
    """A barrier that stands on the ground, with two vertical faces and a level top."""

    height: Annotated[Metres, about("Height above the highest ground under it.", "m")]
    lengths: ClassVar[tuple[Length, ...]] = (
        Length("height", "max_height"),
        Length("thickness", "max_thickness", "min_thickness", 0.5 * SIZE_STEP),
    )

    def for_width(self, width: float) -> Standing:
        """Return an equivalent barrier per metre that resists an event of this width [m]."""
        return self

    @property
    def thickness(self) -> float:
        """Extent downhill of `x` [m]; a field of every subclass."""
        raise NotImplementedError

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed its original position [m]."""
        return self.x + self.thickness

    @property
    def extent(self) -> float:
        """Length along the slope, on level ground [m]."""
        return self.thickness

    def left_height(self, displacement: float) -> float:
        """Return its height [m]."""
        return self.height

    @property
    def label(self) -> str:
        """Kind and height in words."""
        return f"{self.words} {self.height:.1f} m high"

    @classmethod
    def catalogue(cls, zone: BarrierZone) -> Iterator[Self]:
        """Yield barriers of every height, with the least thickness of a gravity wall."""
        for height in (h for h in CATALOGUE_HEIGHTS if h <= zone.max_height):
            thick = min(max(round(SLENDER * height, 1), zone.min_thickness), zone.max_thickness)
            sizes = {"height": height, "thickness": thick}
            yield cls(x=zone.start, **sizes)

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners, with the foot in `ground`.

        Raises
        ------
        BadInput
            If it does not stand on the ground.
        """
        x, y = self._under(ground)
        foot, top = float(y.min()) - FOUNDATION, float(y.max()) + self.height
        return np.array([[x[0], foot], [x[-1], foot], [x[-1], top], [x[0], top]])

    def _under(self, ground: Terrain) -> tuple[Floats, Floats]:
        """Return chainages and elevations of the ground under it, at corners and at its faces."""
        inner = {float(x) for x in ground.points[:, 0] if self.x < x < self.end}
        x = np.array([self.x, *sorted(inner), self.end])
        try:
            return x, np.array([ground.height(at) for at in x])
        except BadInput as bad:
            raise BadInput(f"{self.words} x", self.x, bad.hint) from None


Span = tuple[float, float]

MIN_GAP = 0.5
"""Minimum distance between the works of two barriers [m]."""


def occupied(barrier: Barrier, works: Span) -> Span:
    """Return the chainages that a barrier occupies, including its elongation downhill [m]."""
    start, end = works
    return start, end + barrier.deflection


def meet(one: Span, two: Span) -> bool:
    """Return whether two barriers are closer than `MIN_GAP`."""
    return one[0] < two[1] + MIN_GAP - LIMIT_ROUNDING and two[0] < one[1] + MIN_GAP - LIMIT_ROUNDING
