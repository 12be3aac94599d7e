"""The step of one island: settle its contacts, note its hits, move its blocks."""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Monitors, Motion, Outlines, System, Work
from rigdda.dynamics.clock import lap
from rigdda.dynamics.constants import (
    BOLT,
    OPEN,
    PIN,
    SPEED_LIMIT,
)
from rigdda.dynamics.contact.law import strike_at_once
from rigdda.dynamics.correction import move_corners, place_corners
from rigdda.dynamics.fence import charge_fences
from rigdda.dynamics.forces import (
    account_block,
    account_contact,
    accumulate_forces,
    apply_forces,
    move_block,
)
from rigdda.dynamics.lone_block import begin_part, recall_all, takes_parts
from rigdda.dynamics.monitors import note_hits
from rigdda.dynamics.motion import retire, top_speed
from rigdda.dynamics.open_close import open_close
from rigdda.dynamics.records import (
    EVENTS,
    MOTION,
    OPEN_CLOSE,
    Bodies,
    Body,
    Contacts,
    Interfaces,
    Parameters,
)
from rigdda.dynamics.recovery import push_out
from rigdda.dynamics.thrust import press
from rigdda.kernel import inlined, stage


@inlined
def note_touch(body: Body, damping: float) -> None:
    """Set the damping of a block to that of what it touches in this step; the greatest counts."""
    body.damping = max(body.damping, damping) if body.apart == 0.0 else damping
    body.apart = 0.0


@stage
def move_island(
    bodies: Bodies, outlines: Outlines, interfaces: Interfaces, contacts: Contacts, motion: Motion,
    islands: Islands, island: int, monitors: Monitors, p: Parameters, ledger: NDArray,
) -> int:  # fmt: skip
    """Move the blocks of an island whose forces are applied; returns one that went bad, or -1."""
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    bad = -1
    for s in range(b1 - b0):
        block = bodies[islands.block_item[b0 + s]]
        account_block(block, motion, s, p, ledger)
        block.apart += p.dt
    for item in range(c0, c1):
        c = contacts[islands.contact_item[item]]
        if c.state == OPEN:
            continue
        account_contact(c, motion.d, islands, ledger, monitors)
        if len(monitors.target) > 0:
            press(c, monitors, p.dt)
        support = c.kind == BOLT or c.kind == PIN
        interface = interfaces[bodies[c.a].surface, c.other]
        damping = p.damping if support else interface.damping
        note_touch(bodies[c.a], damping)
        if c.b >= 0:
            note_touch(bodies[c.b], damping)
    for s in range(b1 - b0):
        i = islands.block_item[b0 + s]
        block = bodies[i]
        block.wait = max(block.wait - 1, 0)
        move_block(block, motion, s, p.dt)
        if not top_speed(block) < SPEED_LIMIT:
            bad = i
        elif block.y < p.floor:
            ledger[1] -= retire(block)
        if p.post_correction:
            place_corners(bodies, outlines, i)
        else:
            move_corners(bodies, outlines, i, motion, s)
    return bad


@stage
def step_island(
    bodies: Bodies, outlines: Outlines, interfaces: Interfaces, contacts: Contacts,
    before: Contacts, system: System, work: Work, monitors: Monitors, time: float, s: int,
    p: Parameters, part: Parameters, counters: NDArray, ledger: NDArray,
) -> int:  # fmt: skip
    """Settle island s, note its hits, and move its blocks, in one or in parts: see `lone_block`.

    Returns a block that went bad, or -1.
    """
    islands, rows, m, motion = work.islands, work.rows, system.matrix, system.motion
    c0, c1 = islands.contact_start[s], islands.contact_start[s + 1]
    now, left, parts, bad = p, p.dt, 0, -1
    since = lap(counters, MOTION, 0, p.timing)
    while left > 0.0 and bad < 0:
        in_substeps = False
        if parts > 0:
            begin_part(
                bodies, contacts, interfaces, islands, s, motion, left, p.dt, parts, part
            )  # fmt: skip
            now = part
        if c1 > c0:
            since = lap(counters, MOTION, since, p.timing)
            strike_at_once(bodies, contacts, islands, s, now)
            in_substeps = open_close(bodies, contacts, system, islands, rows, s, now, counters)
            since = lap(counters, OPEN_CLOSE, since, p.timing)
        struck = apply_forces(bodies, contacts, m, motion, islands, s, in_substeps, now)
        if c1 > c0 and parts == 0 and takes_parts(bodies, contacts, islands, s, monitors, p):
            recall_all(contacts, islands, s, before, work.first, p)
            part.field_x, part.field_y = p.field_x, p.field_y
            parts = 1
            continue
        if c1 > c0:
            broke, in_substeps = charge_fences(
                bodies, contacts, system, islands, rows, s, monitors, time, in_substeps, now,
                counters,
            )  # fmt: skip
            if broke:
                struck = apply_forces(bodies, contacts, m, motion, islands, s, in_substeps, now)
            if len(monitors.target) > 0:
                counters[EVENTS] = note_hits(
                    bodies, contacts, islands, c0, c1, monitors, counters[EVENTS], time
                )
        for item in range(c0, c1):
            accumulate_forces(contacts[islands.contact_item[item]], struck, in_substeps)
        push_out(bodies, contacts, motion, islands, rows, s, struck, now)
        bad = move_island(
            bodies, outlines, interfaces, contacts, motion, islands, s, monitors, now, ledger
        )
        left -= now.dt
        parts += 1 if parts > 0 else 0
    lap(counters, MOTION, since, p.timing)
    return bad
