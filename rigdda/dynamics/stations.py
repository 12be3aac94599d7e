"""Stations: chainages at which passages of blocks are recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.errors import BadInput


def chainages(stations: Sequence[float]) -> NDArray[np.float64]:
    """Return stations as an array.

    Raises
    ------
    BadInput
        If they are not finite numbers in ascending order.
    """
    try:
        lines = np.array([check.number("stations", x) for x in stations], dtype=np.float64)
    except TypeError:
        raise BadInput("stations", stations, "give a sequence of chainages") from None
    if (np.diff(lines) <= 0.0).any():
        raise BadInput("stations", lines.tolist(), "give them in ascending order")
    return lines
