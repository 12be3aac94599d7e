"""Motion of the bodies of an island in a substep: weight, loads, damping and displacement."""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Rows
from rigdda.dynamics.equations import load_moment
from rigdda.dynamics.records import Bodies, Body, Floats, Parameters
from rigdda.dynamics.rows import (
    BEFORE,
    BOUNCES,
    BRAKE,
    COS,
    DAMPING,
    FIELD,
    FREE,
    HELD,
    LEFT,
    MOVES,
    NOW,
    PULL,
    SIN,
    START,
    TURN,
    X,
    Y,
)
from rigdda.kernel import inlined, kernel


@kernel
def start_slot(body: Body, slot: Floats, scale: Floats, p: Parameters) -> None:
    """Set a slot from its body: position, velocity, weight and loads."""
    root, spin = math.sqrt(body.mass), math.sqrt(body.inertia)
    scale[0], scale[1], scale[2] = 1.0 / root, 1.0 / root, 1.0 / spin
    slot[NOW], slot[NOW + 1], slot[NOW + 2] = root * body.vx, root * body.vy, spin * body.omega
    slot[PULL] = p.field_x * root + body.force_x / root
    slot[PULL + 1] = p.field_y * root + body.force_y / root
    slot[PULL + 2] = load_moment(body, p.dt) / spin
    slot[X], slot[Y], slot[TURN], slot[COS], slot[SIN] = body.x, body.y, 0.0, 1.0, 0.0
    slot[DAMPING], slot[FIELD] = p.damping, 0.0
    slot[BRAKE], slot[MOVES], slot[LEFT] = body.brake, scale[0], body.elongation
    slot[START] = body.x
    if body.brake > 0.0:
        scale[1] = scale[2] = slot[PULL] = slot[PULL + 1] = slot[DAMPING] = 0.0


@inlined
def start_slots(bodies: Bodies, islands: Islands, rows: Rows, island: int, p: Parameters) -> None:
    """Set the slots of an island from its bodies, and one slot for all that does not move."""
    first = islands.block_start[island]
    n = islands.block_start[island + 1] - first
    for s in range(n):
        start_slot(bodies[islands.block_item[first + s]], rows.slot[s], rows.scale[s], p)
    for q in range(rows.slot.shape[1]):
        rows.slot[n, q] = 0.0
    rows.slot[n, COS] = 1.0
    for q in range(3):
        rows.scale[n, q] = 0.0


@kernel
def fade(slots: Floats, n: int, time: float) -> float:
    """Damp the velocities of the bodies for a time [s]; return the work of damping [J].

    Damping acts for half of a substep before all other impulses and for half of it after them, so
    that it does not change the forces on bodies at rest.
    """
    lost = 0.0
    for s in range(n):
        slot = slots[s]
        if slot[DAMPING] > 0.0:
            left = math.exp(-slot[DAMPING] * time)
            for q in range(3):
                lost -= 0.5 * (1.0 - left * left) * slot[NOW + q] * slot[NOW + q]
                slot[NOW + q] *= left
    return lost


@kernel
def pull(slots: Floats, n: int, h: float) -> None:
    """Apply weight and loads for a substep."""
    for s in range(n):
        slot = slots[s]
        for q in range(3):
            slot[BEFORE + q] = slot[NOW + q]
            slot[NOW + q] += h * slot[PULL + q]
            slot[FREE + q] = slot[NOW + q]
        slot[HELD] = slot[BOUNCES] = 0.0


@kernel
def greatest_pull(rows: Rows, n: int) -> float:
    """Return the greatest acceleration of a centroid by weight and loads [m/s2]."""
    most = 0.0
    for s in range(n):
        x, y = rows.slot[s, PULL] * rows.scale[s, 0], rows.slot[s, PULL + 1] * rows.scale[s, 1]
        most = max(most, math.sqrt(x * x + y * y))
    return most


@kernel
def drift_half(slots: Floats, scale: Floats, n: int, h: float) -> None:
    """Move the bodies for half a substep h with their current velocities."""
    for s in range(n):
        slot = slots[s]
        for q in range(3):
            slot[X + q] += 0.5 * h * slot[NOW + q] * scale[s, q]
        slot[COS], slot[SIN] = math.cos(slot[TURN]), math.sin(slot[TURN])


@kernel
def drift(slots: Floats, scale: Floats, n: int, h: float, gone: float) -> None:
    """Move the bodies for a substep, and sum up the work of weight and loads.

    Every impulse, including those of contacts, does work along the mean of the velocities before
    and after the substep. `gone` is the fraction of the substep for which the bodies have already
    moved.
    """
    for s in range(n):
        slot = slots[s]
        new = 0.5 + 0.5 * slot[HELD]
        for q in range(3):
            mean = 0.5 * (slot[BEFORE + q] + slot[NOW + q])
            slot[FIELD] += h * slot[PULL + q] * mean
            way = h * (new * slot[NOW + q] + (1.0 - new - gone) * slot[BEFORE + q])
            slot[X + q] += way * scale[s, q]
        slot[COS], slot[SIN] = math.cos(slot[TURN]), math.sin(slot[TURN])


@kernel
def copy_velocities(slots: Floats, n: int, first: int, to: int) -> None:
    """Copy the velocities of the bodies from three columns of their slots to three others."""
    for s in range(n):
        for q in range(3):
            slots[s, to + q] = slots[s, first + q]


@kernel
def kinetic(slots: Floats, n: int, first: int) -> float:
    """Return the kinetic energy of the velocities in three columns of the slots [J]."""
    energy = 0.0
    for s in range(n):
        for q in range(3):
            energy += 0.5 * slots[s, first + q] * slots[s, first + q]
    return energy
