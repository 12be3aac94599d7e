"""What comes down a slope, and how often."""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec

from rigdda import check
from rigdda.errors import BadInput
from rigdda.model.block import Block
from rigdda.model.roughness import Roughness
from rigdda.model.source import Source

MASS_WIDTH = 10.0
"""Width of an event of a jointed mass or of given blocks that names none [m]."""

MOST_OFTEN = 1000.0
"""Greatest rate [1/year per 100 m]: three blocks a day are no rare event but a talus at work."""

LARGEST_AREA, WIDEST = 1000.0, 1000.0
"""Greatest area of a block [m2] and width of an event [m]."""


class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What comes down, and how often.

    Parameters
    ----------
    name : str
        Its name.
    rate : float
        How often it happens [1/year per 100 m of slope].
    source : str
        Name of the source that it comes from.
    area : (least, greatest)
        Area of each block of a band [m2], of one without `edges`.
    exponent : float
        The number of blocks larger than a volume V falls as V to the power of minus this [-],
        within `area`: 0.4 to 0.8 as a rule.
    number : (least, most)
        Number of blocks of a band, each number as likely.
    width : float
        Its width along the road [m]. Of a single block by default the root of its area, of a mass
        10 m.
    design : bool
        Whether it is a design event, for which targets are set.

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    name: str
    rate: float
    source: str = "rock"
    area: tuple[float, float] | None = None
    exponent: float = 0.6
    number: tuple[int, int] = (1, 1)
    width: float | None = None
    design: bool = False

    def __post_init__(self) -> None:
        where = self.words
        check.number(f"{where}.rate", self.rate, 0.0, MOST_OFTEN)
        check.number(f"{where}.exponent", self.exponent, 0.0, 5.0)
        if self.area is not None:
            check.interval(f"{where}.area", self.area, 1e-4, LARGEST_AREA)
        check.interval(f"{where}.number", self.number)
        for count in self.number:
            check.integer(f"{where}.number", count, 1, 1000)
        if self.width is not None:
            check.number(f"{where}.width", self.width, 0.0, WIDEST, open_low=True)
        if not isinstance(self.design, bool):
            raise BadInput(f"{where}.design", self.design, "give true or false")

    @property
    def words(self) -> str:
        """What errors call it."""
        return f"events.{self.name}"

    def check_source(self, source: Source) -> None:
        """Check that it says of its source what that needs, and nothing else.

        Raises
        ------
        BadInput
            If a band has no area of blocks, or a group no width, or a mass has either.
        """
        if source.band is None:
            if self.area is not None or self.number != (1, 1):
                what = "number" if self.area is None else "area"
                mend = f"leave it out: source {source.name} is no band, its blocks are given"
                raise BadInput(f"{self.words}.{what}", getattr(self, what), mend)
        elif source.edges is not None:
            if self.area is not None:
                mend = f"leave it out: source {source.name} says it by its edges"
                raise BadInput(f"{self.words}.area", self.area, mend)
        elif self.area is None:
            mend = f"give the least and the greatest area of a block of band {source.name} [m2]"
            raise BadInput(f"{self.words}.area", None, mend)
        if source.band is not None and self.number[1] > 1 and self.width is None:
            mend = "give the width along the road of an event of several blocks [m]"
            raise BadInput(f"{self.words}.width", None, mend)

    def block_size(self, source: Source) -> float:
        """Return the typical size of its blocks, which come from `source` [m]."""
        if source.edges is not None:
            return math.prod(source.edges) ** (1.0 / 3.0)
        if self.area is not None:
            return math.prod(self.area) ** 0.25
        return math.sqrt(source.mean_block_area)

    def width_of(self, areas: list[float]) -> float:
        """Return the width of a release with blocks of these areas [m]."""
        if self.width is not None:
            return self.width
        return math.sqrt(areas[0]) if areas else MASS_WIDTH


class Drawn(NamedTuple):
    """What a seed draws of an event, the same for every layout."""

    event: str
    """Its name."""
    blocks: tuple[Block, ...]
    width: float
    """Along the road [m]."""
    friction_deg: float
    """Shift of all friction angles [deg]."""
    strengths: tuple[tuple[float, float, float], ...] = ()
    """Standard normal numbers of friction, restitution and damping, for each surface of the site in
    turn; empty where no surface varies."""
    roughness: Roughness | None = None
    """Pits in the ground; None where it is smooth."""
