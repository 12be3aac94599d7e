"""A wall that stands by its weight."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, ClassVar, Self

import msgspec
import numpy as np
import shapely

from rigdda.barriers.base import (
    ELEMENT,
    SLENDER,
    TOLERANCE,
    Barrier,
    Drawn,
    Floats,
    KnownSite,
    Metres,
    Standing,
    Subsoil,
    base_friction,
)
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.model.barrier_zone import BarrierZone
from rigdda.model.terrain import Terrain

SLID = 0.1
"""Displacement of a corner beyond which a gravity wall has slid [m]: what its contacts give under
load is a hundredth of it."""


@documented
class GravityWall(Standing, frozen=True, tag="gravity_wall"):
    """A concrete block that stands on the terrain by its weight, and can slide and overturn.

    Its faces are vertical and its top is level. Its base is straight: the chord of the ground
    between its faces or, where that would dip into the ground, the edge of the ground's convex
    hull below its middle.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    height: Annotated[Metres, about("Height above the higher end of its base.", "m")]
    thickness: Annotated[Metres, about("Extent downhill of `x`.", "m")] = 1.0
    density: Annotated[
        float, about("Density of the wall; 2400 is plain concrete.", "kg/m3", gt=0.0)
    ] = 2400.0
    drawn: ClassVar[Drawn] = "moving"
    fallible: ClassVar[bool] = True
    by_friction: ClassVar[bool] = True
    steepest: ClassVar[float | None] = 30.0

    def for_width(self, width: float) -> Self:
        """Return the wall that resists what is so wide [m]: its elements of 5 m act whole."""
        factor = ELEMENT / min(width, ELEMENT)
        return msgspec.structs.replace(self, density=self.density * factor)

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners at the start, on `ground`.

        Raises
        ------
        BadInput
            If it does not stand on the ground.
        """
        x, y = self._under(ground)
        middle = 0.5 * (x[0] + x[-1])
        ends = [(i, j) for i in range(len(x)) for j in range(i + 1, len(x))]

        def base(pair: tuple[int, int], at: float) -> float:
            i, j = pair
            return float(y[i] + (y[j] - y[i]) * (at - x[i]) / (x[j] - x[i]))

        # of all chords across the middle the highest there is the edge of the convex hull
        over = [pair for pair in ends if x[pair[0]] <= middle <= x[pair[1]]]
        edge = max(over, key=lambda pair: base(pair, middle))
        left, right = base(edge, x[0]), base(edge, x[-1])
        top = max(left, right) + self.height
        return np.array([[x[0], left], [x[-1], right], [x[-1], top], [x[0], top]])

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the price at the height of the road, that of its concrete [EUR/m]."""
        return site.prices.concrete * self.height * self.thickness

    def resistance(self, scene: Subsoil, outline: Floats) -> float:
        """Return its weight times the friction of its base [N/m]."""
        return base_friction(scene, self.density, scene.barrier_surface, outline)

    def idle_resistance(self, other: Barrier, resistance: float) -> float:
        """Return the thrust that it bears, in proportion to its weight [N/m]."""
        assert isinstance(other, GravityWall)
        return resistance * self.density / other.density

    def changes(self, times: Floats, poses: Floats, failure: float) -> list[tuple[float, str]]:
        """Return when it "slid" for good and when it "overturned", after which it slides no more.

        One that rocks and comes back to its place has not slid; one that is left leaning has.
        """
        x, y, theta = (poses - poses[0]).T
        cos, sin = np.cos(theta) - 1.0, np.sin(theta)
        moved = [
            np.hypot(x + cos * rx - sin * ry, y + sin * rx + cos * ry)
            for rx in (-0.5 * self.thickness, 0.5 * self.thickness)
            for ry in (-0.5 * self.height, 0.5 * self.height)
        ]
        here = np.flatnonzero(np.max(moved, axis=0) <= SLID)
        over = np.flatnonzero(abs(theta) > math.atan2(self.thickness, self.height))
        slid = float(times[here[-1] + 1]) if here[-1] + 1 < len(times) else math.inf
        turned = float(times[over[0]]) if len(over) else math.inf
        found = [(slid, "slid")] if slid < turned else []
        return [*found, (turned, "overturned")] if turned < math.inf else found

    def area_beyond(self, x: float, outline: Floats) -> float:
        """Return its area that came to lie beyond a chainage, as `outline` at the end [m2]."""
        (_, low), (far, high) = outline.min(axis=0), outline.max(axis=0)
        if far <= x:
            return 0.0
        return float(shapely.clip_by_rect(shapely.Polygon(outline), x, low, far, high).area)

    def order(self, road: float) -> tuple[str, str]:
        """Return its thickness in words."""
        return f"{self.thickness:.1f} m thick", ""

    def check_design(self, where: str, site: KnownSite) -> None:
        """Check that it is thick enough to stand by its weight. Raises as that of `Barrier`."""
        least = SLENDER * self.height
        if self.thickness < least - TOLERANCE:
            mend = f"give at least {least:g}: a gravity wall stands by its weight"
            raise BadInput(f"{where}.thickness", self.thickness, mend)

    def placed(self, x: float, site: KnownSite, zone: BarrierZone) -> Self:
        """Return it at another chainage, as thick as its height needs.

        It is at most as high as the greatest thickness allows.
        """
        tall = min(self.height, zone.max_thickness / SLENDER)
        thick = max(self.thickness, SLENDER * tall)
        return msgspec.structs.replace(self, x=x, height=tall, thickness=thick)

    def thickest(self, zone: BarrierZone) -> Self:
        """Return it as thick as the zone allows."""
        return msgspec.structs.replace(self, thickness=zone.max_thickness)

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its sizes in words."""
        return f"{metres(self.height)} high, {metres(self.thickness)} thick"
