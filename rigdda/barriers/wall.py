"""A rigid retaining wall."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from rigdda.barriers.base import Floats, KnownSite, Standing


class Wall(Standing, frozen=True, tag="wall"):
    """A rigid retaining wall that stands on the terrain and cannot be moved.

    Parameters
    ----------
    x : float
        Chainage of its uphill face [m].
    height : float
        Height above the highest ground under it [m].
    thickness : float
        Extent downhill of `x` [m].

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    thickness: float = 1.0
    designed: ClassVar[bool] = False
    steepest: ClassVar[float | None] = 30.0

    def __post_init__(self) -> None:
        self._check("height", "thickness")

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the price at the height of the road, that of its concrete [EUR/m]."""
        return site.prices.concrete * self.height * self.thickness

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its sizes in words."""
        return f"{metres(self.height)} high, {metres(self.thickness)} thick"
