"""One step: detect contacts, settle them island by island, move, correct."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.clock import lap
from rigdda.dynamics.constants import (
    ASLEEP,
    AWAKE,
    BAD_STATE,
    CONTACTS_FULL,
    DONE,
    ENDED,
    EVENTS_FULL,
    GROUND_MOVED,
    OPEN,
    SPEED_LIMIT,
    TERRAIN,
)
from rigdda.dynamics.contact.broad_phase import partners_of_bodies, sweep_and_prune
from rigdda.dynamics.contact.joint import bond_joints
from rigdda.dynamics.contact.law import prepare, strike_at_once
from rigdda.dynamics.contact.links import add_link, mend_links
from rigdda.dynamics.contact.narrow_phase import collide_pair
from rigdda.dynamics.contact.terrain_phase import collide_terrain
from rigdda.dynamics.contact.transfer import copy_contact, recall
from rigdda.dynamics.correction import (
    account_block,
    account_contact,
    apply_forces,
    keep_memory,
    move_block,
    move_corners,
    place_corners,
)
from rigdda.dynamics.fence import charge_fences, lower_fences, wake_behind
from rigdda.dynamics.flight import fly, keep_touch, land, take_off
from rigdda.dynamics.frames import keep_frame
from rigdda.dynamics.gauges import barrier_contact, is_over, note_hits, note_passage
from rigdda.dynamics.islands import find_islands
from rigdda.dynamics.lone_block import begin_part, recall_all, takes_parts
from rigdda.dynamics.motion import retire, top_speed
from rigdda.dynamics.open_close import open_close
from rigdda.dynamics.records import (
    BROAD_PHASE,
    CONTACT_TOTAL,
    CONTACTS,
    EVENTS,
    MOTION,
    NARROW_PHASE,
    OPEN_CLOSE,
    STEPS,
    Bodies,
    Boxes,
    Contacts,
    Gauges,
    Ground,
    Interfaces,
    Ints,
    Islands,
    Links,
    Motion,
    Outlines,
    Parameters,
    Polygons,
    Shaking,
    System,
    Work,
)
from rigdda.dynamics.recovery import push_out
from rigdda.dynamics.shaking import set_field
from rigdda.dynamics.sleep import wake_neighbours, watch_quiet
from rigdda.dynamics.thrust import press, press_asleep, watch_thrust
from rigdda.kernel import entry_kernel, kernel, stage


@kernel
def candidate_pairs(bodies: Bodies, polygon: Polygons, boxes: Boxes, p: Parameters) -> bool:
    """List the bodies that each awake one may touch in this step; returns whether they fit."""
    pairs = sweep_and_prune(bodies, polygon, boxes, p)
    if pairs > 0 and p.sleeping and wake_neighbours(bodies, boxes.pairs, pairs, p.blocks) > 0:
        pairs = sweep_and_prune(bodies, polygon, boxes, p)
    if pairs < 0:
        return False
    partners_of_bodies(boxes, pairs)
    return True


@kernel
def keep_asleep(
    bodies: Bodies, contacts: Contacts, count: int, old: Contacts, first: Ints, a: int,
    gauges: Gauges, time: float,
) -> int:  # fmt: skip
    """Keep the contacts of sleeping block a with what is still; returns the new number, or -1."""
    if count + first[a + 1] - first[a] > len(contacts):
        return -1
    for m in range(first[a], first[a + 1]):
        b = old[m].b
        if b == TERRAIN or bodies[b].status != AWAKE:
            copy_contact(contacts[count], old[m])
            count += 1
            block, barrier = barrier_contact(gauges, a, b)
            if barrier >= 0:
                gauges.last_touch[block, barrier] = time
    return count


@stage
def collide_block(
    bodies: Bodies, outlines: Outlines, ground: Ground, interfaces: Interfaces, contacts: Contacts,
    count: int, old: Contacts, work: Work, a: int, start: bool, p: Parameters, deepest: NDArray,
) -> int:  # fmt: skip
    """Write the contacts of awake block a with the terrain and with its partners.

    Returns
    -------
    int
        The new number of contacts; -1 if they do not fit.
    """
    first, room, boxes = count, len(contacts) - outlines.corner.shape[1] - 4, work.boxes
    count = collide_terrain(bodies, outlines, ground, boxes.swept[a], contacts, count, a, p)
    for q in range(boxes.partner_start[a], boxes.partner_start[a + 1]):
        if count < 0 or count > room:
            return -1
        count = collide_pair(bodies, outlines, contacts, count, a, boxes.partner[q], p)
    if count < 0 or count > room:
        return -1
    recall(contacts, first, count, old, work.first, p.slack)
    if p.bonded and start:
        bond_joints(contacts, first, count, p)
    for k in range(first, count):
        prepare(bodies, contacts[k], interfaces, start, p)
        deepest[0] = max(deepest[0], -contacts[k].gap)
    return count


@kernel
def copy_index(index: Ints, to: Ints) -> None:
    """Copy an index of contacts by body."""
    for a in range(len(index)):
        to[a] = index[a]


@stage
def detect(
    bodies: Bodies, outlines: Outlines, ground: Ground, interfaces: Interfaces, links: Links,
    contacts: Contacts, old: Contacts, work: Work, gauges: Gauges, time: float, p: Parameters,
    counters: NDArray, deepest: NDArray,
) -> int:  # fmt: skip
    """Write all contacts of the step in order of their first body; -1 if they do not fit."""
    since = lap(counters, BROAD_PHASE, 0, p.timing)
    if not candidate_pairs(bodies, outlines.polygon, work.boxes, p):
        return -1
    since = lap(counters, BROAD_PHASE, since, p.timing)
    start = time <= 1.5 * p.dt
    count, link = int(np.int64(0)), 0  # with a literal all that it is handed to is compiled twice
    for a in range(p.blocks):
        work.begin[a] = count
        low_link = link
        while link < len(links) and links[link].a == a:
            link += 1
        if bodies[a].status == AWAKE:
            count = collide_block(
                bodies, outlines, ground, interfaces, contacts, count, old, work, a, start, p,
                deepest,
            )  # fmt: skip
            if count < 0 or count + link - low_link > len(contacts):
                return -1
            for q in range(low_link, link):
                add_link(bodies, links, q, contacts[count], p)
                count += 1
        elif bodies[a].status == ASLEEP:
            count = keep_asleep(bodies, contacts, count, old, work.first, a, gauges, time)
            if count < 0:
                return -1
    work.begin[p.blocks] = count
    lap(counters, NARROW_PHASE, since, p.timing)
    return count


@stage
def move_island(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, motion: Motion, islands: Islands,
    island: int, gauges: Gauges, p: Parameters, ledger: NDArray,
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
        account_contact(c, motion.d, islands, ledger, gauges)
        if len(gauges.target) > 0:
            press(c, gauges, p.dt)
        bodies[c.a].apart = 0.0
        if c.b >= 0:
            bodies[c.b].apart = 0.0
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
    before: Contacts, system: System, work: Work, gauges: Gauges, time: float, s: int,
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
            begin_part(bodies, contacts, interfaces, islands, s, motion, left, parts, part)
            now = part
        if c1 > c0:
            since = lap(counters, MOTION, since, p.timing)
            strike_at_once(bodies, contacts, islands, s, now)
            in_substeps = open_close(bodies, contacts, system, islands, rows, s, now, counters)
            since = lap(counters, OPEN_CLOSE, since, p.timing)
        struck = apply_forces(bodies, contacts, m, motion, islands, s, in_substeps, now)
        if c1 > c0 and parts == 0 and takes_parts(bodies, contacts, islands, s, gauges, p):
            recall_all(contacts, islands, s, before, work.first, p)
            part.field_x, part.field_y = p.field_x, p.field_y
            parts = 1
            continue
        if c1 > c0:
            if charge_fences(
                bodies, contacts, system, islands, rows, s, gauges, time, now, counters
            ):
                struck = apply_forces(bodies, contacts, m, motion, islands, s, in_substeps, now)
            if len(gauges.target) > 0:
                counters[EVENTS] = note_hits(
                    bodies, contacts, islands, c0, c1, gauges, counters[EVENTS], time
                )
        for item in range(c0, c1):
            keep_memory(contacts[islands.contact_item[item]], struck, in_substeps)
        push_out(bodies, contacts, motion, islands, rows, s)
        bad = move_island(bodies, outlines, contacts, motion, islands, s, gauges, now, ledger)
        left -= now.dt
        parts += 1 if parts > 0 else 0
    lap(counters, MOTION, since, p.timing)
    return bad


@stage
def solve_and_move(
    bodies: Bodies, outlines: Outlines, interfaces: Interfaces, contacts: Contacts, count: int,
    before: Contacts, system: System, work: Work, gauges: Gauges, time: float, p: Parameters,
    part: Parameters, counters: NDArray, ledger: NDArray,
) -> int:  # fmt: skip
    """Take the step of every island; `part` is for parts of the step of a lone block.

    Returns a block that went bad, or -1.
    """
    since = lap(counters, MOTION, 0, p.timing)
    found = find_islands(bodies, contacts, work.begin, work.islands, p.blocks, p.islands)
    since = lap(counters, MOTION, since, p.timing)
    bad = -1
    for s in range(found):
        worse = step_island(
            bodies, outlines, interfaces, contacts, before, system, work, gauges, time, s, p, part,
            counters, ledger,
        )  # fmt: skip
        bad = max(bad, worse)
    if p.sleeping:
        since = lap(counters, MOTION, 0, p.timing)
        watch_quiet(bodies, work.islands, found, p)
        wake_behind(bodies, contacts, count, gauges, p)
        lap(counters, MOTION, since, p.timing)
    return bad


@kernel
def rest_all(bodies: Bodies) -> None:
    """Take the velocity from every block: static mode."""
    for i in range(len(bodies)):
        body = bodies[i]
        body.vx = body.vy = body.omega = 0.0


@kernel
def set_out(bodies: Bodies, shaking: Shaking, since: float, time: float, p: Parameters) -> None:
    """Begin a step: at rest in static mode, in the field that the motion of the ground makes."""
    if p.static:
        rest_all(bodies)
    if len(shaking) > 0:
        set_field(shaking, since, time, p)


@stage
def end_step(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, count: int, work: Work, gauges: Gauges,
    counters: NDArray, p: Parameters,
) -> int:  # fmt: skip
    """Watch what a whole step has brought; returns DONE, GROUND_MOVED or ENDED."""
    counters[STEPS] += 1
    time = counters[STEPS] * p.dt
    counters[EVENTS] = note_passage(bodies, gauges, counters[EVENTS], time)
    counters[EVENTS], pushed = watch_thrust(
        bodies, contacts, count, gauges, work.islands, counters[EVENTS], counters[STEPS], time, p
    )
    lower_fences(bodies, outlines, gauges, p)
    if pushed:
        return GROUND_MOVED
    return ENDED if is_over(bodies, gauges, counters, p) else DONE


@entry_kernel
def advance(
    bodies: Bodies, outlines: Outlines, ground: Ground, interfaces: Interfaces, links: Links,
    shaking: Shaking, now: Contacts, before: Contacts, system: System, work: Work, gauges: Gauges,
    parameters: NDArray[np.void], counters: NDArray, ledger: NDArray, deepest: NDArray,
    steps: int, frames: NDArray, stride: int,
) -> tuple[int, int, bool]:  # fmt: skip
    """Take up to `steps` steps, and keep a frame whenever a multiple of `stride` is left.

    Parameters
    ----------
    parameters : array of PARAMETERS
        Of the step, and of the part of it that a lone block takes.
    counters, ledger, deepest : arrays
        See `records.COUNTERS`, `records.LEDGER`; deepest[0] is the greatest penetration [m].
    frames : (F, M, 6) array
        The last is for the state in the end; see `frames.keep_frame`.

    Returns
    -------
    reason : int
        DONE, CONTACTS_FULL, EVENTS_FULL, GROUND_MOVED, BAD_STATE or ENDED; anything but DONE stops
        early.
    block : int
        The block that went bad, else -1.
    swapped : bool
        Whether `now` and `before` have changed roles.
    """
    swapped, reason, bad, p = False, DONE, -1, parameters[0]
    may_fly = len(links) == 0 and len(shaking) == 0 and not p.static and p.post_correction
    flyer, flown, flight = -1, 0, 0  # steps of a flight that are taken, and all of them
    while steps > 0 and reason == DONE:
        room = len(gauges.event) - counters[EVENTS]
        if room < (p.blocks + 1) * (len(gauges.station) + len(gauges.target)):
            reason = EVENTS_FULL
            break
        time = (counters[STEPS] + 1) * p.dt
        if may_fly and flown == flight:
            land(bodies, outlines, flyer, flown)
            flyer, flight = take_off(bodies, outlines, ground, work.islands, work.begin, p)
            flown = 0
        if flown < flight:
            flown += 1
            count = counters[CONTACTS]
            keep_touch(bodies, now, count, gauges, time)
            bad = fly(bodies, flyer, now, system.matrix, system.motion, work.islands, p, ledger)
            flight = flight if bodies[flyer].status == AWAKE else flown
        else:
            set_out(bodies, shaking, counters[STEPS] * p.dt, time, p)
            copy_index(work.begin, work.first)
            count = detect(
                bodies, outlines, ground, interfaces, links, before, now, work, gauges, time, p,
                counters, deepest,
            )  # fmt: skip
            if count < 0:
                copy_index(work.first, work.begin)
                reason = CONTACTS_FULL
                break
            now, before = before, now
            swapped = not swapped
            bad = solve_and_move(
                bodies, outlines, interfaces, now, count, before, system, work, gauges, time, p,
                parameters[1], counters, ledger,
            )  # fmt: skip
            ledger[4] += mend_links(bodies, outlines, links, p)
        counters[CONTACTS] = count
        counters[CONTACT_TOTAL] += count
        press_asleep(bodies, now, count, gauges, p.dt)
        reason = end_step(bodies, outlines, now, count, work, gauges, counters, p)
        steps -= 1
        if bad >= 0:
            reason = BAD_STATE
        elif len(frames) > 0 and steps % stride == 0:
            keep_frame(bodies, frames[len(frames) - 1 - steps // stride])
    land(bodies, outlines, flyer, flown)
    return reason, bad, swapped
