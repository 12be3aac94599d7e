"""What every barrier has, and what barriers share that stand on the ground."""

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
from rigdda.model.barrier_zone import BarrierZone
from rigdda.model.prices import Prices
from rigdda.model.surface import Surface
from rigdda.model.terrain import Terrain

Floats = NDArray[np.float64]
Drawn = Literal["solid", "moving", "line"]

STANDS = "stands"
"""State of a barrier as it was built."""

GONE = ("failed", "overturned", "pushed")
"""States in which a barrier holds nothing."""

ELEMENT = 5.0
"""Length of an element along the slope, which acts whole, and the least that is mended [m]."""

THINNEST, LARGEST = 1e-3, 1e3
"""Least and greatest length of a barrier [m]: beyond them it is a slip of the pen, and a face that
thin is lost in rounding."""

Metres = Annotated[float, about(ge=THINNEST, le=LARGEST)]


class Reach(NamedTuple):
    """Where a barrier holds rock: between two chainages, below a line that rises uphill."""

    start: float
    end: float
    top: float
    """Elevation of the line at `end` [m]."""
    rise: float
    """Rise over run of the line: the steepest surface of a deposit [-]."""

    def includes(self, x: float, y: float) -> bool:
        """Return whether a point is there."""
        return self.start <= x < self.end and y < self.top + self.rise * (self.end - x)


MIN_HEIGHT = 0.5
"""Least height of a barrier that is designed, and least depth of a ditch [m]."""

STEP = 0.5
"""Step of heights, depths and widths in a search [m]; of thickness half as much."""

TOLERANCE = 1e-9
"""Rounding that is forgiven at limits: share of the limit, and of 1 [m]."""

NEAR = 0.05
"""Distance from a bound at which a length lies on it [m]."""

HEIGHTS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
"""Heights of barriers of the catalogue of a search [m]."""


class Length(NamedTuple):
    """A length of a kind of barrier that a design decides."""

    field: str
    """Field of the barrier."""
    most: str
    """Field of the zone that limits it."""
    least: str | None = None
    """Field of the zone that is its least value; None: `MIN_HEIGHT` in a design."""
    step: float = STEP
    """Step in a search [m]."""

    def limits(self, zone: BarrierZone) -> tuple[float, float]:
        """Return the least and the greatest value that the zone allows [m]."""
        return getattr(zone, self.least) if self.least else 0.0, getattr(zone, self.most)

    def range(self, zone: BarrierZone) -> tuple[float, float]:
        """Return the range in which it is designed [m]."""
        low, high = self.limits(zone)
        return (low if self.least else MIN_HEIGHT), high


def at_ends(value: float, low: float, high: float, name: str) -> list[str]:
    """Return in words whether a length is the least or the greatest."""
    found = [f"least {name}"] if value - low <= NEAR else []
    return found + ([f"greatest {name}"] if high - value <= NEAR else [])


class MeshPrice(Protocol):
    """What a mesh costs: its area per metre of road [m2/m] and its price [EUR/m2]."""

    @property
    def area(self) -> float:
        """Area per metre of road [m2/m]."""

    @property
    def price(self) -> float:
        """Price [EUR/m2]."""


class KnownSite(Protocol):
    """What a barrier needs to know of a site, as `rigdda.Site` knows it."""

    @property
    def profile(self) -> Terrain:
        """The natural ground."""

    @property
    def prices(self) -> Prices:
        """Prices of the site."""

    def surface_at(self, x: float) -> str:
        """Return the surface of the ground at a chainage."""

    def ditch_side(self, x: float, width: float) -> float:
        """Return the side slope of a ditch [-]."""

    def mesh(self, name: str) -> MeshPrice:
        """Return an option of mesh by its name."""


class Subsoil(Protocol):
    """What a barrier needs to know of a scene to resist thrust: `rigdda.Scene` knows it."""

    @property
    def terrain(self) -> Terrain | None:
        """The natural ground."""

    @property
    def gravity_vector(self) -> tuple[float, float]:
        """Acceleration of gravity [m/s2]."""

    @property
    def fill(self) -> str:
        """Surface of embankments."""

    @property
    def barrier_surface(self) -> str:
        """Surface of barriers."""

    def interface(self, first: str, second: str) -> Surface:
        """Return how two surfaces meet."""


