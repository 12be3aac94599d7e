"""Mesh over the face: it holds rock where it is, so that events are rarer."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from rigdda import check
from rigdda.barriers.base import Barrier, Floats, KnownSite
from rigdda.errors import BadInput


class Mesh(Barrier, frozen=True, tag="mesh"):
    """Mesh, one of a site's options. It is not part of a scene: it changes how often rock falls.

    Parameters
    ----------
    x : float
        Chainage of its middle [m]: the higher above the road, the dearer.
    option : str
        Name of an option of the site.

    Raises
    ------
    BadInput
        If `x` is not finite or `option` is no text.
    """

    option: str

    def __post_init__(self) -> None:
        self._check()
        if not isinstance(self.option, str):
            raise BadInput("mesh option", self.option, "name a mesh option of the site")

    @property
    def end(self) -> float:
        """Its chainage [m]; nothing passes it, nor stands in its way."""
        return self.x

    @property
    def extent(self) -> float:
        """Length that it takes up among barriers on the slope [m]: none."""
        return 0.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the price at the height of the road, of its option [EUR/m]."""
        option = site.mesh(self.option)
        return option.area * option.price

    @property
    def label(self) -> str:
        """Kind and option in words."""
        return f"mesh: {self.option}"

    def left_height(self, displacement: float) -> float:
        """Return 0: it has none [m]."""
        return 0.0

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its sizes in words."""
        return self.option


class MeshOption(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A mesh that a site offers.

    Parameters
    ----------
    name : str
        Its name in layouts.
    area : float
        Area of mesh per metre of road [m2/m].
    price : float
        Price [EUR/m2].
    factors : table
        Factor on the rate of each event that it changes, by the event's name [-], 0 to 1.

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    name: str
    area: float
    price: float
    factors: dict[str, float]

    def __post_init__(self) -> None:
        where = f"meshes.{self.name}"
        check.number(f"{where}.area", self.area, 0.0, 1000.0, open_low=True)
        check.number(f"{where}.price", self.price, 0.0, 10_000.0)
        if not isinstance(self.factors, dict):
            raise BadInput(f"{where}.factors", self.factors, "give a table of events and factors")
        for event, factor in self.factors.items():
            check.number(f"{where}.factors.{event}", factor, 0.0, 1.0)
