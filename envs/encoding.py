"""Vectors in [-1, 1] that stand for layouts.

One slot a barrier: presence (above 0: there is one), station across the zone, height, size, and one
score for each kind if there are several; the largest wins, the first of equals. Every vector stands
for a layout that may be built, so that an optimiser needs no constraints. A barrier that may not
stand where its slot says moves to the nearest place where it may, and is absent if there is none;
those of earlier slots stay where they are.

============  ===================================  =============================================
kind          height                               size
============  ===================================  =============================================
fence         height, up to that of its class      energy class, equal parts of the range
ditch         depth, up to what its sides allow    width, least to greatest
embankment    height                               width of the crest, in the range of thickness
gravity_wall  height, up to what thickness allows  thickness, at least 0.4 times the height
wall          height                               thickness, least to greatest
mesh          not used, nor is the station         option of the site, equal parts of the range
============  ===================================  =============================================

Heights and depths run from 0.5 m to the greatest of the zone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Mesh
from rigdda.barriers import KINDS
from rigdda.barriers.base import MIN_HEIGHT, TOLERANCE, share_of
from rigdda.envs.siting import Room, Span
from rigdda.model.barrier_zone import BarrierZone

Floats = NDArray[np.float64]

NUMBERS = 4
"""Numbers in a slot, without scores."""


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
        array = np.asarray(value)
        if np.iscomplexobj(array):
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError):
        raise BadInput(field, value, f"give {size} numbers from -1 to 1") from None
    if array.shape != (size,):
        raise BadInput(f"shape of {field}", array.shape, f"give {size} numbers, shape ({size},)")
    bad = np.flatnonzero(np.isnan(array))
    if bad.size:
        raise BadInput(f"{field}[{bad[0]}]", float(array[bad[0]]), "give a number from -1 to 1")
    return np.clip(array, -1.0, 1.0)


def decode(place: Room, values: Floats, kinds: Sequence[str]) -> Layout:
    """Return the layout that a vector stands for, sorted downhill.

    Parameters
    ----------
    place : Room
        Where what may be built.
    values : (slot_size n,) array
        n slots in [-1, 1], see the module.
    kinds : sequence of str
        Kinds to choose from, in the order of their scores.

    Returns
    -------
    tuple of Barrier
        At most n, each of which may be built where it stands.
    """
    built, _ = built_and_dropped(place, values, kinds)
    return tuple(sorted(built, key=lambda barrier: barrier.x))


def built_and_dropped(
    place: Room, values: Floats, kinds: Sequence[str]
) -> tuple[list[Barrier], list[str]]:
    """Return the barriers that `decode` builds, and what it leaves out, each with the reason."""
    built: list[Barrier] = []
    dropped: list[str] = []
    taken: list[Span] = []
    for number, slot in enumerate(values.reshape(-1, slot_size(kinds))):
        if slot[0] <= 0.0:
            continue
        kind = kinds[int(np.argmax(slot[NUMBERS:]))] if len(kinds) > 1 else kinds[0]
        station, height, size = (0.5 * (slot[1:NUMBERS] + 1.0)).tolist()
        if kind == "mesh":
            if any(isinstance(barrier, Mesh) for barrier in built):
                dropped.append(f"slot {number}: mesh: another mesh is built")
            else:
                built.append(place.mesh(_part(size, len(place.site.meshes))))
            continue
        found = place.nearest(make(place.zone, kind, station, height, size), taken)
        if found is None:
            dropped.append(f"slot {number}: {kind}: no place in the zone has room for it")
        else:
            built.append(found[0])
            taken.append(found[1])
    return built, dropped


def make(zone: BarrierZone, kind: str, station: float, height: float, size: float) -> Barrier:
    """Return the barrier of three shares from 0 to 1, wherever that is; no mesh."""
    x = zone.start + station * (zone.end - zone.start)
    return KINDS[kind].of_shares(zone, x, height, size)


def encode(place: Room, layout: Layout, slots: int, kinds: Sequence[str]) -> Floats:
    """Return a vector that `decode` turns into `layout`, empty slots last.

    Parameters
    ----------
    place : Room
        Where what may be built.
    layout : tuple of Barrier
        Barriers that may be built, of these kinds, at most `slots`.

    Raises
    ------
    BadInput
        If a number that is not decided is not the usual one, or one is too small.
    """
    out = np.full((slots, slot_size(kinds)), -1.0)
    for i, barrier in enumerate(layout):
        out[i, 0] = 1.0
        out[i, 1:NUMBERS] = _numbers(place, i, barrier)
        if len(kinds) > 1:
            out[i, NUMBERS + list(kinds).index(barrier.kind)] = 1.0
    return np.clip(out.ravel(), -1.0, 1.0)


def _numbers(place: Room, i: int, barrier: Barrier) -> list[float]:
    """Return station, height and size of a barrier, -1 to 1."""
    zone = place.zone
    if isinstance(barrier, Mesh):
        names = [option.name for option in place.site.meshes]
        usual: Barrier = place.mesh(names.index(barrier.option))
        shares = (0.5, 0.0, _middle(names.index(barrier.option), len(names)))
    else:
        shares = (share_of(barrier.x, zone.start, zone.end), *barrier.shares(zone))
        tall = getattr(barrier, barrier.lengths[0].field)
        if tall < MIN_HEIGHT - TOLERANCE:
            mend = f"give a number of at least {MIN_HEIGHT:g}"
            raise BadInput(f"layout[{i}].{barrier.lengths[0].field}", tall, mend)
        clipped = np.clip(shares, 0.0, 1.0).tolist()
        usual = place.put(make(zone, barrier.kind, *clipped), barrier.x) or barrier
    _check_usual(f"layout[{i}]", barrier, usual)
    return [2.0 * share - 1.0 for share in shares]


def _check_usual(where: str, barrier: Barrier, usual: Barrier) -> None:
    """Check that a barrier is the one that its numbers stand for."""
    for name in barrier.__struct_fields__:
        value, decided = getattr(barrier, name), getattr(usual, name)
        if value == decided:
            continue
        if isinstance(value, float) and isinstance(decided, float):
            if abs(value - decided) <= 1e-6 * max(1.0, abs(decided)):
                continue
        raise BadInput(f"{where}.{name}", value, f"give {decided!r}: no vector stands for another")


def _part(share: float, parts: int) -> int:
    """Return in which of some equal parts of 0 to 1 a share is."""
    return min(int(share * parts), parts - 1)


def _middle(part: int, parts: int) -> float:
    return (part + 0.5) / parts
