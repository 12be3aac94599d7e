"""Tables of a site: road, where barriers may stand, how releases move and vary."""

from __future__ import annotations

import msgspec

from rigdda import check
from rigdda.model.settings import LARGEST_DT, SHORTEST_DT, USUAL_DT

DURATION = (1.0, 3600.0)
"""Least and greatest `motion.duration` [s]: in less than a second hardly a block reaches a road."""


class Road(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The road.

    Parameters
    ----------
    start : float
        Chainage of its uphill edge [m].
    end : float
        Chainage of its downhill edge [m].
    """

    start: float
    end: float


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


class Motion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How releases are computed.

    Parameters
    ----------
    damping : float or None
        Mass-proportional damping [1/s] of surfaces that have none of their own. None: that of the
        ground that the name of the surface suggests, with a notice.
    damping_when : str
        "contact": of blocks that touch something, or did within 0.1 s; "always": the paper's, in
        flight, too, with which energies at a barrier are four to ten times too low.
    duration : float
        Longest simulated time [s].
    dt : float
        Time step [s], of small blocks the longest whole part of it that suits their size.

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    damping: float | None = None
    damping_when: str = "contact"
    duration: float = 25.0
    dt: float = USUAL_DT

    def __post_init__(self) -> None:
        if self.damping is not None:
            check.number("motion.damping", self.damping, 0.0, 100.0)
        check.one_of("motion.damping_when", self.damping_when, ("always", "contact"))
        check.number("motion.duration", self.duration, *DURATION)
        check.number("motion.dt", self.dt, SHORTEST_DT, LARGEST_DT)


class Rebound(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a point of the lumped-mass model rebounds from a surface, see `rigdda.lumped`.

    Parameters
    ----------
    normal : float
        Normal coefficient of restitution [-].
    tangential : float
        Tangential coefficient of restitution [-]: the share of its speed along the ground that a
        point keeps in an impact.
    friction_deg : float
        Friction angle at which it slides on, or rolls, when it no longer bounces [deg].

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    normal: float = 0.35
    tangential: float = 0.85
    friction_deg: float = 30.0

    def __post_init__(self) -> None:
        check.number("normal", self.normal, 0.0, 1.0)
        check.number("tangential", self.tangential, 0.0, 1.0)
        check.number("friction_deg", self.friction_deg, 0.0, 80.0)


class Scatter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What varies at random from release to release, beside the blocks.

    Parameters
    ----------
    friction_deg : float
        Standard deviation of the friction angles, all surfaces together [deg].

    Raises
    ------
    BadInput
        If it is outside its range.
    """

    friction_deg: float = 0.0

    def __post_init__(self) -> None:
        check.number("scatter.friction_deg", self.friction_deg, 0.0, 10.0)
