"""The zone of a site in which barriers may stand, and how large they may be there."""

from __future__ import annotations

import msgspec

from rigdda import check


class BarrierZone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where barriers may stand, and how large they may be.

    Parameters
    ----------
    start : float
        Chainage where it begins [m]. No barrier stands in a band of loose rock within the zone.
    end : float
        Chainage where it ends, at the road at the latest [m].
    max_height : float
        Greatest height of all kinds but ditches [m].
    min_thickness : float
        Least thickness of walls, the width of an embankment's crest included [m].
    max_thickness : float
        Greatest of these [m].
    max_depth : float
        Greatest depth of ditches [m].
    min_width : float
        Least width of ditches [m].
    max_width : float
        Greatest width of ditches [m].

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    start: float
    end: float
    max_height: float = 5.0
    min_thickness: float = 0.5
    max_thickness: float = 2.0
    max_depth: float = 3.0
    min_width: float = 1.0
    max_width: float = 8.0

    def __post_init__(self) -> None:
        for name, low in (
            ("max_height", 0.5),
            ("min_thickness", 0.0),
            ("max_depth", 0.5),
            ("min_width", 0.0),
        ):
            check.number(f"barrier_zone.{name}", getattr(self, name), low, 100.0, open_low=True)
        for name, low in (("max_thickness", self.min_thickness), ("max_width", self.min_width)):
            check.number(f"barrier_zone.{name}", getattr(self, name), low, 100.0)
