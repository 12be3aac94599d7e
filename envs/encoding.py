"""Vectors in [-1, 1] that stand for layouts.

One slot a barrier: station across the zone, height, size, and one score for each kind if there are
several; the largest wins, the first of equals. Every vector stands for a layout, so that an
optimiser needs no constraints.

============  ===================================  =============================================
kind          height                               size
============  ===================================  =============================================
wall          height, 0 to the greatest            thickness, least to greatest
gravity_wall  height, 0 to the greatest            thickness, least to greatest
fence         height, 0 to the greatest            capacity, least to greatest, logarithmic
ditch         depth, 0 to the greatest             width, least to greatest
embankment    height, 0 to the greatest            width of the crest, in the range of thickness
============  ===================================  =============================================
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import isotonic_regression

from rigdda import BadInput, Barrier, Layout, check
from rigdda.barriers import KINDS, as_layout
from rigdda.site import BarrierZone

Floats = NDArray[np.float64]

NUMBERS = 3
"""Numbers in a slot, without scores."""

MIN_HEIGHT = 0.5
"""A lower barrier, or a shallower ditch, is absent [m]."""

MIN_GAP = 2.0
"""Least distance between a barrier's downhill end and the next one's uphill face [m]."""

TOLERANCE = 1e-9
"""Rounding that is forgiven at the limits of the zone, so that decoding undoes encoding: share of
the limit, and of 1 [m or J]."""


class Decision(NamedTuple):
    """Which parameters of a kind are decided, and the fields of the zone that limit them."""

    height: str
    max_height: str
    size: str
    min_size: str
    max_size: str
    logarithmic: bool = False


DECISIONS = {
    "wall": Decision("height", "max_height", "thickness", "min_thickness", "max_thickness"),
    "gravity_wall": Decision("height", "max_height", "thickness", "min_thickness", "max_thickness"),
    "fence": Decision("height", "max_height", "capacity", "min_capacity", "max_capacity", True),
    "ditch": Decision("depth", "max_depth", "width", "min_width", "max_width"),
    "embankment": Decision("height", "max_height", "width", "min_thickness", "max_thickness"),
}


def slot_size(kinds: Sequence[str]) -> int:
    """Return the numbers in a slot for a choice of kinds."""
    return NUMBERS + (len(kinds) if len(kinds) > 1 else 0)


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


def decode(zone: BarrierZone, values: Floats, kinds: Sequence[str] = ("wall",)) -> Layout:
    """Return the layout that a vector stands for, sorted downhill.

    Parameters
    ----------
    zone : BarrierZone
        Where barriers may stand; at least as long as the longest of them.
    values : (slot_size n,) array
        n slots in [-1, 1]. Station: the barrier's uphill face, from the zone's start to where it
        still stands inside the zone. Height and size: see the module; below `MIN_HEIGHT` the
        barrier is absent.
    kinds : sequence of str
        Kinds to choose from, in the order of their scores.

    Returns
    -------
    tuple of Barrier
        At most n, `MIN_GAP` apart, whatever the order of the slots.
    """
    slots = values.reshape(-1, slot_size(kinds))
    found = []
    for slot in slots:
        kind = kinds[int(np.argmax(slot[NUMBERS:]))] if len(kinds) > 1 else kinds[0]
        station, height, size = (0.5 * (slot[:NUMBERS] + 1.0)).tolist()
        barrier = _make(zone, kind, station, height, size)
        if barrier is not None:
            found.append(barrier)
    return _spread(zone, found)


def _make(
    zone: BarrierZone, kind: str, station: float, height: float, size: float
) -> Barrier | None:
    """Return the barrier of three shares from 0 to 1, None if it is absent."""
    decision = DECISIONS[kind]
    tall = height * getattr(zone, decision.max_height)
    if tall < MIN_HEIGHT - TOLERANCE:
        return None
    low, high = getattr(zone, decision.min_size), getattr(zone, decision.max_size)
    large = low * (high / low) ** size if decision.logarithmic else low + size * (high - low)
    values = {decision.height: max(tall, MIN_HEIGHT), decision.size: large}
    barrier = KINDS[kind](x=zone.start, **values)
    x = zone.start + station * (zone.end - barrier.extent - zone.start)
    return msgspec.structs.replace(barrier, x=x)


def encode(
    zone: BarrierZone, layout: Sequence[Barrier], slots: int, kinds: Sequence[str] = ("wall",)
) -> Floats:
    """Return a vector that `decode` turns into `layout`, empty slots last.

    Raises
    ------
    BadInput
        If the layout is not one that `decode` can give.
    """
    barriers = sorted(check_layout(zone, layout), key=lambda barrier: barrier.x)
    if len(barriers) > slots:
        raise BadInput("layout", f"{len(barriers)} barriers", f"give at most {slots}")
    out = np.tile([0.0, -1.0, 0.0] + [0.0] * (slot_size(kinds) - NUMBERS), (slots, 1))
    for i, barrier in enumerate(barriers):
        decision = DECISIONS[check.one_of(f"layout[{i}].kind", barrier.kind, kinds)]
        tall, size = getattr(barrier, decision.height), getattr(barrier, decision.size)
        check.number(f"layout[{i}].{decision.height}", tall, MIN_HEIGHT - TOLERANCE)
        _check_rest(i, barrier, decision)
        before = barriers[i - 1]
        if i and barrier.x - before.x - before.extent < MIN_GAP - TOLERANCE:
            mend = f"put it {MIN_GAP:g} m downhill of the barrier before it"
            raise BadInput(f"layout[{i}].x", barrier.x, mend)
        low, high = getattr(zone, decision.min_size), getattr(zone, decision.max_size)
        if decision.logarithmic:
            size, low, high = np.log(size), np.log(low), np.log(high)
        shares = (
            _share(barrier.x, zone.start, zone.end - barrier.extent),
            tall / getattr(zone, decision.max_height),
            _share(size, low, high),
        )
        out[i, :NUMBERS] = 2.0 * np.array(shares) - 1.0
        if len(kinds) > 1:
            out[i, NUMBERS:] = [1.0 if kind == barrier.kind else -1.0 for kind in kinds]
    return np.clip(out.ravel(), -1.0, 1.0)


def _check_rest(i: int, barrier: Barrier, decision: Decision) -> None:
    """Check that what is not decided has its default."""
    defaults = barrier.__struct_defaults__  # of the last fields
    for name, default in zip(barrier.__struct_fields__[-len(defaults) :], defaults, strict=True):
        if name in ("x", decision.height, decision.size):
            continue
        value = getattr(barrier, name)
        if value != default:
            raise BadInput(f"layout[{i}].{name}", value, f"leave it at {default:g}")


def check_layout(zone: BarrierZone, layout: Sequence[Barrier]) -> Layout:
    """Return `layout` as a tuple if each barrier is inside the zone and its limits.

    Raises
    ------
    BadInput
        If one is not.
    """
    barriers = as_layout(layout)
    for i, barrier in enumerate(barriers):
        decision = DECISIONS[barrier.kind]
        limits = {
            "x": (zone.start, zone.end - barrier.extent),
            decision.height: (0.0, getattr(zone, decision.max_height)),
            decision.size: (getattr(zone, decision.min_size), getattr(zone, decision.max_size)),
        }
        for name, (low, high) in limits.items():
            low, high = low - TOLERANCE * max(1.0, low), high + TOLERANCE * max(1.0, high)
            check.number(f"layout[{i}].{name}", getattr(barrier, name), low, high)
    return barriers


def longest(zone: BarrierZone, kinds: Sequence[str]) -> float:
    """Return the greatest length along the slope of a barrier that a vector may stand for [m]."""
    largest = [_make(zone, kind, 0.0, 1.0, 1.0) for kind in kinds]
    return max(barrier.extent for barrier in largest if barrier is not None)


def _share(value: float, low: float, high: float) -> float:
    return (value - low) / (high - low) if high > low else 0.5


def _spread(zone: BarrierZone, barriers: Sequence[Barrier]) -> Layout:
    """Return barriers sorted by x and at least `MIN_GAP` apart.

    The lowest are dropped until the rest fits into the zone; the rest moves as little as possible,
    uphill and downhill alike (least squares, so continuous in x).
    """
    length = zone.end - zone.start
    rest = sorted(barriers, key=lambda b: (b.x, _height(b), b.extent, b.kind))
    while sum(b.extent for b in rest) + MIN_GAP * (len(rest) - 1) > length + TOLERANCE:
        rest.remove(min(rest, key=_height))
    if not rest:
        return ()
    taken = np.cumsum([b.extent + MIN_GAP for b in rest])
    before = np.concatenate([[0.0], taken[:-1]])
    free = np.array([b.x for b in rest]) - before  # barriers and gaps taken out: must not fall
    if (np.diff(free) < 0.0).any():
        last = zone.end - (taken[-1] - MIN_GAP)
        x = before + np.clip(isotonic_regression(free).x, zone.start, last)
        rest = [msgspec.structs.replace(b, x=at) for b, at in zip(rest, x.tolist(), strict=True)]
    return tuple(rest)


def _height(barrier: Barrier) -> float:
    """Return the height of a barrier, or the depth of a ditch [m]."""
    return float(getattr(barrier, DECISIONS[barrier.kind].height))
