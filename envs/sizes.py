"""How large barriers that are designed may be."""

from __future__ import annotations

from rigdda import Barrier, Ditch, Embankment, Fence
from rigdda.model.place import BarrierZone

MIN_HEIGHT = 0.5
"""Least height of a barrier that is designed, and depth of a ditch [m]."""

SLENDER = 0.4
"""Least thickness over height of a gravity wall [-]: it stands by its weight, also in the wind and
on ground that gives."""

TOLERANCE = 1e-9
"""Rounding that is forgiven at limits: share of the limit, and of 1 [m]."""


def limits(zone: BarrierZone, barrier: Barrier) -> dict[str, tuple[float, float]]:
    """Return the fields of a barrier that the zone limits, with least and greatest value [m]."""
    if isinstance(barrier, Ditch):
        return {"depth": (0.0, zone.max_depth), "width": (zone.min_width, zone.max_width)}
    own: dict[str, tuple[float, float]] = {"height": (0.0, zone.max_height)}
    if isinstance(barrier, Embankment):
        return own | {"width": (zone.min_thickness, zone.max_thickness)}
    if isinstance(barrier, Fence):
        return own
    return own | {"thickness": (zone.min_thickness, zone.max_thickness)}
