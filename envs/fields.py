"""The arrays of an observation: sizes, scales and what is in them."""

from __future__ import annotations

from typing import NamedTuple

from rigdda.envs.envelope import BINS, STATIONS

PROFILE_POINTS = 16
BOUND = 10.0
"""Bounds of all arrays but `layout`, in spreads."""


class Field(NamedTuple):
    """An array: its size, 0 for that of a layout's vector; centre and spread; what is in it."""

    size: int
    centre: float
    spread: float
    entries: str


FIELDS: dict[str, Field] = {
    "profile": Field(
        PROFILE_POINTS, 1.5, 0.9,
        "elevation above the road's uphill edge at equal steps from the crest to it: "
        "asinh(y / 10 m)",
    ),
    "span": Field(1, 1.6, 0.35, "log10 of the way from the crest to the road [m]"),
    "zone": Field(
        2, 0.3, 1.0, "log10 of the way from the zone's start and from its end to the road [m]"
    ),
    "incline": Field(STATIONS, 0.6, 0.5, "inclination of the ground across the zone [rad]"),
    "ground": Field(
        4, 0.45, 0.2, "tan of the friction angle and restitution at the zone's start and at its end"
    ),
    "road": Field(1, 0.92, 0.06, "log10 of the width of the road [m]"),
    "closure": Field(1, 4.75, 0.12, "log10 of the cost of a day of closure [EUR]"),
    "nothing": Field(1, 2.7, 0.25, "log10 of Z without barriers [EUR per metre and year]"),
    "groups": Field(1, 0.3, 0.2, "share of groups in Z without barriers"),
    "rates": Field(
        2, -0.2, 0.7, "log10 of how often single blocks and groups fall [1/year per 100 m]"
    ),
    "often": Field(
        2 * STATIONS, -0.2, 0.6,
        "how often single blocks, then groups, pass the stations: "
        "log10(0.001 + [1/year per 100 m])",
    ),
    "energy": Field(
        2 * STATIONS, 5.4, 0.9, "95 % energy of the blocks that pass there: log10(1 + E / J)"
    ),
    "bounce": Field(
        2 * STATIONS, 0.8, 0.4, "95 % height of their centroids: log10(0.1 + [m])"
    ),
    "deposit": Field(
        BINS + 2, 0.2, 0.2,
        "root of the share of a year's rock that ends uphill of the zone, in equal parts from its "
        "start to the road's downhill edge, and beyond",
    ),
    "prices": Field(
        3, -1.2, 0.6,
        "log10 of what a fence of 1,000 kJ and 3 m, 10 m3 of embankment and 10 m3 of ditch cost a "
        "year over Z without barriers",
    ),
    "mesh": Field(
        2, 0.15, 0.3,
        "greatest share of Z without barriers that an option of mesh takes off, and what that one "
        "costs a year over Z",
    ),
    "spent": Field(1, 0.0, 0.5, "what stands costs a year, over Z without barriers"),
    "layout": Field(0, 0.0, 1.0, "what stands, encoded as the actions of an episode"),
}  # fmt: skip
"""What is seen before a whole layout is designed, and when barriers are placed one by one."""

LOOKED: dict[str, Field] = {
    "harm_now": Field(1, 0.5, 0.5, "harm and repair of what stands over Z without barriers"),
    "reached_now": Field(2, 0.5, 0.5, "share of single blocks, and of groups, that reach the road"),
    "taken": Field(-1, 3.0, 3.0, "greatest energy at each barrier, downhill: log10(1 + E / J)"),
    "topped": Field(-1, 0.0, 0.5, "share of releases in which a block passes over each barrier"),
    "broken": Field(-1, 0.0, 0.5, "share of releases in which each barrier fails"),
    "slots_left": Field(1, 0.5, 0.5, "share of the slots that may still be filled"),
}
"""What is seen as well when barriers are placed one by one. A size of -1 is one entry a slot."""
