"""Ditch, cut into the ground."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, ClassVar, Self

import msgspec
import numpy as np

from rigdda.barriers.base import (
    LIMIT_ROUNDING,
    MIN_HEIGHT,
    Drawn,
    Earthwork,
    Floats,
    KnownSite,
    Length,
    Metres,
    Reach,
)
from rigdda.barriers.grading import FLATTEST_SLOPE, LEAST_SLOPE, regrade, span
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.terrain import Terrain

MIN_FLOOR = 1.0
"""Minimum width of the floor of a designed ditch [m]. A machine must be able to empty it, and rock
would clog a V-shaped notch."""

CATALOGUE_DEPTHS, CATALOGUE_WIDTHS = (
    (0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0),
    (2.0, 3.0, 4.0, 5.0, 6.0, 8.0),
)
"""Depths and widths of ditches in the catalogue of a search [m]."""


@documented
class Ditch(Earthwork, frozen=True, tag="ditch"):
    """A ditch with a level floor, cut into the terrain. Its surface is that of the terrain.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    x: Annotated[float, about("Chainage of its uphill edge.", "m")]
    depth: Annotated[Metres, about("Depth of the floor below the lower of its edges.", "m")]
    width: Annotated[Metres, about("Horizontal distance between its edges.", "m")]
    side_slope: Annotated[
        float,
        about(
            "Run over rise of its sides; 0.25 is usual for a cut in rock.",
            "-",
            ge=LEAST_SLOPE,
            le=FLATTEST_SLOPE,
        ),
    ] = 0.25
    drawn: ClassVar[Drawn] = "line"
    steepest: ClassVar[float | None] = 30.0
    lengths: ClassVar[tuple[Length, ...]] = (
        Length("depth", "max_depth"),
        Length("width", "max_width", "min_width"),
    )

    @property
    def end(self) -> float:
        """Chainage of its downhill edge, beyond which a block has passed it [m]."""
        return self.x + self.width

    @property
    def extent(self) -> float:
        """Length along the slope [m]."""
        return self.width

    def build(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        """Return the (n, 2) corners of the cut in `ground`, and the new ground.

        `surface`, which names the surface of fills, is ignored.

        Raises
        ------
        BadInput
            If the ditch does not fit.
        """
        line = self._line(ground)
        _, (first, _), (last, _), _ = line.tolist()
        if last - first < 1e-6:
            least = self._least_width(ground)
            mend = (
                "less depth or steeper sides"
                if least is None
                else f"more than {least:g}, or less depth"
            )
            raise BadInput(
                "ditch width", self.width, f"give {mend}: its sides meet above the floor"
            )
        return regrade("ditch x", ground, line, np.minimum, None)

    def _line(self, ground: Terrain) -> Floats:
        """Return its edges and the corners of its floor, (4, 2), going downhill."""
        old = span("ditch x", ground, self.x, self.end)
        (left, high), (right, low) = old[0], old[-1]
        floor = min(high, low) - self.depth
        first = left + self.side_slope * (high - floor)
        last = right - self.side_slope * (low - floor)
        return np.array([[left, high], [first, floor], [last, floor], [right, low]])

    def _least_width(self, ground: Terrain) -> float | None:
        """Return the width beyond which its floor has a width, if its sides meet [m].

        A wider ditch on a slope also ends lower, so that its uphill side is longer. Returns None if
        no greater width is enough on this ground.
        """
        along, level = ground.points.T
        ahead = along > self.end
        x = np.concatenate([[self.x, self.end], along[ahead]])
        y = np.concatenate([np.interp(x[:2], along, level), level[ahead]])
        floor = x - self.x - self.side_slope * (np.abs(y - y[0]) + 2.0 * self.depth)
        wide = np.flatnonzero(floor[1:] > 0.0)
        if not len(wide):
            return None
        k = int(wide[0]) + 1
        share = floor[k] / (floor[k] - floor[k - 1])
        return float(x[k] - share * (x[k] - x[k - 1])) - self.x

    def cut(self, ground: Terrain) -> tuple[float, float]:
        """Return the height of its uphill side and the width of its floor [m].

        Raises
        ------
        BadInput
            If the ditch does not lie on the ground.
        """
        (_, high), (first, floor), (last, _), _ = self._line(ground).tolist()
        return high - floor, last - first

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the cost of the excavation without the surcharge for height [EUR/m].

        Each ground surface has its own price. `outline` has the new ground from left to right,
        followed by the old ground in reverse, see `rigdda.barriers.grading.regrade`.
        """
        assert outline is not None
        prices = site.prices.ditch
        highest_price = max(prices.values())
        count = len(outline) // 2 + 1
        x, new = outline[:count].T
        old = np.array([new[0], *outline[: count - 1 : -1, 1], new[-1]])
        depth = np.abs(old - new)
        volume = 0.5 * (depth[1:] + depth[:-1]) * np.diff(x)
        names = [site.surface_at(middle) for middle in 0.5 * (x[1:] + x[:-1])]
        dug = sum(v * prices.get(n, highest_price) for v, n in zip(volume, names, strict=True))
        return site.prices.ditch_base + float(dug)

    def left_height(self, displacement: float) -> float:
        """Return 0: a ditch has no height [m]."""
        return 0.0

    def holds(self, outline: Floats, ground: Terrain | None, rise: float) -> Reach:
        """Return the region between its edges, below the surface of a deposit that it stops."""
        assert ground is not None
        return Reach(self.x, self.end, ground.height(self.end), rise)

    @property
    def label(self) -> str:
        """Kind and dimensions in words."""
        return f"ditch {self.depth:.1f} m deep, {self.width:.1f} m wide"

    def check_design(self, where: str, site: KnownSite) -> None:
        """Check that its sides are flat enough to be stable.

        Raises
        ------
        BadInput
            If they are too steep; the message begins with `where`.
        """
        least = site.ditch_side(self.x, self.width)
        if self.side_slope < least - LIMIT_ROUNDING:
            hint = f"give at least {least:g}, the stable side slope of a cut in this ground"
            raise BadInput(f"{where}.side_slope", self.side_slope, hint)

    def placed(self, x: float, site: KnownSite, zone: BarrierZone) -> Self | None:
        """Return it at another chainage with the side slope required there.

        The depth is limited by these sides; returns None if it would be less than `MIN_HEIGHT`.
        """
        high, low = np.interp(np.array([x, x + self.width]), *site.profile.points.T).tolist()
        side = site.ditch_side(x, self.width)
        deepest = 0.5 * ((self.width - MIN_FLOOR) / side - abs(high - low))
        depth = min(self.depth, deepest)
        if depth < MIN_HEIGHT - LIMIT_ROUNDING:
            return None
        return msgspec.structs.replace(self, x=x, depth=depth, side_slope=side)

    @classmethod
    def catalogue(cls, zone: BarrierZone) -> Iterator[Self]:
        """Yield ditches of every depth and width that the zone permits."""
        for depth in CATALOGUE_DEPTHS:
            for width in CATALOGUE_WIDTHS:
                if depth <= zone.max_depth and zone.min_width <= width <= zone.max_width:
                    yield cls(zone.start, depth, width)

    @property
    def numbers(self) -> list[float]:
        """Its chainage, depth and width."""
        return [self.x, self.depth, self.width]

    @property
    def size(self) -> float:
        """Depth times width."""
        return self.depth * self.width

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its dimensions in words."""
        return f"{metres(self.depth)} deep, {metres(self.width)} wide"
