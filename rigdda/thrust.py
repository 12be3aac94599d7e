"""Thrust on barriers: its mean over a second, and what that pushes away.

What lies against a barrier and what strikes it both press on it, in the ratio of chance in any one
step. Over a second it is the momentum that the barrier takes, which does not depend on the step.
Of a fence only contacts at rest count: blows cost it energy, see `fence`. A contact with the ground
presses on the embankment on which it is.
"""

from __future__ import annotations

import math

from rigdda.constants import ASLEEP, BOLT, HELD, IMPACT, OPEN, PIN, RETIRED, SHOCK, TERRAIN
from rigdda.gauges import FAILED, barrier_contact, write_event
from rigdda.kernel import kernel
from rigdda.records import Bodies, Contact, Contacts, Gauges, Parameters


@kernel
def pressed(gauges: Gauges, c: Contact) -> tuple[int, float]:
    """Return the barrier that a contact presses on, -1 for none, and its thrust downhill [N]."""
    on_b = c.shear * c.ny - c.normal * c.nx
    if c.b == TERRAIN:
        for barrier in range(len(gauges.target)):
            if gauges.target[barrier].low <= c.x <= gauges.target[barrier].high:
                return barrier, on_b
        return -1, 0.0
    block, barrier = barrier_contact(gauges, c.a, c.b)
    if barrier < 0 or c.kind == BOLT or c.kind == PIN:
        return -1, 0.0
    if gauges.target[barrier].capacity < math.inf and (c.kind == IMPACT or c.kind == SHOCK):
        return -1, 0.0
    return barrier, on_b if block == c.a else -on_b


@kernel
def note_thrust(
    bodies: Bodies, contacts: Contacts, count: int, gauges: Gauges, whole: bool, p: Parameters
) -> None:
    """Add the impulses of the contacts in a step, `whole` or a part of one that is cut back."""
    for k in range(count if len(gauges.target) > 0 else 0):
        c = contacts[k]
        body = bodies[c.a]
        # what is cut back counts in its parts, what is held or sleeps in the step as a whole
        elsewhere = body.cut == 1 if whole else body.status == HELD or body.status == ASLEEP
        if c.state == OPEN or elsewhere:
            continue
        barrier, thrust = pressed(gauges, c)
        if barrier < 0:
            continue
        target = gauges.target[barrier]
        target.push += thrust * p.dt
        if thrust > target.most:
            target.most, target.block, target.x, target.y = thrust, c.a, c.x, c.y


@kernel
def watch_thrust(
    bodies: Bodies, gauges: Gauges, events: int, step: int, time: float, p: Parameters
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
    for barrier in range(len(gauges.target)):
        target, impulse = gauges.target[barrier], gauges.impulse[barrier]
        place = step % len(impulse)
        target.mean += (target.push - impulse[place]) / (len(impulse) * p.dt)
        impulse[place] = target.push
        target.thrust = max(target.thrust, target.mean)
        if target.mean > target.limit:
            target.limit = math.inf
            events = write_event(
                gauges, events, time, FAILED, bodies[target.block], target.block, barrier,
                target.x, target.y, target.y - target.ground,
            )  # fmt: skip
            ground = ground or target.low <= target.high
            for fence in range(p.blocks, len(bodies)):
                if gauges.barrier[fence] == barrier:
                    bodies[fence].status = RETIRED
        target.push = target.most = 0.0
    return events, ground
