"""Effect of ground parameters on whether rock reaches the road below a face and its talus."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rigdda import Site, Surface, release_many
from rigdda.envs.intervals import mid_p
from rigdda.ground.grounds import GROUNDS

SLOPE = Path(__file__).parent / "slope.toml"

SLOWED_AT = 9.144
"""Closing speed at which restitution has fallen to half (Pfeiffer and Bowen 1989) [m/s]."""

replace = msgspec.structs.replace


def variants() -> dict[str, Site]:
    """Return the slope with other grounds of the talus, and other properties of its ground."""
    site, found = Site.load(SLOPE), dict[str, Site]()

    def talus(surface: Surface) -> Site:
        return replace(site, surfaces=site.surfaces | {"talus": surface})

    ground = GROUNDS["coarse_talus"]
    found["talus as it is"] = site
    for field in ("rolling", "friction_deg", "restitution"):
        span = getattr(ground, field)
        for value in (span.low, span.high):
            named = Surface(ground="coarse_talus", **{field: value})
            found[f"talus: {field} {value:g}"] = talus(named)
    slowed = Surface(ground="coarse_talus", restitution_speed=SLOWED_AT)
    found[f"talus: restitution_speed {SLOWED_AT:g}"] = talus(slowed)
    for name in ("hard_rock", "fine_scree", "hard_soil", "meadow"):
        found[f"talus: {name}"] = talus(Surface(ground=name))
    return found


def rows(releases: int) -> list[dict[str, Any]]:
    """Return the probability that a boulder reaches the road for each variant.

    The 95 % intervals are included.
    """
    out = []
    for what, site in variants().items():
        outcomes = release_many([(site, (), seed, "boulder") for seed in range(releases)])
        reached = int(np.sum([outcome.reached for outcome in outcomes]))
        low, high = mid_p(reached, releases)
        out.append({"variant": what, "reach": reached / releases, "low": low, "high": high})
    return out


def moved(table: list[dict[str, Any]], head: str) -> float:
    """Return the range of the probability over variants whose names start with `head` [-]."""
    values = [row["reach"] for row in table if row["variant"].startswith(head)]
    return max(values) - min(values)
