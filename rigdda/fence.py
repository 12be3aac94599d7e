"""Fences: they fail when the energy that they took would exceed their capacity.

An impact on a fence is plastic. If the work of its contact forces in a step would be more than
what is left of its capacity, the blocks pass through it with a share s of their closing velocities:
the contacts aim at the velocity -s u_c instead of 0. For impacts in proportion the impulse is then
1 - s and the mean velocity 1 + s times that of the plastic impact, so that

    W(s) = (1 - s^2) W(0).

The s for which W(s) is what is left is found from there by regula falsi in s^2, since friction and
neighbours bend the law (Dowell and Jarratt 1971, BIT 11, 168-174). Blocks at rest against the fence
pass blows on to it: see `passed_on`.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.assembly.springs import along, normal_row, shear_row
from rigdda.constants import (
    ASLEEP,
    BREAK_SOLVES,
    BREAK_TOLERANCE,
    IMPACT,
    OPEN,
    RETIRED,
    SHOCK,
    SPEED_LIMIT,
    STICK,
)
from rigdda.gauges import FAILED, write_event
from rigdda.kernel import kernel, stage
from rigdda.open_close import open_close
from rigdda.records import EVENTS, Bodies, Contacts, Gauges, Islands, Parameters, Rows, System
from rigdda.sleep import wake_island


@kernel
def work_taken(
    contacts: Contacts, d: NDArray, islands: Islands, low: int, high: int, fence: int
) -> float:
    """Return the work that body `fence` takes from the blocks of an island in this step [J]."""
    total = 0.0
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.b == fence and c.state != OPEN:
            own = d[islands.slot[c.a]]
            total -= c.normal * along(normal_row(c, True), own)
            total -= c.shear * along(shear_row(c, True), own)
    return total


@kernel
def let_pass(
    contacts: Contacts, islands: Islands, low: int, high: int, fence: int, s: float, dt: float
) -> None:
    """Make the contacts with a fence impacts after which a share s of c.passing is left."""
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.b == fence:
            c.kind, c.state, c.flips = IMPACT, STICK, 0
            c.memory_normal = c.memory_shear = 0.0
            c.start_normal = c.start_shear = 0.0
            c.bias = -dt * s * c.passing


@kernel
def let_go(
    contacts: Contacts, islands: Islands, low: int, high: int, fence: int, dt: float
) -> None:
    """Keep the contacts with a fence from closing in this step, whatever comes."""
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.b == fence:
            c.kind, c.state = IMPACT, OPEN
            c.memory_normal = c.memory_shear = 0.0
            c.start_normal = c.start_shear = 0.0
            c.bias = -dt * SPEED_LIMIT


@kernel
def passed_on(
    contacts: Contacts, islands: Islands, low: int, high: int, fence: int, dt: float
) -> float:
    """Return the energy of blows that blocks at rest against a fence pass on to it [J].

    Blow and support act within one step, so that the block does not move and the fence does no
    work. One after the other, the block would come at the fence with c.passing instead of -u_0,
    and the impulse would take half their product.
    """
    total = 0.0
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.b == fence and c.state != OPEN:
            total += 0.5 * dt * c.normal * max(c.passing + min(c.un, 0.0), 0.0)
    return total


@stage
def set_passing(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    fence: int, p: Parameters, counters: NDArray,
) -> None:  # fmt: skip
    """Set c.passing at a fence: the closing velocities as if the fence were not there.

    Where blocks of the island hit each other it is settled without the fence first.
    """
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    struck = False
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        blow = c.kind == IMPACT or c.kind == SHOCK
        struck = struck or (blow and 0 <= c.b < p.blocks and c.normal > 0.0)
        c.passing = max(-c.un, 0.0)
    if not struck:
        return
    let_go(contacts, islands, low, high, fence, p.dt)
    open_close(bodies, contacts, system, islands, rows, island, p, counters)
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.b == fence:
            dn = along(normal_row(c, True), system.motion.d[islands.slot[c.a]])
            c.passing = max(c.un - 2.0 * dn / p.dt, 0.0)
    let_pass(contacts, islands, low, high, fence, 0.0, p.dt)
    open_close(bodies, contacts, system, islands, rows, island, p, counters)


@stage
def break_through(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    fence: int, left: float, taken: float, tolerance: float, p: Parameters, counters: NDArray,
) -> None:  # fmt: skip
    """Settle an island so that a fence takes what is left of its capacity, where it took more.

    If no share s does, it takes less or nothing: never more than is left and `tolerance` [J].
    """
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    if left <= 0.0:
        let_go(contacts, islands, low, high, fence, p.dt)
        open_close(bodies, contacts, system, islands, rows, island, p, counters)
        return
    # squares of shares with which it takes too much and too little, and by how much
    small, over = 0.0, taken - left
    large, under = 1.0, -left
    side = 0
    square = 1.0 - left / taken
    for _ in range(BREAK_SOLVES):
        let_pass(contacts, islands, low, high, fence, math.sqrt(square), p.dt)
        open_close(bodies, contacts, system, islands, rows, island, p, counters)
        off = work_taken(contacts, system.motion.d, islands, low, high, fence) - left
        off += passed_on(contacts, islands, low, high, fence, p.dt)
        if abs(off) <= tolerance:
            return
        # regula falsi after Illinois: an end that stays counts half from its second time on
        if off > 0.0:
            small, over = square, off
            under *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            large, under = square, off
            over *= 0.5 if side < 0 else 1.0
            side = -1
        square = small + (large - small) * over / (over - under)
    if off > 0.0:
        let_go(contacts, islands, low, high, fence, p.dt)
        open_close(bodies, contacts, system, islands, rows, island, p, counters)


@kernel
def touches(contacts: Contacts, islands: Islands, low: int, high: int, fence: int) -> int:
    """Return a closed contact of an island with a fence, -1 if there is none."""
    for item in range(low, high):
        k = islands.contact_item[item]
        if contacts[k].b == fence and contacts[k].state != OPEN:
            return k
    return -1


@stage
def limit_fences(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    gauges: Gauges, time: float, p: Parameters, counters: NDArray,
) -> bool:  # fmt: skip
    """Let an island that was settled break the fences that would take more than they can.

    Returns whether there are fences that it touches, so that it was settled again.
    """
    if gauges.fences == 0:
        return False
    touched = False
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    for fence in range(p.blocks, len(bodies)):
        barrier = gauges.barrier[fence]
        target = gauges.target[barrier]
        capacity = target.capacity
        k = touches(contacts, islands, low, high, fence) if capacity < math.inf else -1
        if k < 0:
            continue
        touched = True
        set_passing(bodies, contacts, system, islands, rows, island, fence, p, counters)
        left, tolerance = capacity - target.absorbed, BREAK_TOLERANCE * capacity
        taken = work_taken(contacts, system.motion.d, islands, low, high, fence)
        taken += passed_on(contacts, islands, low, high, fence, p.dt)
        if taken > left + tolerance:
            if bodies[fence].status != RETIRED:
                bodies[fence].status = RETIRED
                c = contacts[k]
                counters[EVENTS] = write_event(
                    gauges, counters[EVENTS], time, FAILED, bodies[c.a], c.a, barrier, c.x, c.y,
                    c.y - target.ground,
                )  # fmt: skip
            break_through(
                bodies, contacts, system, islands, rows, island, fence, left, taken, tolerance, p,
                counters,
            )  # fmt: skip
        target.absorbed += passed_on(contacts, islands, low, high, fence, p.dt)
    return touched


@kernel
def wake_behind(
    bodies: Bodies, contacts: Contacts, count: int, gauges: Gauges, p: Parameters
) -> None:
    """Wake what sleeps against a fence that failed in this step."""
    for k in range(count if gauges.fences > 0 else 0):
        c = contacts[k]
        if c.b < p.blocks or bodies[c.b].status != RETIRED:
            continue
        if bodies[c.a].status == ASLEEP:
            wake_island(bodies, bodies[c.a].island, p.blocks)