class Barrier(msgspec.Struct, frozen=True, tag_field="kind", forbid_unknown_fields=True):
    """What every barrier has; written as a table with its `kind`.

    Attributes
    ----------
    fails : str
        Its state when the kernels found that it gave way, by energy or thrust.
    repaired : float
        Least length that is built anew of one that failed [m].
    drawn : str
        How replays and pictures show it: as a body, as one that moves, or as a line.
    designed : bool
        Whether designers choose it unless they are told which kinds to choose from.
    fallible : bool
        Whether it can fail.
    upkeep : float
        Upkeep of a kind that the table `Prices.upkeep` does not know [1/year of the capital].
    by_friction : bool
        Whether its resistance depends on the friction of the ground.
    steepest : float or None
        Greatest mean inclination of the ground under it [deg]; None: it stands on any ground.
    has_sides : bool
        Whether its works end where its downhill side meets the ground, not after its extent.
    lengths : tuple of Length
        The lengths that a design decides, its height or depth first, at most two.
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
        """Chainage beyond which a block has passed it [m]."""
        raise NotImplementedError

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        raise NotImplementedError

    @property
    def elongation_path(self) -> float:
        """Distance downhill that it needs to give way [m]."""
        return 0.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return what it costs to build at the height of the road [EUR per metre of road].

        `outline`: what an earthwork moves, (n, 2) [m].
        """
        raise NotImplementedError

    def resistance(self, scene: Subsoil, outline: Floats) -> float:
        """Return the thrust that it bears, standing as `outline` [N/m]; inf: none moves it."""
        return math.inf

    def changes(self, times: Floats, poses: Floats, failure: float) -> list[tuple[float, str]]:
        """Return when it came into which state: by its poses at times, or failure, in [s]."""
        return [(failure, self.fails)] if math.isfinite(failure) else []

    def holds(self, outline: Floats, ground: Terrain | None, rise: float) -> Reach:
        """Return where it holds rock, standing as `outline`, with a deposit that rises so."""
        return Reach(-math.inf, float(outline[:, 0].min()), float(outline[:, 1].max()), rise)

    def left_height(self, displacement: float) -> float:
        """Return the height that is left after it has moved so far [m]."""
        raise NotImplementedError

    def area_beyond(self, x: float, outline: Floats) -> float:
        """Return its area that came to lie beyond a chainage, as `outline` at the end [m2]."""
        return 0.0

    def idle_resistance(self, other: Barrier, resistance: float) -> float:
        """Return the thrust that it bears [N/m], by that of one for another width.

        Both stand in the same place.
        """
        return resistance

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its sizes in words; `metres` writes a length."""
        raise NotImplementedError

    @property
    def label(self) -> str:
        """Kind, class and main size in words, as the label of a picture."""
        raise NotImplementedError

    def order(self, road: float) -> tuple[str, str]:
        """Return what an order says of it beside `label`: more of its sizes, and more of its place.

        `road` is the chainage of the uphill edge of the road [m].
        """
        return "", ""

    # What designs decide of it, and where it may be built.

    def works(self, ground: Terrain) -> tuple[float, float]:
        """Return the chainages between which it takes up the natural ground [m]."""
        return self.x, self.x + self.extent

    def check_design(self, where: str, site: KnownSite) -> None:
        """Check what the rules of design say of its kind beside the limits of the zone.

        Raises
        ------
        BadInput
            If it may not be built; the message begins with `where`.
        """

    def placed(self, x: float, site: KnownSite, zone: BarrierZone) -> Self | None:
        """Return it at another chainage with the sizes that it needs there; None if it cannot."""
        return msgspec.structs.replace(self, x=x)

    @classmethod
    def of_shares(cls, zone: BarrierZone, x: float, first: float, second: float) -> Self:
        """Return one at a chainage, its lengths at shares of their ranges, from 0 to 1."""
        sizes = {}
        for length, share in zip(cls.lengths, (first, second), strict=False):
            low, high = length.range(zone)
            sizes[length.field] = low + share * (high - low)
        return cls(x=x, **sizes)

    def shares(self, zone: BarrierZone) -> tuple[float, float]:
        """Return at which shares of their ranges its lengths are, as `of_shares` takes them."""
        found = [share_of(getattr(self, n.field), *n.range(zone)) for n in self.lengths]
        first, second, *_ = [*found, 0.5, 0.5]
        return first, second

    @classmethod
    def catalogue(cls, zone: BarrierZone) -> Iterator[Self]:
        """Yield barriers of every size that a search tries first, at the start of the zone."""
        raise NotImplementedError

    def bounds(self, zone: BarrierZone) -> dict[str, tuple[float, float]]:
        """Return the range of each length in a search [m]."""
        return {length.field: length.range(zone) for length in self.lengths}

    def resized(self, name: str, value: float, zone: BarrierZone) -> Self:
        """Return it with another length, within its range."""
        low, high = self.bounds(zone)[name]
        return msgspec.structs.replace(self, **{name: min(max(value, low), high)})

    def varied(self, level: int, zone: BarrierZone) -> Iterator[Self]:
        """Yield it with each length longer and shorter by so many steps."""
        for length in self.lengths:
            for way in (-level, level):
                value = max(getattr(self, length.field) + way * length.step, MIN_HEIGHT)
                yield self.resized(length.field, value, zone)

    def thickest(self, zone: BarrierZone) -> Self:
        """Return it as thick as the zone allows."""
        return self

    @property
    def numbers(self) -> list[float]:
        """What a search compares barriers of its kind by: its chainage and sizes."""
        return [self.x, *(getattr(self, length.field) for length in self.lengths[:1])]

    @property
    def size(self) -> float:
        """How large it is among those of its kind."""
        return float(getattr(self, self.lengths[0].field)) if self.lengths else 0.0

    def sizes_at_bounds(self, zone: BarrierZone) -> list[str]:
        """Return in words which of its sizes are the least or the greatest."""
        found = []
        for name, (low, high) in self.bounds(zone).items():
            found += at_ends(getattr(self, name), low, high, name)
        return found

    @property
    def kind(self) -> str:
        """Name of the kind, as in layout files."""
        return str(type(self).__struct_config__.tag)

    def for_width(self, width: float) -> Self:
        """Return it as it resists, per metre, an event of this width [m]."""
        return self

    def _with(self, **values: float | None) -> Self:
        """Return it with other values, which are known to be sound and are not checked."""
        other = copy.copy(self)
        for name, value in values.items():
            msgspec.structs.force_setattr(other, name, value)
        return other

    @property
    def words(self) -> str:
        """Name of the kind in words."""
        return self.kind.replace("_", " ")


def share_of(value: float, low: float, high: float) -> float:
    """Return at which share of a range a value is; 0.5 of an empty range."""
    return (value - low) / (high - low) if high > low else 0.5


class Earthwork(Barrier, frozen=True):
    """A barrier that changes the ground."""

    def build(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        """Return the (n, 2) corners of what it moves of `ground`, and the ground with it.

        `surface` names that of a fill.

        Raises
        ------
        BadInput
            If it does not fit.
        """
        raise NotImplementedError


def section(outline: Floats) -> float:
    """Return the area of an outline [m2], in whichever direction it is walked."""
    return abs(polygon_properties(outline)[0])


def base_friction(scene: Subsoil, density: float, own: str, outline: Floats) -> float:
    """Return weight times friction of what stands on the ground as an outline [N/m].

    The friction is the least of its surface, `own`, on those under it.
    """
    assert scene.terrain is not None
    below = surfaces_below(scene.terrain, outline)
    angle = min(scene.interface(own, name).friction_deg for name in below)
    return sliding_resistance(-scene.gravity_vector[1], density, section(outline), angle)


def surfaces_below(terrain: Terrain, outline: Floats) -> list[str]:
    """Return the names of the surfaces of the terrain below an outline, each segment's."""
    low, high = outline[:, 0].min(), outline[:, 0].max()
    extents = (sorted(ends) for ends in pairwise(terrain.points[:, 0]))
    return [
        name
        for (start, end), name in zip(extents, terrain.surfaces, strict=True)
        if start < high and end > low
    ]


