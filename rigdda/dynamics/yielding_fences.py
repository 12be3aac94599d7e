"""Fences of an island that hold or yield within a substep of relaxation."""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Rows
from rigdda.dynamics.records import Floats
from rigdda.dynamics.rows import (
    BEFORE,
    BRAKE,
    FREE,
    IMPULSE,
    LEFT,
    MOVES,
    NORMAL,
    NOW,
    SHEAR,
    START,
    X,
    place_row,
    push,
)
from rigdda.dynamics.substep import aim_row, couple_face
from rigdda.kernel import kernel


@kernel
def hold_fences(slots: Floats, scale: Floats, n: int) -> float:
    """Hold the fences of an island for a substep; return the kinetic energy that they had [J]."""
    energy = 0.0
    for s in range(n):
        slot = slots[s]
        if slot[BRAKE] > 0.0:
            energy += 0.5 * slot[BEFORE] * slot[BEFORE]
            slot[NOW] = slot[FREE] = scale[s, 0] = 0.0
    return energy


@kernel
def push_downhill(rows: Rows, k: int, s: int) -> float:
    """Return the downhill impulse of row k on slot s, a held fence [N s]."""
    i, j = rows.row_i[k], rows.row_j[k]
    other, first = (j, 3) if i == s else (i, 0)
    scale = rows.scale[other, 0]
    return -rows.row[k, IMPULSE] * rows.row[k, first] / scale if scale > 0.0 else 0.0


@kernel
def rest_on(rows: Rows, active: int, s: int, share: float) -> None:
    """Reduce the impulses on a held fence before it is released.

    Downhill normal impulses keep the fraction `share`, all others are set to zero. The impulses on
    a fence at rest are much greater than those that a light moving fence can transmit, and sweeps
    that start from them may gain energy.
    """
    for q in range(active):
        k = rows.active[q]
        i, j = rows.row_i[k], rows.row_j[k]
        if i != s and j != s:
            continue
        row, a, b = rows.row[k], rows.slot[i], rows.slot[j]
        kept = share if push_downhill(rows, k, s) > 0.0 else 0.0
        push(row, NORMAL, a, b, NOW, (kept - 1.0) * row[IMPULSE])
        push(row, SHEAR, a, b, NOW, (kept - 1.0) * row[IMPULSE + 1])
        row[IMPULSE] *= kept
        row[IMPULSE + 1] *= kept


@kernel
def release_fences(
    rows: Rows, n: int, active: int, h: float, touch: float, ledger: NDArray
) -> bool:  # fmt: skip
    """Release fences that contacts push harder than their brakes; return whether any was released.

    While it is held, a fence has lost its velocity of the last substep. When it is released, its
    brake acts with its braking force, and the contacts must be solved again. The brake of a fence
    whose elongation is used up does not act.
    """
    released = False
    for s in range(n):
        slot = rows.slot[s]
        if slot[BRAKE] == 0.0 or rows.scale[s, 0] > 0.0:
            continue
        brake = h * slot[BRAKE] if slot[X] - slot[START] < slot[LEFT] else 0.0
        net = pushed = 0.0
        for q in range(active):
            k = rows.active[q]
            if rows.row_i[k] == s or rows.row_j[k] == s:
                net += push_downhill(rows, k, s)
                pushed += max(push_downhill(rows, k, s), 0.0)
        if net + slot[BEFORE] / slot[MOVES] <= brake:
            continue
        released = True
        ledger[1] += 0.5 * slot[BEFORE] * slot[BEFORE]
        slot[NOW] = slot[FREE] = slot[BEFORE] - brake * slot[MOVES]
        share = min(brake / pushed, 1.0) if pushed > 0.0 else 0.0
        rest_on(rows, active, s, share)
        rows.scale[s, 0] = slot[MOVES]
        for q in range(active):
            k = rows.active[q]
            i, j = rows.row_i[k], rows.row_j[k]
            if i != s and j != s:
                continue
            row, fact, a, b = rows.row[k], rows.fact[k], rows.slot[i], rows.slot[j]
            place_row(row, fact, rows.form[k], a, b, rows.scale[i], rows.scale[j])
            aim_row(row, fact, a, b, h, h, touch)
            if rows.face[k] == 0:
                couple_face(rows.row[k - 1], row)
            slot[NOW] += row[IMPULSE] * row[0 if i == s else 3]
    return released


@kernel
def end_fences(slots: Floats, scale: Floats, n: int, ledger: NDArray) -> None:
    """Account for the work of the brakes of yielding fences; stop those that would move uphill."""
    for s in range(n):
        slot = slots[s]
        if slot[BRAKE] > 0.0 and scale[s, 0] == 0.0:
            slot[BEFORE] = 0.0
        elif slot[BRAKE] > 0.0:
            if slot[NOW] < 0.0:
                ledger[1] -= 0.5 * slot[BEFORE] * slot[NOW]
                slot[NOW] = 0.0
            ledger[4] += (slot[FREE] - slot[BEFORE]) * 0.5 * (slot[BEFORE] + slot[NOW])


@kernel
def stop_uphill(slots: Floats, n: int) -> float:
    """Stop the fences that a rebound moves uphill; return the kinetic energy that they had [J]."""
    energy = 0.0
    for s in range(n):
        slot = slots[s]
        if slot[BRAKE] > 0.0 and slot[NOW] < 0.0:
            energy += 0.5 * slot[NOW] * slot[NOW]
            slot[NOW] = 0.0
    return energy
