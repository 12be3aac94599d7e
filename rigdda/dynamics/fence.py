"""Fences: they are charged with what a step takes of their capacity, and fail beyond it.

What that is `blows` finds. If it is more than is left, the blocks come through with a share sigma
of the velocities that they would have without the fence, which takes (1 - sigma^2) W of impacts in
proportion. Friction and neighbours bend this law, so sigma^2 is sought by false position between 0
and 1.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Monitors, Outlines, Rows, System
from rigdda.dynamics.assembly.springs import along, normal_row
from rigdda.dynamics.blows import blows, find_ways, hits
from rigdda.dynamics.constants import (
    ASLEEP,
    BREAK_SOLVES,
    BREAK_TOLERANCE,
    IMPACT,
    OPEN,
    RETIRED,
    SPEED_LIMIT,
)
from rigdda.dynamics.correction import set_body_coordinates
from rigdda.dynamics.monitors import FAILED, write_event
from rigdda.dynamics.motion import kinetic_energy
from rigdda.dynamics.open_close import open_close
from rigdda.dynamics.records import EVENTS, Bodies, Contacts, Parameters
from rigdda.dynamics.sleep import wake_island
from rigdda.dynamics.trains import find_trains
from rigdda.kernel import kernel, stage


@kernel
def aim(
    contacts: Contacts, d: NDArray, islands: Islands, low: int, high: int, fence: int,
    first: bool, share: float, dt: float,
) -> None:  # fmt: skip
    """Let blocks leave a failing fence with a share of the velocities that they have without it.

    The `first` solve lets them through, by a bias of -dt SPEED_LIMIT; the second reads from it the
    closing velocity `free` that each contact keeps. From then on the bias is -dt share free.
    Contacts start open and without force each time, since a block that strikes the ground, too,
    might be jammed between both. One that was not closed as the fence failed stays open.
    """
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.b != fence:
            continue
        if first:
            c.met, c.free = int(c.state != OPEN), SPEED_LIMIT
        elif c.met == 1 and c.free == SPEED_LIMIT:
            c.free = max(c.un - 2.0 * along(normal_row(c, True), d[islands.slot[c.a]]) / dt, 0.0)
        c.kind = IMPACT
        c.state = OPEN
        c.accumulated_normal = c.accumulated_shear = c.start_normal = c.start_shear = 0.0
        c.bias = -dt * (share * c.free if c.free < SPEED_LIMIT else SPEED_LIMIT)
        c.rebound = 0.0


@stage
def break_through(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    fence: int, left: float, struck: float, passed: float, momentum: float, p: Parameters,
    counters: NDArray,
) -> tuple[float, bool]:  # fmt: skip
    """Settle an island whose blocks come through a fence.

    Returns what that takes of them [J], and what `open_close` does. The fence has `left` where it
    would take the work `struck` of impacts, and what blows pass on.
    """
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    d, total = system.motion.d, struck + passed
    taken, square, in_substeps = 0.0, 1.0 - left / total, False
    low_square, high_square, most, least = 0.0, 1.0, total, 0.0  # a bracket, and what its ends take
    for attempt in range(BREAK_SOLVES if left > 0.0 else 1):
        if attempt == BREAK_SOLVES - 1 and taken - left > left - least:
            square = high_square  # W(s) has a step where another impact comes first
        aim(contacts, d, islands, low, high, fence, attempt == 0, math.sqrt(square), p.dt)
        in_substeps = open_close(bodies, contacts, system, islands, rows, island, p, counters)
        if attempt > 0:
            taken = hits(bodies, contacts, d, islands, low, high, fence, momentum, p.dt)[0]
            taken += (1.0 - square) * passed
            if abs(taken - left) < BREAK_TOLERANCE * left:
                break
            if taken > left:
                low_square, most = square, taken
            else:
                high_square, least = square, taken
            share = min(max((most - left) / (most - least), 0.05), 0.95)  # no end for ever
            square = low_square + share * (high_square - low_square)
    return taken, in_substeps


@stage
def charge_fences(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    monitors: Monitors, time: float, in_substeps: bool, p: Parameters, counters: NDArray,
) -> tuple[bool, bool]:  # fmt: skip
    """Charge the fences that an island leans on, which was settled, and break what that exceeds.

    Returns whether a fence broke, so that the island was settled again, and whether that was
    `in_substeps`, see `open_close`.
    """
    broke, d = False, system.motion.d
    ways, trains = system.scratch.residual, system.scratch.direction
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    for fence in range(p.blocks, len(bodies) if monitors.fences > 0 else p.blocks):
        barrier = monitors.barrier[fence]
        target = monitors.target[barrier]
        if target.capacity == math.inf:
            continue
        if not find_ways(bodies, contacts, islands, island, fence, ways):
            continue
        momentum = find_trains(bodies, contacts, islands, island, fence, ways, trains)
        struck, hardest, k = hits(bodies, contacts, d, islands, low, high, fence, momentum, p.dt)
        passed, most, blow = blows(contacts, islands, low, high, ways, trains, p.dt)
        left = target.capacity - target.absorbed if bodies[fence].status != RETIRED else 0.0
        if struck + passed <= left:
            target.absorbed += max(struck + passed, 0.0)
            continue
        if bodies[fence].status != RETIRED:  # not by another island in this step
            bodies[fence].status = RETIRED
            c = contacts[k if hardest >= most else blow]
            i = c.a  # or, in a blow on a block that leans on the fence, what struck that
            if c.b != fence and kinetic_energy(bodies[c.b]) > kinetic_energy(bodies[i]):
                i = c.b
            counters[EVENTS] = write_event(
                monitors, counters[EVENTS], time, FAILED, bodies[i], i, barrier, c.x, c.y,
                c.y - target.ground,
            )  # fmt: skip
        taken, in_substeps = break_through(
            bodies, contacts, system, islands, rows, island, fence, left, struck, passed,
            momentum, p, counters,
        )  # fmt: skip
        target.absorbed += min(taken, left)
        broke = True
    return broke, in_substeps


@stage
def lower_fences(bodies: Bodies, outlines: Outlines, monitors: Monitors, p: Parameters) -> None:
    """Lower the top of each fence by what it has lost of its height since the last step."""
    for fence in range(p.blocks, len(bodies) if monitors.fences > 0 else p.blocks):
        target = monitors.target[monitors.barrier[fence]]
        top = target.top - target.sag * target.absorbed
        if target.sag > 0.0 and outlines.local[fence, 2].y > top:
            outlines.local[fence, 2].y = outlines.local[fence, 3].y = top
            set_body_coordinates(bodies, outlines, fence)


@kernel
def wake_behind(
    bodies: Bodies, contacts: Contacts, count: int, monitors: Monitors, p: Parameters
) -> None:
    """Wake what sleeps against a fence that failed in this step."""
    for k in range(count if monitors.fences > 0 else 0):
        c = contacts[k]
        if c.b < p.blocks or bodies[c.b].status != RETIRED:
            continue
        if bodies[c.a].status == ASLEEP:
            wake_island(bodies, bodies[c.a].island, p.blocks)
