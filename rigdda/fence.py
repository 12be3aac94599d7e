r"""Fences: what a step takes of their capacity, and what comes through if that is not left.

A block that hits a fence is stopped: the fence takes the work of the impact. Blocks that rest
against it cost it nothing, but pass blows on to it: within a step blow and support act at once,
nothing moves and no work is done. One after the other, block j strikes block i with the closing
speed u, both go on together, and the fence takes what of that is directed at it,

.. math:: W = \frac{1}{2} \frac{m_j^2}{m_j + m_i} u^2 (n_q \cdot n)^2 ,

with n_q and n the directions of the blow and of the push on the fence. Through a chain of blocks
m_i is their mass, and each contact on the way passes on its own share. With the impulse P of the
blow for m_j u this holds for eccentric blows, too; what more than m_j u passes through a contact in
a step is thrust, or another blow, which counts for itself. So the charge is a sum over the blows:
it does not matter how many of them fall into one step.

If it is more than is left, the blocks come through with a share s of the velocities that they would
have without the fence. Impulses in proportion to 1 - s then take

.. math:: W(s) = A (1 - s) - (A - W) (1 - s)^2 ,

with A their first-order work, the sum of impulse times velocity at the start: 2 W without friction,
for which W(s) = (1 - s^2) W.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.assembly.springs import along, normal_row, shear_row
from rigdda.constants import ASLEEP, CHAIN, IMPACT, OPEN, RETIRED, SPEED_LIMIT, STICK
from rigdda.correction import place_corners
from rigdda.gauges import FAILED, write_event
from rigdda.kernel import inlined, kernel, stage
from rigdda.motion import kinetic_energy
from rigdda.open_close import open_close
from rigdda.records import (
    EVENTS,
    Bodies,
    Contact,
    Contacts,
    Gauges,
    Islands,
    Outlines,
    Parameters,
    Rows,
    System,
)
from rigdda.sleep import wake_island


@kernel
def strength(way: NDArray) -> float:
    """Return how well a block passes blows on: the share of their direction over the mass [1/kg].

    `way` is the mass between the blow and the fence, 0 if the block does not lean on it [kg], and
    the direction in which a push on the block is one on the fence, its length the root of the
    share that arrives [-].
    """
    return (way[1] ** 2 + way[2] ** 2) / way[0] if way[0] > 0.0 else 0.0


@kernel
def share_along(c: Contact, way: NDArray, on_a: bool) -> float:
    """Return the root of the share that a push through a contact on its body a, or b, passes on."""
    along_way = c.nx * way[1] + c.ny * way[2]
    return max(along_way if on_a else -along_way, 0.0)


@kernel
def lean(c: Contact, ways: NDArray, near: int, far: int, mass: float, on_a: bool) -> bool:
    """Let slot `far`, of such a mass [kg], lean on `near`, if that is better than what it has."""
    share = share_along(c, ways[near], on_a)
    through = ways[near, 0] + mass
    if share * share <= strength(ways[far]) * through * (1.0 + 1e-9):
        return False
    sign = share if on_a else -share
    ways[far, 0], ways[far, 1], ways[far, 2] = through, sign * c.nx, sign * c.ny
    return True


@kernel
def find_ways(
    bodies: Bodies, contacts: Contacts, islands: Islands, island: int, fence: int, ways: NDArray
) -> bool:
    """Set how each block of an island leans on a fence, (n, 3) see `strength`; whether any does."""
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    reached = False
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.b != fence or c.state == OPEN:
            continue
        if not reached:
            for s in range(islands.block_start[island + 1] - islands.block_start[island]):
                ways[s, 0] = ways[s, 1] = ways[s, 2] = 0.0
        s, reached = islands.slot[c.a], True
        ways[s, 0], ways[s, 1], ways[s, 2] = bodies[c.a].mass, -c.nx, -c.ny
    for _ in range(CHAIN if reached else 0):
        changed = False
        for item in range(low, high):
            c = contacts[islands.contact_item[item]]
            if c.pair >= 0 and c.state != OPEN:
                i, j = islands.slot[c.a], islands.slot[c.b]
                changed = lean(c, ways, i, j, bodies[c.b].mass, True) or changed
                changed = lean(c, ways, j, i, bodies[c.a].mass, False) or changed
        if not changed:
            break
    return reached


@inlined
def hit(c: Contact, mass: float, d: NDArray, dt: float) -> tuple[float, float]:
    """Return work and first-order work of an impact of a block of such a mass on a fence [J]."""
    share = min(-mass * c.un / (c.normal * dt), 1.0)
    work = c.normal * along(normal_row(c, True), d) + c.shear * along(shear_row(c, True), d)
    return -share * work, -share * dt * (c.normal * c.un + c.shear * c.us)


@inlined
def blow(bodies: Bodies, c: Contact, islands: Islands, ways: NDArray, dt: float) -> float:
    """Return the energy that a blow of one block on another passes on to a fence [J]."""
    a, b = islands.slot[c.a], islands.slot[c.b]
    on_a = strength(ways[a]) >= strength(ways[b])
    struck, mass = (a, bodies[c.b].mass) if on_a else (b, bodies[c.a].mass)
    impulse = min(c.normal * dt, -mass * c.un)
    share = share_along(c, ways[struck], on_a)
    return -0.5 * impulse * c.un * share * share * mass / (mass + ways[struck, 0])


@stage
def charge(
    bodies: Bodies, contacts: Contacts, d: NDArray, islands: Islands, island: int, fence: int,
    ways: NDArray, dt: float,
) -> tuple[float, float, int]:  # fmt: skip
    """Return what a step of an island takes of a fence.

    Returns
    -------
    total, first : float
        Work, and that to first order in the impulses [J].
    k : int
        The contact through which most came, or -1.
    """
    total = first = most = 0.0
    k = -1
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.kind != IMPACT or c.state == OPEN or c.normal <= 0.0 or c.un >= 0.0:
            continue
        work = work_first = 0.0
        if c.b == fence:
            work, work_first = hit(c, bodies[c.a].mass, d[islands.slot[c.a]], dt)
        elif c.pair >= 0:
            work = blow(bodies, c, islands, ways, dt)
            work_first = 2.0 * work
        total += work
        first += work_first
        if work > most:
            most, k = work, islands.contact_item[item]
    return total, min(max(first, total), 2.0 * total), k


@stage
def break_through(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    fence: int, share: float, p: Parameters, counters: NDArray,
) -> None:  # fmt: skip
    """Settle an island whose blocks come through a fence with a share of their velocities.

    Without the fence first, which gives the velocities of which that is the share. Contacts that
    it had not reached in this step stay open.
    """
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    for attempt in range(2):
        for item in range(low, high):
            c = contacts[islands.contact_item[item]]
            if c.b != fence:
                continue
            speed = SPEED_LIMIT
            if attempt == 0:
                c.met, c.state = int(c.state != OPEN), OPEN
            elif c.met == 1:
                dn = along(normal_row(c, True), system.motion.d[islands.slot[c.a]])
                speed, c.state = share * max(c.un - 2.0 * dn / p.dt, 0.0), STICK
            c.kind, c.flips = IMPACT, 0
            c.memory_normal = c.memory_shear = c.start_normal = c.start_shear = 0.0
            c.bias = -p.dt * speed
        open_close(bodies, contacts, system, islands, rows, island, p, counters)


@stage
def charge_fences(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    gauges: Gauges, time: float, p: Parameters, counters: NDArray,
) -> bool:  # fmt: skip
    """Charge the fences that an island leans on, which was settled, and break what that exceeds.

    Returns whether a fence broke, so that the island was settled again.
    """
    broke, ways = False, system.scratch.residual
    for fence in range(p.blocks, len(bodies) if gauges.fences > 0 else p.blocks):
        barrier = gauges.barrier[fence]
        target = gauges.target[barrier]
        if target.capacity == math.inf:
            continue
        if not find_ways(bodies, contacts, islands, island, fence, ways):
            continue
        total, first, k = charge(
            bodies, contacts, system.motion.d, islands, island, fence, ways, p.dt
        )
        left = target.capacity - target.absorbed
        if total <= left:
            target.absorbed += total
            continue
        target.absorbed = target.capacity
        if bodies[fence].status != RETIRED:  # not by another island in this step
            bodies[fence].status = RETIRED
            c = contacts[k]
            i = (
                c.a
                if c.b == fence or kinetic_energy(bodies[c.a]) > kinetic_energy(bodies[c.b])
                else c.b
            )
            counters[EVENTS] = write_event(
                gauges, counters[EVENTS], time, FAILED, bodies[i], i, barrier, c.x, c.y,
                c.y - target.ground,
            )  # fmt: skip
        root = math.sqrt(max(first * first - 4.0 * (first - total) * left, 0.0))
        share = max(1.0 - 2.0 * left / (first + root), 0.0)
        break_through(bodies, contacts, system, islands, rows, island, fence, share, p, counters)
        broke = True
    return broke


@stage
def lower_fences(bodies: Bodies, outlines: Outlines, gauges: Gauges, p: Parameters) -> None:
    """Lower the top of each fence by what it has lost of its height since the last step."""
    for fence in range(p.blocks, len(bodies) if gauges.fences > 0 else p.blocks):
        target = gauges.target[gauges.barrier[fence]]
        top = target.top - target.sag * target.absorbed
        if target.sag > 0.0 and outlines.local[fence, 2].y > top:
            outlines.local[fence, 2].y = outlines.local[fence, 3].y = top
            place_corners(bodies, outlines, fence)


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
