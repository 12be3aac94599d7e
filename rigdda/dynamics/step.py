"""One time step: detect contacts, compute forces island by island, move, correct."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Monitors, Totals, Work, World
from rigdda.dynamics.constants import (
    AWAKE,
    BAD_STATE,
    CONTACTS_FULL,
    DONE,
    ENDED,
    EVENTS_FULL,
    GROUND_MOVED,
)
from rigdda.dynamics.contact.links import mend_links
from rigdda.dynamics.detection import copy_index, detect
from rigdda.dynamics.fence_brakes import update_fences
from rigdda.dynamics.flight import fly, keep_touch, land, take_off
from rigdda.dynamics.frames import keep_frame
from rigdda.dynamics.island_step import step_island
from rigdda.dynamics.islands import find_islands
from rigdda.dynamics.monitors import is_over, note_passage, press_asleep, watch_thrust
from rigdda.dynamics.records import (
    CONTACT_TOTAL,
    CONTACTS,
    EVENTS,
    STEPS,
    Bodies,
    Contacts,
    Parameters,
    Shaking,
)
from rigdda.dynamics.shaking import set_field
from rigdda.dynamics.sleep import update_quiet_time
from rigdda.dynamics.stems import meet_stems
from rigdda.kernel import entry_kernel, kernel, stage, variable


@stage
def solve_and_move(
    world: World, contacts: Contacts, work: Work, monitors: Monitors, time: float, p: Parameters,
    totals: Totals,
) -> int:  # fmt: skip
    """Take the step of every island; return a block that diverged, or -1."""
    found = find_islands(world.bodies, contacts, work.begin, work.islands, p.blocks, p.islands)
    bad = -1
    for s in range(found):
        worse = step_island(world, contacts, work, monitors, time, s, p, totals)
        bad = max(bad, worse)
    if p.sleeping:
        update_quiet_time(world.bodies, work.islands, found, p)
    return bad


@kernel
def rest_all(bodies: Bodies) -> None:
    """Set all velocities to zero, for static mode."""
    for i in range(len(bodies)):
        body = bodies[i]
        body.vx = body.vy = body.omega = 0.0


@kernel
def set_out(bodies: Bodies, shaking: Shaking, since: float, time: float, p: Parameters) -> None:
    """Begin a step: reset velocities in static mode, and set the field of the ground motion."""
    if p.static:
        rest_all(bodies)
    if len(shaking) > 0:
        set_field(shaking, since, time, p)


@stage
def take_step(
    world: World, before: Contacts, now: Contacts, work: Work, monitors: Monitors, time: float,
    p: Parameters, totals: Totals,
) -> tuple[int, int]:  # fmt: skip
    """Move all bodies by a step.

    Parameters
    ----------
    before, now : (K,) array of CONTACTS
        Contacts of the step before, and room for those of this one.

    Returns
    -------
    count : int
        Number of contacts, or -1 without room for them; nothing has moved then.
    bad : int
        A block that diverged, or -1.
    """
    bodies, outlines, _, _, links, shaking, _ = world
    counters, ledger = totals.counters, totals.ledger
    set_out(bodies, shaking, counters[STEPS] * p.dt, time, p)
    copy_index(work.begin, work.first)
    count = detect(world, now, before, work, monitors, time, p, totals)
    if count < 0:
        copy_index(work.first, work.begin)
        return -1, -1
    bad = solve_and_move(world, now, work, monitors, time, p, totals)
    ledger[4] += mend_links(bodies, outlines, links, p)
    update_fences(bodies, outlines, now, count, monitors, counters, ledger, time, p)
    return count, bad


@stage
def end_step(
    bodies: Bodies, contacts: Contacts, count: int, work: Work, monitors: Monitors,
    counters: NDArray, p: Parameters,
) -> int:  # fmt: skip
    """Update the monitors at the end of a step; return DONE, GROUND_MOVED or ENDED."""
    counters[STEPS] += 1
    time = counters[STEPS] * p.dt
    counters[EVENTS] = note_passage(bodies, monitors, counters[EVENTS], time)
    counters[EVENTS], pushed = watch_thrust(
        bodies, contacts, count, monitors, work.islands, counters[EVENTS], counters[STEPS], time, p
    )
    if pushed:
        return GROUND_MOVED
    return ENDED if is_over(bodies, monitors, counters, p) else DONE


@entry_kernel
def advance(
    world: World, now: Contacts, before: Contacts, work: Work, monitors: Monitors,
    parameters: NDArray[np.void], totals: Totals, steps: int, frames: NDArray, stride: int,
) -> tuple[int, int, bool]:  # fmt: skip
    """Take up to `steps` steps, with a frame whenever a multiple of `stride` steps is left.

    Parameters
    ----------
    parameters : (1,) array of PARAMETERS
        Parameters of the scene and the settings.
    frames : (F, M, 6) array
        Filled in, the last one with the final state; see `frames.keep_frame`.

    Returns
    -------
    reason : int
        DONE, CONTACTS_FULL, EVENTS_FULL, GROUND_MOVED, BAD_STATE or ENDED; any reason other than
        DONE stops early.
    block : int
        The block that diverged, else -1.
    swapped : bool
        Whether `now` and `before` have exchanged roles.
    """
    swapped, reason, bad, p = False, DONE, -1, parameters[0]
    bodies, outlines, ground, _, links, shaking, stems = world
    counters, ledger = totals.counters, totals.ledger
    may_fly = len(links) == 0 and len(shaking) == 0 and not p.static and p.post_correction
    # flying body, steps flown, and steps of the flight
    flyer, flown, flight = variable(-1), variable(0), 0
    while steps > 0 and reason == DONE:
        room = len(monitors.event) - counters[EVENTS]
        if room < (p.blocks + 1) * (len(monitors.station) + len(monitors.target)):
            reason = EVENTS_FULL
            break
        time = (counters[STEPS] + 1) * p.dt
        if may_fly and flown == flight:
            land(bodies, outlines, flyer, flown)
            flyer, flight = take_off(bodies, outlines, ground, work.islands, work.begin, p, steps)
            flown = 0
        if flown < flight:
            flown += 1
            count = counters[CONTACTS]
            keep_touch(bodies, now, count, monitors, time)
            bad = fly(bodies, flyer, p, ledger)
            flight = flight if bodies[flyer].status == AWAKE else flown
        else:
            count, bad = take_step(world, now, before, work, monitors, time, p, totals)
            if count < 0:
                reason = CONTACTS_FULL
                break
            now, before, swapped = before, now, not swapped
        counters[CONTACTS] = count
        counters[CONTACT_TOTAL] += count
        meet_stems(bodies, stems, ledger)
        press_asleep(bodies, now, count, monitors, p.dt)
        events = counters[EVENTS]
        reason = end_step(bodies, now, count, work, monitors, counters, p)
        if counters[EVENTS] > events:  # a barrier may have failed; detection wakes its neighbours
            flight = flown
        steps -= 1
        if bad >= 0:
            reason = BAD_STATE
        elif len(frames) > 0 and steps % stride == 0:
            keep_frame(bodies, frames[len(frames) - 1 - steps // stride])
    land(bodies, outlines, flyer, flown)
    return reason, bad, swapped
