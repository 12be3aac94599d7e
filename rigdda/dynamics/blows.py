r"""Blows and trains: what of an impact arrives at a fence, through which blocks.

A block that hits a fence is stopped: the fence takes the work of the impact. Blocks that rest
against it cost it nothing, but pass blows on to it: within a step blow and support act at once,
nothing moves and no work is done. One after the other, block j strikes block i with the closing
speed w_c, both go on together, and the fence takes what of that is directed at it,

.. math:: W = \frac{1}{2} \frac{m_j^2}{m_j + m_i} w_c^2 (n_q \cdot n)^2 ,

with n_q and n the directions of the blow and of the push on the fence. Through a chain of blocks
m_i is their mass, and each contact on the way passes on its own share. Blocks that strike one
another in turn within the step, or come on behind one that strikes, are a train and m_j is all of
it. With the impulse P of the blow for m_j w_c this holds for eccentric blows, too; what more than
m_j w_c passes through a contact in a step is thrust, or another blow, which counts for itself. So
the charge is a sum over the blows: it does not matter how many of them fall into one step, nor how
many steps a blow takes to go through a row.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.assembly.springs import along, normal_row, shear_row
from rigdda.dynamics.constants import (
    CHAIN,
    IMPACT,
    NEW,
    OPEN,
)
from rigdda.dynamics.islands import root
from rigdda.dynamics.records import Bodies, Body, Contact, Contacts
from rigdda.kernel import kernel


@kernel
def strength(way: NDArray) -> float:
    """Return how well a block passes blows on: the share of their direction over the mass [1/kg].

    A `way` says how a block leans on the fence. way[0] is the mass from the block to the fence
    [kg], 0 if it does not lean on it. (way[1], way[2]) is the direction in which a push on the
    block is one on the fence; its squared length is the share of a blow's energy that arrives [-].
    Of several ways the strongest counts.
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


@kernel
def momentum_towards(body: Body, way: NDArray) -> float:
    """Return the momentum with which a block comes towards the fence that it leans on [N s]."""
    return body.mass * max(body.vx * way[1] + body.vy * way[2], 0.0) if way[0] > 0.0 else 0.0


@kernel
def is_hit(c: Contact, fence: int) -> bool:
    """Return whether a contact is an impact on a fence.

    A corner that touches only now counts, too: it may be the second one of a block that hits.
    """
    hit = c.kind == IMPACT or c.kind == NEW
    return c.b == fence and c.state != OPEN and c.normal > 0.0 and hit


@kernel
def share_of_hits(
    bodies: Bodies, contacts: Contacts, islands: Islands, low: int, high: int, fence: int,
    momentum: float, dt: float,
) -> float:  # fmt: skip
    """Return the share of the impulses of the impacts on a fence in this step that are their own.

    What is beyond the momentum of the blocks that hit it, and beyond `momentum`, that of their
    trains [N s], is thrust, or a blow that counts for itself.
    """
    impulse = brought = own = 0.0
    last = -1
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if is_hit(c, fence):
            if c.a != last:  # contacts are in order of their block
                brought, own, last = brought + own, 0.0, c.a
            own = max(own, bodies[c.a].mass * math.hypot(c.un, c.us))
            impulse += c.normal * dt
    brought = max(brought + own, momentum)
    return brought / impulse if brought < impulse else 1.0


@kernel
def hits(
    bodies: Bodies, contacts: Contacts, d: NDArray, islands: Islands, low: int, high: int,
    fence: int, momentum: float, dt: float,
) -> tuple[float, float, int]:  # fmt: skip
    """Return the work of the impacts on a fence in this step, the most of one [J], and that one."""
    total = most = 0.0
    k = -1
    share = share_of_hits(bodies, contacts, islands, low, high, fence, momentum, dt)
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if is_hit(c, fence):
            own = d[islands.slot[c.a]]
            work = c.normal * along(normal_row(c, True), own)
            work = -share * (work + c.shear * along(shear_row(c, True), own))
            total += work
            if work > most:
                most, k = work, islands.contact_item[item]
    return total, most, k


@kernel
def strikes(c: Contact, islands: Islands, ways: NDArray) -> tuple[int, int]:
    """Return the slots of the block that strikes and of the one struck by a blow, or -1, -1."""
    if c.pair < 0 or c.kind != IMPACT or c.state == OPEN or c.un >= 0.0:
        return -1, -1
    a, b = islands.slot[c.a], islands.slot[c.b]
    return (b, a) if strength(ways[a]) >= strength(ways[b]) else (a, b)


@kernel
def blows(
    contacts: Contacts, islands: Islands, low: int, high: int, ways: NDArray, trains: NDArray,
    dt: float,
) -> tuple[float, float, int]:  # fmt: skip
    """Return what blows pass on to a fence in this step, the most of one [J], and that one.

    Blocks that strike one another in turn go on as one: the first of them strikes for all.
    """
    total = most = 0.0
    k = -1
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        striker, struck = strikes(c, islands, ways)
        share = share_along(c, ways[struck], struck == islands.slot[c.a]) if striker >= 0 else 0.0
        if share == 0.0 or root(islands.parent, striker) == root(islands.parent, struck):
            continue
        train = trains[root(islands.parent, striker)]
        impulse = min(c.normal * dt, train[1] / share)  # what comes towards the fence has the share
        work = 0.5 * impulse * train[1] * share / (train[0] + ways[struck, 0])
        total += work
        if work > most:
            most, k = work, islands.contact_item[item]
    return total, most, k
