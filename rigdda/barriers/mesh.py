"""Mesh over a rock face, which holds rock in place and makes events rarer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec

from rigdda import fields
from rigdda.barriers.base import Barrier, Floats, KnownSite
from rigdda.fields import about, documented


@documented
class Mesh(Barrier, frozen=True, tag="mesh"):
    """Mesh over a rock face, one of the options of a site.

    It is not part of a scene: instead, it reduces the rates of events.

    Raises
    ------
    BadInput
        If a value is of the wrong type.
    """

    x: Annotated[
        float,
        about("Chainage of its middle. The height there above the road affects the price.", "m"),
    ]
    option: Annotated[str, about("Name of one of the mesh options of the site.")]

    @property
    def end(self) -> float:
        """Its chainage [m]; blocks are not affected by mesh."""
        return self.x

    @property
    def extent(self) -> float:
        """Length along the slope [m]: 0."""
        return 0.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the capital cost of its option without the surcharge for height [EUR/m]."""
        option = site.mesh(self.option)
        return option.area * option.price

    @property
    def label(self) -> str:
        """Kind and option in words."""
        return f"mesh: {self.option}"

    @property
    def label_and_place(self) -> str:
        """Kind and option in words: the option says where the mesh is."""
        return self.label

    def left_height(self, displacement: float) -> float:
        """Return 0: mesh has no height [m]."""
        return 0.0

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return the name of its option."""
        return self.option


Factor = Annotated[float, about(ge=0.0, le=1.0)]


@documented
class MeshOption(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A mesh that is available on a site.

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
        about("Factors by which it multiplies the rates of events, by name of the event.", "-"),
    ]

    def __post_init__(self) -> None:
        fields.check(self, f"meshes.{self.name}.")
