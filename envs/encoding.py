"""Vectors in [-1, 1] that stand for layouts.

Three numbers a slot, one slot a barrier: station across the zone, height, thickness. Every vector
stands for a layout that can be built, so that an optimiser needs no constraints.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import isotonic_regression

from rigdda import BadInput, Layout, Wall, check
from rigdda.site import BarrierZone

Floats = NDArray[np.float64]

NUMBERS = 3
"""Numbers in a slot."""

MIN_HEIGHT = 0.5
"""A lower barrier is absent [m]."""

MIN_GAP = 2.0
"""Least distance between a barrier's downhill face and the next one's uphill face [m]."""

TOLERANCE = 1e-9
"""Rounding that is forgiven at the limits of the zone, so that decoding undoes encoding [m]."""


def vector(field: str, value: ArrayLike, size: int) -> Floats:
    """Return `value` as a vector of `size` numbers in [-1, 1], clipped.

    Raises
    ------
    BadInput
        If the shape is wrong or an entry is not a number; the message names `field`.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(field, value, f"give {size} numbers from -1 to 1") from None
    if array.shape != (size,):
        raise BadInput(f"shape of {field}", array.shape, f"give {size} numbers, shape ({size},)")
    bad = np.flatnonzero(np.isnan(array))
    if bad.size:
        raise BadInput(f"{field}[{bad[0]}]", float(array[bad[0]]), "give a number from -1 to 1")
    return np.clip(array, -1.0, 1.0)


def decode(zone: BarrierZone, values: Floats) -> Layout:
    """Return the layout that a vector stands for, sorted downhill.

    Parameters
    ----------
    zone : BarrierZone
        Where barriers may stand; at least as long as they may be thick.
    values : (3 n,) array
        n slots in [-1, 1]. Station: the wall's uphill face, from the zone's start to where the
        wall still stands inside the zone. Height: from 0 to the greatest; below `MIN_HEIGHT` the
        barrier is absent. Thickness: from the least to the greatest.

    Returns
    -------
    tuple of Wall
        At most n, `MIN_GAP` apart, whatever the order of the slots.
    """
    station, height, thickness = 0.5 * (values.reshape(-1, NUMBERS).T + 1.0)
    thickness = zone.min_thickness + thickness * (zone.max_thickness - zone.min_thickness)
    x = zone.start + station * (zone.end - thickness - zone.start)
    height = height * zone.max_height
    present = height >= MIN_HEIGHT - TOLERANCE
    walls = np.column_stack([x, np.maximum(height, MIN_HEIGHT), thickness])[present]
    return tuple(Wall(*wall) for wall in _spread(zone, walls).tolist())


def encode(zone: BarrierZone, layout: Sequence[Wall], slots: int) -> Floats:
    """Return a vector that `decode` turns into `layout`, empty slots last.

    Raises
    ------
    BadInput
        If the layout is not one that `decode` can give.
    """
    walls = sorted(check_layout(zone, layout), key=lambda wall: wall.x)
    if len(walls) > slots:
        raise BadInput("layout", f"{len(walls)} barriers", f"give at most {slots}")
    for i, wall in enumerate(walls):
        check.number(f"layout[{i}].height", wall.height, MIN_HEIGHT - TOLERANCE)
        if i and wall.x - walls[i - 1].x - walls[i - 1].thickness < MIN_GAP - TOLERANCE:
            mend = f"put it {MIN_GAP:g} m downhill of the barrier before it"
            raise BadInput(f"layout[{i}].x", wall.x, mend)
    out = np.tile([0.0, -1.0, 0.0], slots)
    for i, wall in enumerate(walls):
        share = (
            _share(wall.x, zone.start, zone.end - wall.thickness),
            wall.height / zone.max_height,
            _share(wall.thickness, zone.min_thickness, zone.max_thickness),
        )
        out[NUMBERS * i : NUMBERS * (i + 1)] = 2.0 * np.array(share) - 1.0
    return np.clip(out, -1.0, 1.0)


def check_layout(zone: BarrierZone, layout: Sequence[Wall]) -> Layout:
    """Return `layout` as a tuple if each barrier is inside the zone and its limits.

    Raises
    ------
    BadInput
        If one is not.
    """
    try:
        walls = tuple(layout)
    except TypeError:
        raise BadInput("layout", layout, "give a sequence of rigdda.Wall") from None
    for i, wall in enumerate(walls):
        if not isinstance(wall, Wall):
            raise BadInput(f"layout[{i}]", wall, "give a rigdda.Wall")
        limits = {
            "x": (zone.start, zone.end - wall.thickness),
            "height": (0.0, zone.max_height),
            "thickness": (zone.min_thickness, zone.max_thickness),
        }
        for name, (low, high) in limits.items():
            field = f"layout[{i}].{name}"
            check.number(field, getattr(wall, name), low - TOLERANCE, high + TOLERANCE)
    return walls


def _share(value: float, low: float, high: float) -> float:
    return (value - low) / (high - low) if high > low else 0.5


def _spread(zone: BarrierZone, walls: Floats) -> Floats:
    """Return walls, (n, 3) x, height, thickness, sorted by x and at least `MIN_GAP` apart.

    The lowest are dropped until the rest fits into the zone; the rest moves as little as possible,
    uphill and downhill alike (least squares, so continuous in x).
    """
    length = zone.end - zone.start
    walls = walls[np.lexsort(walls.T[::-1])]
    while walls[:, 2].sum() + MIN_GAP * (len(walls) - 1) > length + TOLERANCE:
        walls = np.delete(walls, np.argmin(walls[:, 1]), axis=0)
    taken = np.cumsum(walls[:, 2] + MIN_GAP)
    before = np.concatenate([[0.0], taken[:-1]])[: len(walls)]
    free = walls[:, 0] - before  # chainages once walls and gaps are taken out: must not fall
    if (np.diff(free) < 0.0).any():
        last = zone.end - (taken[-1] - MIN_GAP)
        walls[:, 0] = before + np.clip(isotonic_regression(free).x, zone.start, last)
    return walls
