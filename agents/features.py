"""What the policy's network sees of an observation: the slope as it lies under the barrier zone.

A barrier's station is a share of the zone, so that ground, energies and bounces are given at the
same stations across it, whatever the site.

============  ===========================================================================
entries       what
============  ===========================================================================
16            elevation of the ground above the road at equal steps across the zone [100 m]
16            its descent between neighbours over their distance (the first twice) [-]
16, 16        energy and bounce there, as observed
17            deposit, as observed
1, 1, 1       length of the zone [100 m]; way from its end to the road [10 m]; share of the zone
              that is uphill of the toe
5             source, as observed
7, 1, 2       surfaces, block and damping, as observed
8, 8, 2       limits, prices and weights, as observed
3             the engineering rule's fence, as far as what is observed tells it: a slot of the
              vector of a layout
============  ===========================================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.rule import FREEBOARD
from envs.envelope import STATIONS

AS_OBSERVED = (
    "energy", "bounce", "deposit", "source", "surfaces", "block", "damping", "limits", "prices",
    "weights",
)  # fmt: skip
TOE = 3
"""Index of the toe's chainage among the prices."""

WIDTH = 120
"""Number of features."""
RULE = slice(-3, None)
"""Where the rule's fence is among the features."""
ROUNDNESS = 0.75
"""Circumscribed radius of a block over the root of its area [-]: assumed, 0.71 for a square."""
MEAN_ENERGY = 0.35
"""Mean energy of the blocks that pass a station over the 95 % one [-]: assumed."""


def features(seen: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
    """Return the (F,) features of one observation of `BarrierDesign`."""
    start, end = (float(x) for x in seen["zone"])
    span, width = float(seen["span"][0]), float(seen["road"][0])
    stations = np.linspace(start, end, STATIONS)
    chainage = np.linspace(width - span, width, len(seen["profile"]))
    ground = np.interp(stations, chainage, seen["profile"])
    descent = -np.diff(ground, prepend=2.0 * ground[0] - ground[1]) / (stations[1] - stations[0])
    length = end - start
    uphill = (float(seen["prices"][TOE]) - start) / length
    alone = [length, -10.0 * end, np.clip(uphill, 0.0, 1.0)]
    parts = [ground, descent, alone, *(seen[name] for name in AS_OBSERVED), rule_slot(seen)]
    return np.concatenate(parts).astype(np.float32)


def rule_slot(seen: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """Return the fence of `agents.rule` as station, height and capacity, a (3,) slot in [-1, 1].

    It stands where the 95 % energy is least of the stations where it need not be too high. Its
    capacity is for all blocks that come to rest downhill of there.
    """
    size, area = 10.0 * float(seen["block"][0]), 100.0 * float(seen["source"][4])
    energy = 10.0 ** (10.0 * seen["energy"].astype(np.float64)) - 1.0
    radius = ROUNDNESS * size
    height = 100.0 * seen["bounce"] + radius + max(FREEBOARD, radius / 2.0)
    greatest = 10.0 * float(seen["limits"][0])
    crossed = energy > 0.0
    if not crossed.any():
        return np.array([0.0, -1.0, 0.0])
    low = crossed & (height <= greatest)
    k = int(np.argmin(np.where(low if low.any() else crossed, energy, np.inf)))
    share = k / (STATIONS - 1)
    start, end = (100.0 * float(x) for x in seen["zone"])
    span, width = 100.0 * float(seen["span"][0]), 100.0 * float(seen["road"][0])
    edges = np.linspace(width - span, width, len(seen["deposit"]))
    uphill = np.interp(start + share * (end - start), edges[1:], np.cumsum(seen["deposit"])[:-1])
    blocks = (1.0 - uphill) * area / size**2
    capacity = np.log10(max(MEAN_ENERGY * float(energy[k]) * blocks, 1.0)) / 10.0
    least, most = (float(x) for x in seen["limits"][-2:])
    wanted = share, float(height[k]) / greatest, (capacity - least) / max(most - least, 1e-6)
    return 2.0 * np.clip(wanted, 0.0, 1.0) - 1.0
