"""Barrier zone of a site, with limits of the sizes of barriers."""

from __future__ import annotations

from typing import Annotated

import msgspec

from rigdda import check, fields
from rigdda.fields import about, documented


@documented
class BarrierZone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The zone in which barriers may stand, and limits of their sizes.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, or a greatest size is less than the
        least.
    """

    start: Annotated[
        float,
        about(
            "Chainage where the zone begins. Barriers may not stand in a band of loose rock, even "
            "within the zone.",
            "m",
        ),
    ]
    end: Annotated[
        float, about("Chainage where the zone ends, at most the uphill edge of the road.", "m")
    ]
    max_height: Annotated[
        float, about("Greatest height of all barriers except ditches.", "m", gt=0.5, le=100.0)
    ] = 5.0
    min_thickness: Annotated[
        float,
        about(
            "Least thickness of walls and least width of the crest of embankments.",
            "m",
            gt=0.0,
            le=100.0,
        ),
    ] = 0.5
    max_thickness: Annotated[
        float,
        about(
            "Greatest thickness of walls and greatest width of the crest of embankments.",
            "m",
            gt=0.0,
            le=100.0,
        ),
    ] = 2.0
    max_depth: Annotated[float, about("Greatest depth of ditches.", "m", gt=0.5, le=100.0)] = 3.0
    min_width: Annotated[float, about("Least width of ditches.", "m", gt=0.0, le=100.0)] = 1.0
    max_width: Annotated[float, about("Greatest width of ditches.", "m", gt=0.0, le=100.0)] = 8.0

    def __post_init__(self) -> None:
        fields.check(self, "barrier_zone.")
        for size in ("thickness", "width"):
            least, most = getattr(self, f"min_{size}"), getattr(self, f"max_{size}")
            check.number(f"barrier_zone.max_{size}", most, least, 100.0)
