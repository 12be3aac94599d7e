"""The motion of the ground, as a history of its acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda.errors import BadInput


def history(value: ArrayLike) -> NDArray[np.float64]:
    """Return a history of ground acceleration as a read-only (m, 3) array."""
    try:
        history = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        history = np.zeros(0)
    if history.ndim != 2 or history.shape[1:] != (3,) or len(history) < 2:
        raise BadInput("base_motion", value, "give at least two rows (time, ax, ay)")
    if not np.isfinite(history).all():
        raise BadInput("base_motion", "NaN or infinity", "give finite numbers")
    if (np.diff(history[:, 0]) < 0.0).any() or history[0, 0] < 0.0:
        raise BadInput("base_motion", "times", "give times from 0 on that never fall")
    history.setflags(write=False)
    return history
