"""Removal of a barrier that stands already."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar

from rigdda.barriers.base import Barrier, Floats, KnownSite
from rigdda.fields import about, documented


@documented
class Removal(Barrier, frozen=True, tag="removal"):
    """Removal of an existing barrier of the site, see `[[existing]]`.

    A removal adds no body to a scene. The scene is built without the barrier that it removes.

    Raises
    ------
    BadInput
        If a value is of the wrong type.
    """

    x: Annotated[float, about("Chainage `x` of the existing barrier that is removed.", "m")]
    designed: ClassVar[bool] = False
    upkeep: ClassVar[float] = 0.0

    @property
    def end(self) -> float:
        """Its chainage [m]; blocks are not affected by it."""
        return self.x

    @property
    def extent(self) -> float:
        """Length along the slope [m]: 0."""
        return 0.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the cost of the removal [EUR per metre of road]."""
        return site.removal_price(self.x)

    @property
    def label(self) -> str:
        """What is done, in words."""
        return "removal of the existing barrier"

    def left_height(self, displacement: float) -> float:
        """Return 0: nothing stands [m]."""
        return 0.0

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return what is removed in words."""
        return "the existing barrier there"
