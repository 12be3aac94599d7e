"""Embankment of compacted soil on the ground."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Annotated, ClassVar, Self

import msgspec
import numpy as np

from rigdda.barriers.base import (
    CATALOGUE_HEIGHTS,
    DENSEST,
    Barrier,
    Earthwork,
    Floats,
    KnownSite,
    Length,
    Metres,
    Reach,
    Subsoil,
    base_friction,
    section,
)
from rigdda.barriers.grading import FLATTEST_SLOPE, LEAST_SLOPE, regrade, span
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.terrain import Terrain

LIGHTEST_FILL = 200.0
"""Least density of a fill [kg/m3]. Expanded clay has 300; a value such as 1.9 is in t/m3."""

CREST = 1.0
"""Minimum width of the crest of an embankment in a search [m], so that a machine can build it."""


@documented
class Embankment(Earthwork, frozen=True, tag="embankment"):
    """An embankment of compacted soil with a level crest, raised on the terrain.

    Its surface is "soil" if the scene defines it, otherwise that of the other barriers. If the
    thrust of resting and impacting rock, averaged over one second, exceeds W tan(phi - b), with its
    weight W, its base friction phi and the inclination b of the ground, it is pushed away and has
    no further effect.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    x: Annotated[float, about("Chainage of its uphill toe.", "m")]
    height: Annotated[Metres, about("Height of the crest above the ground at `x`.", "m")]
    width: Annotated[Metres, about("Width of the crest.", "m")] = 1.0
    side_slope: Annotated[
        float,
        about(
            "Run over rise of its sides; 0.5 is usual for reinforced soil. The downhill side ends "
            "where it meets the ground.",
            "-",
            ge=LEAST_SLOPE,
            le=FLATTEST_SLOPE,
        ),
    ] = 0.5
    density: Annotated[
        float,
        about(
            "Density of the fill; 1900 for compacted soil.", "kg/m3", ge=LIGHTEST_FILL, le=DENSEST
        ),
    ] = 1900.0
    fails: ClassVar[str] = "pushed"
    fallible: ClassVar[bool] = True
    by_friction: ClassVar[bool] = True
    steepest: ClassVar[float | None] = 25.0
    has_sides: ClassVar[bool] = True
    lengths: ClassVar[tuple[Length, ...]] = (
        Length("height", "max_height"),
        Length("width", "max_thickness", "min_thickness"),
    )

    def for_width(self, width: float) -> Self:
        """Return an equivalent embankment for an event of this width [m].

        The load spreads at 45 degrees, so that the width plus the height on either side resists.
        """
        factor = (width + 2.0 * self.height) / width
        return self._with(density=self.density * factor)

    @property
    def end(self) -> float:
        """Chainage of the downhill edge of its crest, beyond which a block has passed it [m]."""
        return self.x + self.side_slope * self.height + self.width

    @property
    def extent(self) -> float:
        """Length along the slope, on level ground [m]."""
        return 2.0 * self.side_slope * self.height + self.width

    def build(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        """Return the (n, 2) corners of the fill on `ground`, and the new ground.

        `surface` names the surface of the fill.

        Raises
        ------
        BadInput
            If the embankment does not fit.
        """
        base = span("embankment x", ground, self.x, self.end)[0, 1]
        top, toe = base + self.height, self._toe(ground, base + self.height)
        line = np.array(
            [
                [self.x, base],
                [self.x + self.side_slope * self.height, top],
                [self.end, top],
                [toe, top - (toe - self.end) / self.side_slope],
            ]
        )
        return regrade("embankment x", ground, line, np.maximum, surface)

    def _toe(self, ground: Terrain, top: float) -> float:
        """Return the chainage where the downhill side meets the ground [m]."""
        corners = ground.points
        ahead = corners[corners[:, 0] > self.end, 0]
        for x in ahead:
            # span raises if the ground turns back before the side meets it
            piece = span("embankment x", ground, self.end, float(x))
            over = top - (piece[:, 0] - self.end) / self.side_slope - piece[:, 1]
            if over[-1] <= 0.0:
                before, after = max(over[-2], 0.0), over[-1]
                share = before / (before - after) if before > 0.0 else 0.0
                toe = piece[-2, 0] + share * (piece[-1, 0] - piece[-2, 0])
                return max(float(toe), self.end + 1e-6)
        raise BadInput(
            "embankment x",
            self.x,
            "put it where the ground is flatter than its downhill side, which must meet the ground",
        )

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the cost of its fill without the surcharge for height [EUR/m]."""
        assert outline is not None
        return site.prices.embankment * section(outline)

    def resistance(self, scene: Subsoil, outline: Floats) -> float:
        """Return the horizontal thrust at which it slides, see `base_friction` [N/m]."""
        assert scene.terrain is not None
        inclination = self.base_inclination(scene.terrain, outline)
        return base_friction(scene, self.density, scene.fill, outline, inclination)

    def base_inclination(self, ground: Terrain, outline: Floats) -> float:
        """Return the inclination of the ground between its ends, positive if it falls [deg]."""
        left, right = float(outline[:, 0].min()), float(outline[:, 0].max())
        fall = ground.height(left) - ground.height(right)
        return math.degrees(math.atan2(fall, right - left))

    def idle_resistance(self, other: Barrier, resistance: float) -> float:
        """Return the thrust that it resists, in proportion to its weight [N/m]."""
        assert isinstance(other, Embankment)
        return resistance * self.density / other.density

    def holds(self, outline: Floats, ground: Terrain | None, rise: float) -> Reach:
        """Return the region in which it holds rock, which includes its uphill side."""
        usual = super().holds(outline, ground, rise)
        return usual._replace(end=usual.end + self.side_slope * self.height)

    def left_height(self, displacement: float) -> float:
        """Return its height [m]."""
        return self.height

    @property
    def label(self) -> str:
        """Kind and height in words."""
        return f"embankment {self.height:.1f} m high"

    def order(self, road: float) -> tuple[str, str]:
        """Return the width of its crest in words."""
        return f"crest {self.width:.1f} m wide", ""

    def works(self, ground: Terrain) -> tuple[float, float]:
        """Return the chainages between which it occupies the natural ground [m].

        It ends where its downhill side meets the ground, or at the end of the ground if it does
        not.
        """
        along, level = ground.points.T
        top = float(np.interp(np.array([self.x]), along, level)[0]) + self.height
        ahead = along > self.end
        x = np.concatenate([[self.end], along[ahead]])
        y = np.concatenate([np.interp(x[:1], along, level), level[ahead]])
        over = top - (x - self.end) / self.side_slope - y
        k = int(np.argmax(over <= 0.0))  # first corner at or above the side
        if over[k] > 0.0:
            return self.x, float(x[-1])
        if k == 0:
            return self.x, self.end
        share = over[k - 1] / (over[k - 1] - over[k])
        return self.x, float(x[k - 1] + share * (x[k] - x[k - 1]))

    @classmethod
    def least_crest(cls, zone: BarrierZone) -> float:
        """Return the minimum width of the crest in a search [m]."""
        return min(max(CREST, zone.min_thickness), zone.max_thickness)

    @classmethod
    def catalogue(cls, zone: BarrierZone) -> Iterator[Self]:
        """Yield embankments of every height, with the narrowest crest."""
        crest = cls.least_crest(zone)
        yield from (cls(zone.start, h, crest) for h in CATALOGUE_HEIGHTS if h <= zone.max_height)

    def bounds(self, zone: BarrierZone) -> dict[str, tuple[float, float]]:
        """Return the ranges of its height and crest width in a search [m]."""
        return super().bounds(zone) | {"width": (self.least_crest(zone), zone.max_thickness)}

    def thickest(self, zone: BarrierZone) -> Self:
        """Return it with the widest crest that the zone permits."""
        return msgspec.structs.replace(self, width=zone.max_thickness)

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its dimensions in words."""
        return f"{metres(self.height)} high, crest {metres(self.width)} wide"
