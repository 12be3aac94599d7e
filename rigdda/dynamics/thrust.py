"""Thrust on barriers: its mean over a second, and what that pushes away.

What lies against a barrier and what strikes it both press on it, in the ratio of chance in any one
step. Over a second it is the momentum that the barrier takes, which does not depend on the step.
A contact with the ground presses on the embankment on which it is.

Rock that is jammed between two rigid faces presses on both with any force, of which nothing is left
once one of them gives way. So contacts at rest count for no more than the weight of what leans on
the barrier: that is what drives rock on a slope 45 degrees steeper than its friction.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Monitors
from rigdda.dynamics.constants import (
    ASLEEP,
    BOLT,
    FIXED,
    OPEN,
    PIN,
    TERRAIN,
)
from rigdda.dynamics.islands import root
from rigdda.dynamics.monitors import FAILED, barrier_contact, write_event
from rigdda.dynamics.records import Bodies, Contact, Contacts, Parameters
from rigdda.kernel import kernel, stage

LEANING, STRIKING = 0, 1
"""Contacts of a barrier by which thrust is summed up."""


@kernel
def pressed(monitors: Monitors, c: Contact) -> int:
    """Return the barrier that a contact presses on, -1 for none."""
    if c.state == OPEN or c.kind == BOLT or c.kind == PIN:
        return -1
    if c.b != TERRAIN:
        return barrier_contact(monitors, c.a, c.b)[1]
    for barrier in range(len(monitors.target)):
        if monitors.target[barrier].low <= c.x <= monitors.target[barrier].high:
            return barrier
    return -1


@kernel
def press(c: Contact, monitors: Monitors, dt: float) -> None:
    """Add the impulse of a contact in a time [s] to what presses on a barrier."""
    barrier = pressed(monitors, c)
    if barrier < 0:
        return
    target, hit = monitors.target[barrier], c.struck == 1
    thrust = c.shear * c.ny - c.normal * c.nx  # on body b
    if c.b != TERRAIN and barrier_contact(monitors, c.a, c.b)[0] != c.a:
        thrust = -thrust
    monitors.push[barrier, STRIKING if hit else LEANING] += thrust * dt
    if thrust > target.most:
        target.most, target.block, target.x, target.y = thrust, c.a, c.x, c.y


@stage
def press_asleep(
    bodies: Bodies, contacts: Contacts, count: int, monitors: Monitors, dt: float
) -> None:
    """Add the impulses in a step [s] of what sleeps on barriers."""
    for k in range(count if len(monitors.target) > 0 else 0):
        if bodies[contacts[k].a].status == ASLEEP:
            press(contacts[k], monitors, dt)


@kernel
def weight_on(
    bodies: Bodies, contacts: Contacts, count: int, monitors: Monitors, islands: Islands,
    barrier: int, p: Parameters,
) -> float:  # fmt: skip
    """Return the weight of the blocks that lean on a barrier, through others or not [N]."""
    parent, leans = islands.parent, islands.slot
    for i in range(p.blocks):
        parent[i], leans[i] = i, 0
    for k in range(count):
        c = contacts[k]
        if c.state != OPEN and 0 <= c.b < p.blocks and bodies[c.b].status != FIXED:
            i, j = root(parent, c.a), root(parent, c.b)
            parent[max(i, j)] = min(i, j)
    for k in range(count):
        if pressed(monitors, contacts[k]) == barrier:
            leans[root(parent, contacts[k].a)] = 1
    weight = 0.0
    for i in range(len(monitors.rock)):
        weight += leans[root(parent, i)] * bodies[i].mass * p.gravity
    return weight


@stage
def watch_thrust(
    bodies: Bodies, contacts: Contacts, count: int, monitors: Monitors, islands: Islands,
    events: int, step: int, time: float, p: Parameters,
) -> tuple[int, bool]:  # fmt: skip
    """End a step: set the means over a second, and let what they exceed fail.

    Returns
    -------
    events : int
        The new number of events.
    ground : bool
        Whether an embankment was pushed away, so that the ground is to change.
    """
    ground = False
    for barrier in range(len(monitors.target)):
        target, last, push = (
            monitors.target[barrier],
            monitors.impulse[barrier],
            monitors.push[barrier],
        )
        place, period = step % len(last), len(last) * p.dt
        for kind in range(2):
            monitors.mean[barrier, kind] += (push[kind] - last[place, kind]) / period
            last[place, kind], push[kind] = push[kind], 0.0
        target.most = 0.0
        rest, hits = monitors.mean[barrier, LEANING], monitors.mean[barrier, STRIKING]
        if rest + hits <= target.thrust:
            continue
        rest = min(rest, weight_on(bodies, contacts, count, monitors, islands, barrier, p))
        target.thrust = max(target.thrust, rest + hits)
        if target.thrust <= target.limit:
            continue
        target.limit = math.inf
        ground = ground or target.low <= target.high
        events = write_event(
            monitors, events, time, FAILED, bodies[target.block], target.block, barrier, target.x,
            target.y, target.y - target.ground,
        )  # fmt: skip
    return events, ground
