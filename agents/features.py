"""What the policy's network sees of an observation: all of the site, and not what stands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda.envs.observation import FIELDS

NAMES = tuple(name for name in FIELDS if name not in ("layout", "spent"))
"""Arrays of an observation, in the order in which they are put together."""

WIDTH = sum(FIELDS[name].size for name in NAMES)
"""Number of features."""


def features(seen: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
    """Return the (WIDTH,) features of one observation of `BarrierDesign`."""
    return np.concatenate([seen[name] for name in NAMES]).astype(np.float32)
