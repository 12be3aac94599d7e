"""What a run watches: hits of barriers, crossings of stations, energies in an interval."""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Monitors
from rigdda.dynamics.constants import APART, AWAKE, OPEN
from rigdda.dynamics.motion import kinetic_energy
from rigdda.dynamics.records import STILL, Bodies, Body, Contacts, Ints, Parameters
from rigdda.kernel import inlined, kernel

HIT, CROSSING, FAILED = 0, 1, 2
"""Kinds of event: a block touches a barrier; a block's centroid first passes a station; a block
breaks a barrier."""


@kernel
def write_event(
    monitors: Monitors, n: int, time: float, kind: int, body: Body, i: int, target: int,
    x: float, y: float, height: float,
) -> int:  # fmt: skip
    """Write event n of body i; returns the new number of events."""
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
    """Return what strikes and what barrier it strikes in a contact of a and b, -1 for no barrier.

    A gravity wall that is carried along strikes other barriers.
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
    """Write a hit for each barrier that a block touches anew; velocities still those before."""
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        i, barrier = barrier_contact(monitors, c.a, c.b)
        if barrier < 0 or c.state == OPEN:
            continue
        if time - monitors.last_touch[i, barrier] > APART:
            height = c.y - monitors.target[barrier].ground
            events = write_event(
                monitors, events, time, HIT, bodies[i], i, barrier, c.x, c.y, height
            )
        monitors.last_touch[i, barrier] = time
    return events


@inlined
def note_passage(bodies: Bodies, monitors: Monitors, events: int, time: float) -> int:
    """Write a crossing for each station that a centroid first passes; watch energies, extents."""
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
    """Return whether nothing moves any more but what has left `monitors.leave` behind, downhill.

    Where there are barriers it must have been so for a second: what lies on them presses on, and
    thrust is a mean over a second.
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
