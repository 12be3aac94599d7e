"""Rigid retaining wall."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar

from rigdda.barriers.base import Floats, KnownSite, Metres, Standing
from rigdda.fields import about, documented


@documented
class Wall(Standing, frozen=True, tag="wall"):
    """A rigid retaining wall that stands on the terrain and cannot move.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    thickness: Annotated[Metres, about("Extent downhill of `x`.", "m")] = 1.0
    designed: ClassVar[bool] = False
    steepest: ClassVar[float | None] = 30.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the cost of its concrete without the surcharge for height [EUR/m]."""
        return site.prices.concrete * self.height * self.thickness

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its dimensions in words."""
        return f"{metres(self.height)} high, {metres(self.thickness)} thick"
