"""Gravity wall, which resists by its weight."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, ClassVar, Self

import msgspec
import numpy as np
import shapely

from rigdda.barriers.base import (
    DENSEST,
    ELEMENT,
    LIMIT_ROUNDING,
    SLENDER,
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
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.terrain import Terrain

LIGHTEST_WALL = 500.0
"""Least density of a wall [kg/m3]; a value such as 2.4 is in t/m3."""

SLID = 0.1
"""Displacement of a corner beyond which a gravity wall counts as slid [m]. The elastic deformation
of its contacts is about a hundredth of it."""


@documented
class GravityWall(Standing, frozen=True, tag="gravity_wall"):
    """A concrete block that stands on the terrain by its weight and can slide and overturn.

    Its faces are vertical and its top is level. Its base is straight: the chord of the ground
    between its faces or, if that chord would cut into the ground, the edge of the convex hull of
    the ground below its middle.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    height: Annotated[Metres, about("Height above the higher end of its base.", "m")]
    thickness: Annotated[Metres, about("Extent downhill of `x`.", "m")] = 1.0
    density: Annotated[
        float,
        about(
            "Density of the wall; 2400 for plain concrete.", "kg/m3", ge=LIGHTEST_WALL, le=DENSEST
        ),
    ] = 2400.0
    drawn: ClassVar[Drawn] = "moving"
    fallible: ClassVar[bool] = True
    by_friction: ClassVar[bool] = True
    steepest: ClassVar[float | None] = 30.0

    def for_width(self, width: float) -> Self:
        """Return an equivalent wall for an event of this width [m]; 5 m elements act as units."""
        factor = ELEMENT / min(width, ELEMENT)
        return self._with(density=self.density * factor)

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) initial corners on `ground`.

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

        # the chord that is highest at the middle is the edge of the convex hull
        over = [pair for pair in ends if x[pair[0]] <= middle <= x[pair[1]]]
        edge = max(over, key=lambda pair: base(pair, middle))
        left, right = base(edge, x[0]), base(edge, x[-1])
        top = max(left, right) + self.height
        return np.array([[x[0], left], [x[-1], right], [x[-1], top], [x[0], top]])

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the cost of its concrete without the surcharge for height [EUR/m]."""
        return site.prices.concrete * self.height * self.thickness

    def resistance(self, scene: Subsoil, outline: Floats) -> float:
        """Return the horizontal thrust at which it slides, see `base_friction` [N/m]."""
        inclination = self.base_inclination(scene.terrain, outline)
        return base_friction(scene, self.density, scene.barrier_surface, outline, inclination)

    def base_inclination(self, ground: Terrain | None, outline: Floats) -> float:
        """Return the inclination of its base, the first edge of its outline [deg].

        It is positive if the base falls in the direction of x.
        """
        (left, high), (right, low) = outline[:2].tolist()
        return math.degrees(math.atan2(high - low, right - left))

    def idle_resistance(self, other: Barrier, resistance: float) -> float:
        """Return the thrust that it resists, in proportion to its weight [N/m]."""
        assert isinstance(other, GravityWall)
        return resistance * self.density / other.density

    def changes(self, times: Floats, poses: Floats, failure: float) -> list[tuple[float, str]]:
        """Return the times at which it finally "slid" and "overturned"; it cannot slide after that.

        A wall that rocks and returns to its place has not slid; a wall that remains tilted has.
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
        """Return its area beyond a chainage, given its final `outline` [m2]."""
        (_, low), (far, high) = outline.min(axis=0), outline.max(axis=0)
        if far <= x:
            return 0.0
        return float(shapely.clip_by_rect(shapely.Polygon(outline), x, low, far, high).area)

    def order(self, road: float) -> tuple[str, str]:
        """Return its thickness in words."""
        return f"{self.thickness:.1f} m thick", ""

    def check_design(self, where: str, site: KnownSite) -> None:
        """Check that it is thick enough for its height.

        Raises
        ------
        BadInput
            If it is not; the message begins with `where`.
        """
        least = SLENDER * self.height
        if self.thickness < least - LIMIT_ROUNDING:
            hint = f"give at least {least:g}: {SLENDER:g} times the height"
            raise BadInput(f"{where}.thickness", self.thickness, hint)

    def placed(self, x: float, site: KnownSite, zone: BarrierZone) -> Self:
        """Return it at another chainage, with the thickness required by its height.

        The height is limited to that for which the zone permits the required thickness.
        """
        tall = min(self.height, zone.max_thickness / SLENDER)
        thick = max(self.thickness, SLENDER * tall)
        return msgspec.structs.replace(self, x=x, height=tall, thickness=thick)

    def thickest(self, zone: BarrierZone) -> Self:
        """Return it with the greatest thickness that the zone permits."""
        return msgspec.structs.replace(self, thickness=zone.max_thickness)

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its dimensions in words."""
        return f"{metres(self.height)} high, {metres(self.thickness)} thick"
