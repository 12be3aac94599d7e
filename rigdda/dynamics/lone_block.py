"""A lone block that is struck or turns fast takes its step in parts.

A part ends just before an impact, just after it, or once the block has turned by `TURN`. A contact
that bears the block, such as the corner it rocks on, lets go at the impact; if both were solved in
one part, it would not bear before the impact either, and the block would fall freely until then. An
impact turns a block, and another corner of it may strike soon after, faster and from elsewhere than
it would have without. Solved as one, both impacts would act at once, or what closes by the first
one would be slowed down, and never bounce; how many do depends on the step. Without parts for turns
single blocks of 0.1 m2 lost 4.6 % more energy in a bounce in steps of 10 ms than in 0.5 ms, of
0.05 m2 11 %. What a block may touch was foreseen for the whole step.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Monitors, Motion
from rigdda.dynamics.constants import (
    AT_ONCE,
    BEFORE_IMPACT,
    BOLT,
    IMPACT,
    LANDING,
    MOST_PARTS,
    NEW,
    OPEN,
    PIN,
    PLAIN,
    TURN,
)
from rigdda.dynamics.contact.approach import pull_on, strike
from rigdda.dynamics.contact.law import prepare, time_of_impact
from rigdda.dynamics.contact.transfer import recall
from rigdda.dynamics.records import Bodies, Contact, Contacts, Interfaces, Ints, Parameters
from rigdda.kernel import inlined, kernel


@kernel
def takes_parts(
    bodies: Bodies,
    contacts: Contacts,
    islands: Islands,
    island: int,
    monitors: Monitors,
    p: Parameters,
) -> bool:
    """Return whether an island is a lone block that lands, or that turns fast.

    Not on a fence, which is charged for a step as a whole, and its impacts are plastic, nor with
    supports or joints, which could not be prepared anew, nor with plain contacts, whose rebound
    is what the step makes of it.
    """
    blocks = islands.block_start[island + 1] - islands.block_start[island]
    if blocks > 1 or not p.post_correction:
        return False
    turn = abs(bodies[islands.block_item[islands.block_start[island]]].omega) * p.dt
    parts = turn > TURN
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        landing = c.kind == NEW and c.state != OPEN and -c.un > LANDING * p.gravity * p.dt
        parts = parts or c.kind == IMPACT or landing
        if c.kind == BOLT or c.kind == PIN or c.kind == PLAIN or c.bond > 0.0:
            return False
        if c.b >= 0 and monitors.barrier[c.b] >= 0:
            if monitors.target[monitors.barrier[c.b]].capacity < math.inf:
                return False
    return parts


@kernel
def recall_all(
    contacts: Contacts, islands: Islands, island: int, before: Contacts, first: Ints, p: Parameters
) -> None:
    """Let the contacts of an island be as they were before the step."""
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        k = islands.contact_item[item]
        recall(contacts, k, k + 1, before, first, p.margin)


@kernel
def time_to_close(c: Contact, pull: float) -> float:
    """Return the time [s] in which a gap closes at speed -w_0, to which `pull` [m/s2] adds."""
    gap = max(c.gap, 0.0)
    root = math.sqrt(max(c.un * c.un + 2.0 * pull * gap, 0.0))
    return 2.0 * gap / (root - c.un) if root > c.un else 0.0


@inlined
def follow(bodies: Bodies, c: Contact, motion: Motion, p: Parameters) -> None:
    """Move a contact with its block, which has moved; apart by more than the margin it is open."""
    d, correction, a = motion.d[0], motion.correction[0], bodies[c.a]
    u, v, turn = d[0] + correction[0], d[1] + correction[1], d[2] + correction[2]
    cos, sin = math.cos(turn), math.sin(turn)
    side = 0.0 if c.owner == 1 else c.gap  # the corner, or the point of the face that is over it
    x, y = c.x + side * c.nx - (a.x - u), c.y + side * c.ny - (a.y - v)
    x, y = a.x + cos * x - sin * y, a.y + sin * x + cos * y
    if c.owner == 1:
        c.gap += c.nx * (x - c.x) + c.ny * (y - c.y)
        c.x, c.y = x, y
    else:
        c.nx, c.ny = cos * c.nx - sin * c.ny, sin * c.nx + cos * c.ny
        c.gap = c.nx * (x - c.x) + c.ny * (y - c.y)
    if c.gap > p.margin or c.state == OPEN:
        c.state = OPEN
        c.accumulated_normal = c.accumulated_shear = c.stiffness = 0.0
        c.start_normal = c.start_shear = c.bond = 0.0


@inlined
def begin_part(
    bodies: Bodies, contacts: Contacts, interfaces: Interfaces, islands: Islands, island: int,
    motion: Motion, left: float, step: float, number: int, part: Parameters,
) -> None:  # fmt: skip
    """Begin part `number` of the step of a lone block, of which some is left [s].

    It goes on until the next impact; through it, if that is at hand; or to the end. The first part
    is 1; `motion` is that of the part before.
    """
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    turning = abs(bodies[islands.block_item[islands.block_start[island]]].omega)
    least, short = LANDING * part.gravity * step, AT_ONCE * step
    part.dt = end = left
    if number < MOST_PARTS:
        end = left / max(math.ceil(turning * left / TURN), 1)
    for item in range(c0, c1):
        c = contacts[islands.contact_item[item]]
        if number > 1:
            follow(bodies, c, motion, part)
        if number == MOST_PARTS:
            continue
        pull = pull_on(bodies, c, part)
        strike(bodies, c, 0.5 * left, pull, part)
        time = time_of_impact(bodies, c, pull, least, part)
        if time >= 0.0:
            strike(bodies, c, 0.5 * time, pull, part)
            time = BEFORE_IMPACT * time_to_close(c, pull)
            end = min(end, time if time > short else time + short)
    # no part so short that rounding makes its velocities
    part.dt = end if end < left - short else left
    for item in range(c0, c1):
        c = contacts[islands.contact_item[item]]
        prepare(bodies, c, interfaces, False, part)
        if c.kind == NEW and part.dt < left:
            # only what closes faster than 2 gap / dt in the end has closed within the part; what is
            # slower must not be slowed down, since it strikes in the next one
            c.bias *= 2.0