def sliding_resistance(gravity: float, density: float, area: float, friction_deg: float) -> float:
    """Return the thrust that slides a body over level ground [N/m].

    Its weight times the coefficient of friction, for gravity [m/s2], density [kg/m3], area [m2] and
    angle of friction [deg].
    """
    return gravity * density * area * math.tan(math.radians(friction_deg))


FOUNDATION = 1.0
"""Depth to which walls and fences reach below the lowest ground under them [m]."""


SLENDER = 0.4
"""Least thickness over height of a gravity wall [-]: it stands by its weight, also in the wind and
on ground that gives."""


class Standing(Barrier, frozen=True):
    """A barrier that stands on the ground: two vertical faces and a level top."""

    height: Annotated[Metres, about("Height above the highest ground under it.", "m")]
    lengths: ClassVar[tuple[Length, ...]] = (
        Length("height", "max_height"),
        Length("thickness", "max_thickness", "min_thickness", 0.5 * STEP),
    )

    @property
    def thickness(self) -> float:
        """Extent downhill of `x` [m], a field of every kind."""
        raise NotImplementedError

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed it where it stood at the start [m]."""
        return self.x + self.thickness

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
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
        """Yield barriers of every height, as thick as a wall that stands by its weight."""
        for height in (h for h in HEIGHTS if h <= zone.max_height):
            thick = min(max(round(SLENDER * height, 1), zone.min_thickness), zone.max_thickness)
            sizes = {"height": height, "thickness": thick}
            yield cls(x=zone.start, **sizes)

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners, the foot in `ground`.

        Raises
        ------
        BadInput
            If it does not stand on the ground.
        """
        x, y = self._under(ground)
        foot, top = float(y.min()) - FOUNDATION, float(y.max()) + self.height
        return np.array([[x[0], foot], [x[-1], foot], [x[-1], top], [x[0], top]])

    def _under(self, ground: Terrain) -> tuple[Floats, Floats]:
        """Return chainages and elevations of the ground's corners under it, its faces included."""
        inner = {float(x) for x in ground.points[:, 0] if self.x < x < self.end}
        x = np.array([self.x, *sorted(inner), self.end])
        try:
            return x, np.array([ground.height(at) for at in x])
        except BadInput as bad:
            raise BadInput(f"{self.words} x", self.x, bad.mend) from None
