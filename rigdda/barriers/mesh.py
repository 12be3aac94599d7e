"""Mesh over the face: it holds rock where it is, so that events are rarer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec

from rigdda import fields
from rigdda.barriers.base import Barrier, Floats, KnownSite
from rigdda.fields import about, documented


@documented
class Mesh(Barrier, frozen=True, tag="mesh"):
    """Mesh, one of a site's options. It is not part of a scene: it changes how often rock falls.

    Raises
    ------
    BadInput
        If a value is of the wrong type.
    """

    x: Annotated[
        float, about("Chainage of its middle, whose height above the road sets the price.", "m")
    ]
    option: Annotated[str, about("Name of one of the meshes of the site.")]

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


Factor = Annotated[float, about(ge=0.0, le=1.0)]


@documented
class MeshOption(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A mesh that a site offers.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    name: Annotated[str, about("Name of the mesh, to which layouts refer.")]
    area: Annotated[float, about("Area of mesh per metre of road.", "m2/m", gt=0.0, le=1000.0)]
    price: Annotated[float, about("Price of the mesh.", "EUR/m2", ge=0.0, le=10_000.0)]
    factors: Annotated[
        dict[str, Factor],
        about("Factor on the rate of each event that it makes rarer, by the event's name.", "-"),
    ]

    def __post_init__(self) -> None:
        fields.check(self, f"meshes.{self.name}.")
