"""Fences: barriers that yield at a constant force until their elongation is used up.

A fence is a body that moves only along x, and only downhill. Its brake resists any force up to F =
capacity / elongation (`yielding_fences.release_fences`). A larger force, whether from an impact or
from a pile, moves the fence against F, so that the fence absorbs F times its displacement. When its
elongation is used up, the fence has absorbed its capacity and is removed.

`yielding_fences.end_fences` adds the work of the brakes to the energy balance, and
`island_step.account_contacts` the energy absorbed to the account of the barrier.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Monitors, Outlines
from rigdda.dynamics.constants import OPEN, RETIRED
from rigdda.dynamics.monitors import FAILED, write_event
from rigdda.dynamics.motion import retire
from rigdda.dynamics.post_correction import set_body_coordinates
from rigdda.dynamics.records import EVENTS, Bodies, Contacts, Parameters
from rigdda.kernel import kernel, stage


@kernel
def last_block(
    contacts: Contacts, count: int, fence: int, barrier: int, monitors: Monitors
) -> tuple[int, float, float]:
    """Return the block that presses hardest on a fence in this step, and the contact point [m].

    If no block presses on it, return the block that touched it last, with infinite coordinates.
    """
    block, most, x, y = -1, 0.0, math.inf, math.inf
    for k in range(count):
        c = contacts[k]
        pushes = (c.a == fence or c.b == fence) and c.state != OPEN
        if pushes and c.normal > most:
            block, most, x, y = c.a if c.b == fence else c.b, c.normal, c.x, c.y
    if block < 0:
        block = 0
        for i in range(len(monitors.rock)):
            if monitors.last_touch[i, barrier] > monitors.last_touch[block, barrier]:
                block = i
    return block, x, y


@stage
def update_fences(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, count: int, monitors: Monitors,
    counters: NDArray, ledger: NDArray, time: float, p: Parameters,
) -> None:  # fmt: skip
    """Reduce the elongation left in fences that moved in this step, and lower their tops.

    A fence whose elongation is used up fails. Its failure is attributed to the block that presses
    hardest on it, or that touched it last. The energy that fences absorb is summed in
    `island_step.account_contacts`.
    """
    for fence in range(len(monitors.rock), p.blocks):
        body = bodies[fence]
        if body.brake == 0.0 or body.status == RETIRED:
            continue
        moved = body.x - body.held_at
        if moved <= 0.0:
            continue
        body.held_at = body.x
        body.elongation -= moved
        barrier = monitors.barrier[fence]
        target = monitors.target[barrier]
        for corner in range(2, 4):
            outlines.local[fence, corner].y -= target.sag * moved
        set_body_coordinates(bodies, outlines, fence)
        if body.elongation > 0.0:
            continue
        body.x += body.elongation  # the last substep may overshoot the elongation
        ledger[1] -= retire(body)
        block, x, y = last_block(contacts, count, fence, barrier, monitors)
        if x == math.inf:
            x, y = body.x, bodies[block].y
        counters[EVENTS] = write_event(
            monitors, counters[EVENTS], time, FAILED, bodies[block], block, barrier, x, y,
            y - target.ground,
        )  # fmt: skip
