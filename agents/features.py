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
============  ===========================================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.envelope import STATIONS

AS_OBSERVED = (
    "energy", "bounce", "deposit", "source", "surfaces", "block", "damping", "limits", "prices",
    "weights",
)  # fmt: skip
TOE = 3
"""Index of the toe's chainage among the prices."""


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
    parts = [ground, descent, alone, *(seen[name] for name in AS_OBSERVED)]
    return np.concatenate(parts).astype(np.float32)
