"""Monitors of a run: hits of barriers, crossings of stations, energies and thrust on barriers.

The thrust on a barrier is averaged over a second; if it exceeds the resistance of an embankment,
the embankment is pushed away. Leaning contacts and impacts share the load in a proportion that
varies randomly from step to step. Over a second their sum is the momentum that the barrier absorbs,
which does not depend on the step. A contact with the ground counts for the embankment on which it
lies.

Rock that is jammed between two rigid faces may press on both with any force, which vanishes as soon
as one of them yields. Contacts at rest therefore count for no more than the weight of the blocks
that lean on the barrier. A smooth vertical wall that retains rock of weight W on a slope beta with
the friction angle phi carries W tan(beta - phi), which reaches W where beta exceeds phi by 45
degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.dynamics.arrays import Islands, Monitors
from rigdda.dynamics.constants import ASLEEP, AWAKE, BOLT, FIXED, OPEN, PIN, TERRAIN
from rigdda.dynamics.islands import root
from rigdda.dynamics.motion import kinetic_energy
from rigdda.dynamics.records import STILL, Bodies, Body, Contact, Contacts, Ints, Parameters
from rigdda.errors import BadInput
from rigdda.kernel import inlined, kernel, stage


def chainages(stations: Sequence[float]) -> NDArray[np.float64]:
    """Return stations as an array.

    Raises
    ------
    BadInput
        If they are not finite numbers in ascending order.
    """
    try:
        lines = np.array([check.number("stations", x) for x in stations], dtype=np.float64)
    except TypeError:
        raise BadInput("stations", stations, "give a sequence of chainages") from None
    if (np.diff(lines) <= 0.0).any():
        raise BadInput("stations", lines.tolist(), "give them in ascending order")
    return lines


BETWEEN_HITS = 0.1
"""Time without contact after which a block that touches a barrier again hits it again [s]."""

HIT, CROSSING, FAILED = 0, 1, 2
"""Kinds of event: a block touches a barrier; the centroid of a block first passes a station; a
block breaks a barrier."""


@kernel
def write_event(
    monitors: Monitors, n: int, time: float, kind: int, body: Body, i: int, target: int,
    x: float, y: float, height: float,
) -> int:  # fmt: skip
    """Write event n of body i; return the new number of events."""
    event = monitors.event[n]
    rocks = len(monitors.rock)
    event.time, event.kind, event.target = time, kind, target
    event.block = i if i < rocks else rocks + monitors.barrier[i]
    event.x, event.y, event.height = x, y, height
    event.speed = math.hypot(body.vx, body.vy)
    event.energy = kinetic_energy(body)
    return n + 1


@kernel
def barrier_contact(monitors: Monitors, a: int, b: int) -> tuple[int, int]:
    """Return the striking body and the struck barrier of a contact of a and b, -1 if no barrier.

    A gravity wall that is carried along can strike other barriers.
    """
    rocks = len(monitors.rock)
    if b >= rocks:
        return a, monitors.barrier[b]
    if a >= rocks and b >= 0:
        return b, monitors.barrier[a]
    return a, -1


@inlined
def note_hits(
    bodies: Bodies, contacts: Contacts, islands: Islands, low: int, high: int, monitors: Monitors,
    events: int, time: float,
) -> int:  # fmt: skip
    """Write a hit for each barrier that a block newly touches, before velocities are updated."""
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        i, barrier = barrier_contact(monitors, c.a, c.b)
        if barrier < 0 or c.state == OPEN:
            continue
        if time - monitors.last_touch[i, barrier] > BETWEEN_HITS:
            height = c.y - monitors.target[barrier].ground
            events = write_event(
                monitors, events, time, HIT, bodies[i], i, barrier, c.x, c.y, height
            )
        monitors.last_touch[i, barrier] = time
    return events


@inlined
def note_passage(bodies: Bodies, monitors: Monitors, events: int, time: float) -> int:
    """Record the first crossing of each station by a centroid, and update energies and extents."""
    stations = len(monitors.station)
    for i in range(len(monitors.rock)):
        body, rock = bodies[i], monitors.rock[i]
        x = body.x
        rock.low, rock.high = min(rock.low, x - body.radius), max(rock.high, x + body.radius)
        if monitors.watch_low <= x <= monitors.watch_high:
            rock.energy = max(rock.energy, kinetic_energy(body))
        while rock.next < stations and x >= monitors.station[rock.next].x:
            s, y = rock.next, body.y
            height = y - monitors.station[s].ground
            events = write_event(monitors, events, time, CROSSING, body, i, s, x, y, height)
            rock.next += 1
    return events


@kernel
def is_over(bodies: Bodies, monitors: Monitors, counters: Ints, p: Parameters) -> bool:
    """Return whether all blocks are at rest or have passed `monitors.leave` and move downhill.

    With barriers, this must have held for a second, because blocks that lie on a barrier still
    press on it and thrust is averaged over a second.
    """
    if monitors.leave == -math.inf:
        return False
    for i in range(p.blocks):
        body = bodies[i]
        if (
            body.status == AWAKE
            and body.brake == 0.0
            and not (body.x - body.radius > monitors.leave and body.vx > 0.0)
        ):
            counters[STILL] = 0
            return False
    counters[STILL] += 1
    return len(monitors.target) == 0 or counters[STILL] * p.dt > 1.0 + p.dt


LEANING, STRIKING = 0, 1
"""Kinds of contact with a barrier, whose thrust is summed separately."""


@kernel
def pressed(monitors: Monitors, c: Contact) -> int:
    """Return the barrier that a contact presses on, or -1."""
    if c.state == OPEN or c.kind == BOLT or c.kind == PIN:
        return -1
    if c.b != TERRAIN:
        return barrier_contact(monitors, c.a, c.b)[1]
    for barrier in range(len(monitors.target)):
        if monitors.target[barrier].low <= c.face_x <= monitors.target[barrier].high:
            return barrier
    return -1


@kernel
def press(c: Contact, monitors: Monitors, dt: float) -> None:
    """Add the impulse of a contact over a time [s] to the thrust on its barrier."""
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
    """Add the impulses over a step [s] of blocks that sleep on barriers."""
    for k in range(count if len(monitors.target) > 0 else 0):
        if bodies[contacts[k].a].status == ASLEEP:
            press(contacts[k], monitors, dt)


@kernel
def weight_on(
    bodies: Bodies, contacts: Contacts, count: int, monitors: Monitors, islands: Islands,
    barrier: int, p: Parameters,
) -> float:  # fmt: skip
    """Return the weight of the blocks that lean on a barrier, directly or through others [N]."""
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
    """Update the thrust averaged over a second, and let barriers fail whose resistance it exceeds.

    Returns
    -------
    events : int
        The new number of events.
    ground : bool
        Whether an embankment was pushed away, so that the ground must change.
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
