"""Fences: yielding supports that give way against a constant force until their elongation is spent.

A fence is a body that moves along x alone. Its brake, a row of the contacts (`contact.links`),
holds it with any force up to F = capacity / elongation. What pushes harder, be it a blow or a pile,
moves it against F, so that it takes the energy F times its path. When its elongation is spent, it
has taken its capacity and is gone.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Monitors, Outlines
from rigdda.dynamics.constants import BRAKE, OPEN, RETIRED
from rigdda.dynamics.correction import set_body_coordinates
from rigdda.dynamics.monitors import FAILED, write_event
from rigdda.dynamics.motion import retire
from rigdda.dynamics.records import EVENTS, Bodies, Contacts, Links
from rigdda.kernel import kernel, stage


@kernel
def hardest_push(contacts: Contacts, count: int, fence: int) -> int:
    """Return the contact that presses hardest on a body in this step, -1 if none does."""
    hardest, most = -1, 0.0
    for k in range(count):
        c = contacts[k]
        pushes = (c.a == fence or c.b == fence) and c.kind != BRAKE and c.state != OPEN
        if pushes and c.normal > most:
            hardest, most = k, c.normal
    return hardest


@stage
def give_way(
    bodies: Bodies, outlines: Outlines, links: Links, contacts: Contacts, count: int,
    monitors: Monitors, counters: NDArray, ledger: NDArray, time: float,
) -> None:  # fmt: skip
    """Spend the elongation of the fences that have moved in this step, and lower their tops.

    A fence whose elongation is spent fails, by the block that presses hardest on it.
    """
    for q in range(len(links)):
        link = links[q]
        fence = link.a
        if link.kind != BRAKE or bodies[fence].status == RETIRED:
            continue
        moved = abs(bodies[fence].x - link.bx)
        if moved == 0.0:
            continue
        link.bx = bodies[fence].x
        link.length -= moved
        barrier = monitors.barrier[fence]
        target = monitors.target[barrier]
        for corner in range(2, 4):
            outlines.local[fence, corner].y -= target.sag * moved
        set_body_coordinates(bodies, outlines, fence)
        if link.length > 0.0:
            continue
        ledger[1] -= retire(bodies[fence])
        k = hardest_push(contacts, count, fence)
        if k >= 0:
            c = contacts[k]
            i = c.a if c.b == fence else c.b
            counters[EVENTS] = write_event(
                monitors, counters[EVENTS], time, FAILED, bodies[i], i, barrier, c.x, c.y,
                c.y - target.ground,
            )  # fmt: skip
