"""What every barrier has, and what barriers share that stand on the ground."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from itertools import pairwise
from typing import ClassVar, Literal, NamedTuple, Protocol, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.errors import BadInput
from rigdda.geometry import polygon_properties
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


class MeshPrice(Protocol):
    """What a mesh costs: its area per metre of road [m2/m] and its price [EUR/m2]."""

    @property
    def area(self) -> float:
        """Area per metre of road [m2/m]."""

    @property
    def price(self) -> float:
        """Price [EUR/m2]."""


class PricedSite(Protocol):
    """What a barrier needs to know of a site to have a price: `rigdda.Site` knows it."""

    @property
    def prices(self) -> Prices:
        """Prices of the site."""

    def surface_at(self, x: float) -> str:
        """Return the surface of the ground at a chainage."""

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


class BarrierBase(msgspec.Struct, frozen=True, tag_field="kind", forbid_unknown_fields=True):
    """What every barrier has; written as a table with its `kind`.

    Attributes
    ----------
    fails : str
        Its state when the kernels found that it gave way, by energy or thrust.
    repaired : float
        Least length that is built anew of one that failed [m].
    drawn : str
        How replays and pictures show it: as a body, as one that moves, or as a line.
    """

    x: float
    fails: ClassVar[str] = "failed"
    repaired: ClassVar[float] = ELEMENT
    drawn: ClassVar[Drawn] = "solid"

    def price(self, site: PricedSite, outline: Floats | None) -> float:
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

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its sizes in words; `metres` writes a length."""
        raise NotImplementedError

    @property
    def kind(self) -> str:
        """Name of the kind, as in layout files."""
        return str(type(self).__struct_config__.tag)

    def for_width(self, width: float) -> Self:
        """Return it as it resists, per metre, an event of this width [m]."""
        return self

    def _check(self, *lengths: str) -> None:
        """Check and set where it is and its lengths."""
        check.set_number(self, "x", field=f"{self.words} x")
        for name in lengths:
            self._check_number(name, THINNEST, LARGEST)

    def _check_number(self, name: str, low: float, high: float = math.inf) -> None:
        """Check and set a field."""
        check.set_number(self, name, low, high, open_low=low == 0.0, field=f"{self.words} {name}")

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


class Standing(BarrierBase, frozen=True):
    """A barrier that stands on the ground: two vertical faces and a level top."""

    height: float

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
