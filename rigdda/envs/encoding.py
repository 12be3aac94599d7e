"""Encoding of layouts as vectors in [-1, 1].

A vector has one slot per barrier: presence (a barrier exists if it is above 0), station across the
zone, height, size and, if there are several kinds, one score per kind. The kind with the largest
score is chosen; ties go to the first. Every vector decodes to a feasible layout, so optimisers need
no constraints. A barrier that is not feasible at its station moves to the nearest feasible place,
or is dropped if there is none. Barriers of earlier slots take precedence and keep their places. A
barrier that would exceed the largest capital cost of the problem is dropped.

============  ===================================  =============================================
kind          height                               size
============  ===================================  =============================================
fence         height, up to that of its class      energy class, equal parts of the range
ditch         depth, up to what its sides allow    width, least to greatest
embankment    height                               width of the crest, in the range of thickness
gravity_wall  height, up to what thickness allows  thickness, at least 0.4 times the height
wall          height                               thickness, least to greatest
mesh          not used, nor is the station         option of the site, equal parts of the range
removal       not used, nor is the station         removable barrier, equal parts of the range
============  ===================================  =============================================

Heights and depths range from 0.5 m to the maximum of the zone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Mesh
from rigdda.barriers import KINDS, Removal
from rigdda.barriers.base import LIMIT_ROUNDING, MIN_HEIGHT, Span, share_of
from rigdda.envs.siting import FeasiblePlaces
from rigdda.ground.barrier_zone import BarrierZone

Floats = NDArray[np.float64]

SLOT_NUMBERS = 4
"""Length of a slot without the scores of the kinds."""


def slot_size(kinds: Sequence[str]) -> int:
    """Return the length of a slot for a choice of kinds."""
    return SLOT_NUMBERS + (len(kinds) if len(kinds) > 1 else 0)


def vector(field: str, value: ArrayLike, size: int) -> Floats:
    """Return `value` as a float vector of length `size`, clipped to [-1, 1].

    Raises
    ------
    BadInput
        If the shape is wrong or an entry is not a finite number; the message names `field`.
    """
    try:
        array = np.asarray(value)
        if np.iscomplexobj(array):
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(field, value, f"give {size} numbers from -1 to 1") from None
    if array.shape != (size,):
        raise BadInput(f"shape of {field}", array.shape, f"give {size} numbers, shape ({size},)")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise BadInput(f"{field}[{bad[0]}]", float(array[bad[0]]), "give a number from -1 to 1")
    return np.clip(array, -1.0, 1.0)


def decode(place: FeasiblePlaces, values: Floats, kinds: Sequence[str]) -> Layout:
    """Return the layout encoded by a vector, sorted downhill.

    Parameters
    ----------
    place : FeasiblePlaces
        Finds feasible places on the site.
    values : (slot_size n,) array
        n slots in [-1, 1]; see the module docstring.
    kinds : sequence of str
        Kinds to choose from, in the order of their scores.

    Returns
    -------
    tuple of Barrier
        At most n barriers, each feasible where it stands.
    """
    built, _ = built_and_dropped(place, values, kinds)
    return tuple(sorted(built, key=lambda barrier: barrier.x))


def built_and_dropped(
    place: FeasiblePlaces, values: Floats, kinds: Sequence[str]
) -> tuple[list[Barrier], list[str]]:
    """Return the barriers that `decode` builds, and the dropped ones, each with the reason."""
    built: list[Barrier] = []
    dropped: list[str] = []
    taken: list[Span] = []
    for number, slot in enumerate(values.reshape(-1, slot_size(kinds))):
        if slot[0] <= 0.0:
            continue
        kind = kinds[int(np.argmax(slot[SLOT_NUMBERS:]))] if len(kinds) > 1 else kinds[0]
        station, height, size = (0.5 * (slot[1:SLOT_NUMBERS] + 1.0)).tolist()
        if kind == "mesh":
            if any(isinstance(barrier, Mesh) for barrier in built):
                dropped.append(f"slot {number}: mesh: an earlier slot already has a mesh")
                continue
            barrier: Barrier = place.mesh(_part(size, len(place.site.meshes)))
            room: list[Span] = []
        elif kind == "removal":
            barrier, room = place.removals[_part(size, len(place.removals))], []
            if barrier in built:
                dropped.append(f"slot {number}: removal: an earlier slot already removes it")
                continue
        else:
            found = place.nearest(make(place.zone, kind, station, height, size), taken)
            if found is None:
                dropped.append(f"slot {number}: {kind}: no feasible place for it in the zone")
                continue
            barrier, room = found[0], [found[1]]
        excess = place.too_expensive([*built, barrier])
        if excess is not None:
            dropped.append(f"slot {number}: {kind}: the layout would cost {', '.join(excess)}")
            continue
        built.append(barrier)
        taken += room
    return built, dropped


def make(zone: BarrierZone, kind: str, station: float, height: float, size: float) -> Barrier:
    """Return the barrier for three shares from 0 to 1 without checking its place; not for mesh."""
    x = zone.start + station * (zone.end - zone.start)
    return KINDS[kind].of_shares(zone, x, height, size)


def encode(place: FeasiblePlaces, layout: Layout, slots: int, kinds: Sequence[str]) -> Floats:
    """Return a vector that `decode` turns into `layout`; empty slots come last.

    Parameters
    ----------
    place : FeasiblePlaces
        Finds feasible places on the site.
    layout : tuple of Barrier
        Feasible barriers of the given kinds, at most `slots`.
    slots : int
        Number of slots.
    kinds : sequence of str
        Kinds to choose from, in the order of their scores.

    Raises
    ------
    BadInput
        If a field that is not encoded differs from the value that `decode` assigns, or a height is
        below the minimum.
    """
    out = np.full((slots, slot_size(kinds)), -1.0)
    for i, barrier in enumerate(layout):
        out[i, 0] = 1.0
        out[i, 1:SLOT_NUMBERS] = _numbers(place, i, barrier)
        if len(kinds) > 1:
            out[i, SLOT_NUMBERS + list(kinds).index(barrier.kind)] = 1.0
    return np.clip(out.ravel(), -1.0, 1.0)


def _numbers(place: FeasiblePlaces, i: int, barrier: Barrier) -> list[float]:
    """Return the station, height and size of a barrier, each from -1 to 1."""
    zone = place.zone
    if isinstance(barrier, Mesh):
        names = [option.name for option in place.site.meshes]
        usual: Barrier = place.mesh(names.index(barrier.option))
        shares = (0.5, 0.0, _middle(names.index(barrier.option), len(names)))
    elif isinstance(barrier, Removal):
        usual = barrier
        shares = (0.5, 0.0, _middle(place.removals.index(barrier), len(place.removals)))
    else:
        shares = (share_of(barrier.x, zone.start, zone.end), *barrier.shares(zone))
        tall = getattr(barrier, barrier.lengths[0].field)
        if tall < MIN_HEIGHT - LIMIT_ROUNDING:
            hint = f"give a number of at least {MIN_HEIGHT:g}"
            raise BadInput(f"layout[{i}].{barrier.lengths[0].field}", tall, hint)
        clipped = np.clip(shares, 0.0, 1.0).tolist()
        usual = place.put(make(zone, barrier.kind, *clipped), barrier.x) or barrier
    _check_usual(f"layout[{i}]", barrier, usual)
    return [2.0 * share - 1.0 for share in shares]


def _check_usual(where: str, barrier: Barrier, usual: Barrier) -> None:
    """Check that a barrier equals the one that its encoded numbers decode to."""
    for name in barrier.__struct_fields__:
        value, decided = getattr(barrier, name), getattr(usual, name)
        if value == decided:
            continue
        if isinstance(value, float) and isinstance(decided, float):
            if abs(value - decided) <= 1e-6 * max(1.0, abs(decided)):
                continue
        raise BadInput(
            f"{where}.{name}", value, f"give {decided!r}: no vector encodes another value"
        )


def _part(share: float, parts: int) -> int:
    """Return the index of the equal part of [0, 1] that contains a share."""
    return min(int(share * parts), parts - 1)


def _middle(part: int, parts: int) -> float:
    return (part + 0.5) / parts
