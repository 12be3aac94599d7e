"""The step of one island: compute contact forces, record hits, correct positions, move bodies."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Monitors, Outlines, Rows, Totals, Work, World
from rigdda.dynamics.constants import (
    BOLT,
    OPEN,
    PIN,
    PLAIN,
    REST,
    SLEEP_SPEED,
    SLIP,
    SPEED_LIMIT,
    STICK,
)
from rigdda.dynamics.contact.joint import joint_breaks
from rigdda.dynamics.equations import inertia_force, inertia_stiffness, load_moment
from rigdda.dynamics.islands import pair_blocks
from rigdda.dynamics.monitors import barrier_contact, note_hits, press
from rigdda.dynamics.motion import retire, top_speed
from rigdda.dynamics.open_close import solve_states, take_solution
from rigdda.dynamics.position_correction import push_out
from rigdda.dynamics.post_correction import move_corners, place_corners
from rigdda.dynamics.records import (
    EVENTS,
    RELAXED,
    SWEEPS,
    Bodies,
    Body,
    Contact,
    Contacts,
    Floats,
    Parameters,
)
from rigdda.dynamics.relaxation import relax
from rigdda.dynamics.rows import (
    BRAKE,
    COS,
    FIELD,
    IMPULSE,
    MOVES,
    NOW,
    ROLLED,
    SIN,
    STRUCK,
    SUM,
    TURN,
    WORK,
    WORK_ON_A,
    X,
    Y,
    is_elastic,
    pack_rows,
)
from rigdda.dynamics.slots import start_slots
from rigdda.kernel import inlined, kernel, stage


@inlined
def fall(body: Body, p: Parameters, ledger: NDArray) -> None:
    """Move a body without contacts; weight, loads and damping are constant over the step."""
    alpha, dt = p.damping, p.dt
    mass, inertia = (
        inertia_stiffness(body.mass, alpha, dt),
        inertia_stiffness(body.inertia, alpha, dt),
    )
    moment = load_moment(body, p.dt)
    fx, fy = body.mass * p.field_x + body.force_x, body.mass * p.field_y + body.force_y
    dx = (inertia_force(body.mass, body.vx, dt) + fx) / mass
    dy = (inertia_force(body.mass, body.vy, dt) + fy) / mass
    turn = (inertia_force(body.inertia, body.omega, dt) + moment) / inertia
    slow = body.mass * (dx * dx + dy * dy) + body.inertia * turn * turn
    ledger[2] -= alpha * slow / dt
    ledger[3] += (fx - body.mass * p.gravity_x) * dx + (fy - body.mass * p.gravity_y) * dy
    ledger[3] += moment * turn
    body.vx, body.vy = 2.0 * dx / dt - body.vx, 2.0 * dy / dt - body.vy
    body.omega = 2.0 * turn / dt - body.omega
    body.x += dx
    body.y += dy
    body.theta += turn


@inlined
def stop_fence(body: Body, p: Parameters, ledger: NDArray) -> None:
    """Decelerate a fence without contacts by its brake."""
    deceleration = body.brake / body.mass
    time = min(p.dt, max(body.vx, 0.0) / deceleration)
    speed = body.vx - deceleration * time
    ledger[4] -= 0.5 * body.mass * (body.vx * body.vx - speed * speed)
    body.x += 0.5 * (body.vx + speed) * time
    body.vx = speed


@inlined
def take_slot(body: Body, slot: Floats, scale: Floats, p: Parameters, ledger: NDArray) -> None:
    """Move a body to the position in its slot, and account for the work of weight and loads.

    Contacts that act at one instant of the step, and position correction, also move bodies against
    weight and loads. This work counts as impact.
    """
    if body.brake > 0.0:
        body.vx, body.x = slot[NOW] * slot[MOVES], slot[X]
        return
    dx, dy, turn = slot[X] - body.x, slot[Y] - body.y, slot[TURN]
    fx, fy = body.mass * p.field_x + body.force_x, body.mass * p.field_y + body.force_y
    moment = load_moment(body, p.dt)
    ledger[1] += slot[FIELD] - (fx * dx + fy * dy + moment * turn)
    ledger[3] += (fx - body.mass * p.gravity_x) * dx + (fy - body.mass * p.gravity_y) * dy
    ledger[3] += moment * turn
    body.vx, body.vy = slot[NOW] * scale[0], slot[NOW + 1] * scale[1]
    body.omega = slot[NOW + 2] * scale[2]
    body.x, body.y = slot[X], slot[Y]
    body.theta += turn


@kernel
def island_speed(bodies: Bodies, islands: Islands, low: int, high: int) -> float:
    """Return the greatest speed of the blocks low:high [m/s]."""
    speed = 0.0
    for place in range(low, high):
        speed = max(speed, top_speed(bodies[islands.block_item[place]]))
    return speed


@kernel
def is_tried_whole(
    bodies: Bodies, contacts: Contacts, islands: Islands, island: int, quiet: bool, p: Parameters
) -> bool:
    """Return whether an island is solved as a whole before relaxation is tried.

    That is the case in static mode, for islands with the paper's contacts, for a lone block with
    supports, for blocks that touch nothing but their supports, and for `quiet` islands with
    supports, with unbroken joints, or that were solved as a whole in the last step. It is never the
    case for an island with a fence, because a fence has no entries in the system of equations.
    """
    required, bonds, rested, only = p.static, False, True, True
    low, high = islands.block_start[island], islands.block_start[island + 1]
    for place in range(low, high):
        body = bodies[islands.block_item[place]]
        if body.brake > 0.0:
            return False
        rested = rested and body.whole
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        required = required or c.kind == PLAIN or (high - low == 1 and is_elastic(c))
        bonds = bonds or c.bond > 0.0 or is_elastic(c)
        only = only and is_elastic(c)
    return required or only or (quiet and (bonds or rested))


@stage
def settle_island(
    world: World, contacts: Contacts, work: Work, island: int, p: Parameters, totals: Totals
) -> bool:
    """Compute the contact forces of an island and move its slots through the step.

    Some islands are solved as a whole first (`is_tried_whole`). All others, and those for which
    this fails, are relaxed. If relaxation does not converge, an island at rest is solved as a
    whole. Returns whether any contact had an impact.
    """
    bodies, links = world.bodies, world.links
    counters, ledger = totals.counters, totals.ledger
    islands, rows, m = work.islands, work.rows, work.matrix
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    pairs = pair_blocks(bodies, contacts, m, islands, c0, c1)
    speed = island_speed(bodies, islands, b0, b1)
    quiet = speed <= SLEEP_SPEED
    whole = struck = False
    tried = is_tried_whole(bodies, contacts, islands, island, quiet, p)
    if tried:
        whole = solve_states(bodies, links, contacts, work, island, pairs, p, counters)
        whole = whole or p.static
    start_slots(bodies, islands, rows, island, p)
    count = pack_rows(contacts, islands, rows, island)
    if not whole:
        counters[RELAXED] += 1
        damped = ledger[2]
        sweeps, struck, settled = relax(rows, b1 - b0, count, speed, p, ledger)
        counters[SWEEPS] += sweeps
        if quiet and not (settled or tried or has_fence(bodies, islands, b0, b1)):
            whole = solve_states(bodies, links, contacts, work, island, pairs, p, counters)
            if whole:
                ledger[2] = damped
                start_slots(bodies, islands, rows, island, p)
                pack_rows(contacts, islands, rows, island)
    for place in range(b0, b1):
        bodies[islands.block_item[place]].whole = whole
    if whole:
        take_solution(bodies, contacts, m, islands, rows, island, p, ledger)
        for item in range(c0, c1):
            accumulate_force(contacts[islands.contact_item[item]])
    else:
        take_impulses(contacts, islands, rows, c0, c1, p.dt)
    for s in range(b1 - b0):
        slot = rows.slot[s]
        slot[COS], slot[SIN] = math.cos(slot[TURN]), math.sin(slot[TURN])
        if slot[BRAKE] > 0.0:  # position correction does not move fences
            rows.scale[s, 0] = 0.0
    return struck and not whole


@kernel
def has_fence(bodies: Bodies, islands: Islands, low: int, high: int) -> bool:
    """Return whether one of the bodies low:high of the islands is a fence."""
    found = False
    for place in range(low, high):
        found = found or bodies[islands.block_item[place]].brake > 0.0
    return found


@kernel
def take_impulses(
    contacts: Contacts, islands: Islands, rows: Rows, low: int, high: int, dt: float
) -> None:
    """Set force and state of each contact of a relaxed island from the impulses of its row.

    The normal and shear forces are means over the step; the accumulated forces are those at its
    end.
    """
    for item in range(low, high):
        c, k = contacts[islands.contact_item[item]], rows.place[item]
        row, fact = rows.row[k], rows.fact[k]
        c.normal, c.shear, c.roll = fact[SUM] / dt, fact[SUM + 1] / dt, fact[SUM + 2] / dt
        c.accumulated_normal, c.accumulated_shear = row[IMPULSE], row[IMPULSE + 1]
        c.accumulated_roll = row[ROLLED]
        c.struck = int(fact[STRUCK])
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.bond > 0.0:
            if not joint_breaks(contacts, islands, low, high, item):
                c.state, c.kind, c.kappa = STICK, REST, c.stiffness
                continue
        if c.kind == BOLT or c.kind == PIN:
            c.state = SLIP if c.normal == -c.tension else STICK
            continue
        within = c.cohesion + c.friction * max(c.normal, 0.0) > abs(c.shear)
        c.state = OPEN if c.normal == 0.0 else (STICK if within else SLIP)


@kernel
def accumulate_force(c: Contact) -> None:
    """Carry the force of a contact of an island that was solved as a whole to the next step."""
    c.struck = 0
    if c.state == OPEN:
        c.accumulated_normal = c.accumulated_shear = c.accumulated_roll = 0.0
    else:
        c.accumulated_normal, c.accumulated_shear = c.normal, c.shear
        c.accumulated_roll = c.roll


@inlined
def account_contacts(
    bodies: Bodies, contacts: Contacts, islands: Islands, rows: Rows, low: int, high: int,
    monitors: Monitors, p: Parameters, ledger: NDArray,
) -> None:  # fmt: skip
    """Add the work of contacts to the ledger and the barriers, and note which bodies touch."""
    for item in range(low, high):
        c, row = contacts[islands.contact_item[item]], rows.fact[rows.place[item]]
        support = c.kind == BOLT or c.kind == PIN
        block, barrier = barrier_contact(monitors, c.a, c.b)
        if barrier >= 0:
            own = row[WORK_ON_A]
            work = own if block == c.a else row[WORK] + row[WORK + 1] - own
            monitors.target[barrier].absorbed -= work
        if support:
            ledger[4] += row[WORK] + row[WORK + 1]
        else:
            ledger[0] += row[WORK + 1]
            ledger[1] += row[WORK]
        if c.state == OPEN:  # impulses that a rebound takes back do work as well
            continue
        if len(monitors.target) > 0:
            press(c, monitors, p.dt)
        bodies[c.a].touching = True
        if c.b >= 0:
            bodies[c.b].touching = True


@inlined
def check_body(bodies: Bodies, i: int, p: Parameters, ledger: NDArray) -> int:
    """Retire a body that has left the site; return i if the body diverged, else -1."""
    body = bodies[i]
    bad = -1
    if not top_speed(body) < SPEED_LIMIT:
        bad = i
    elif body.y < p.floor:
        ledger[1] -= retire(body)
    return bad


@inlined
def end_body(
    bodies: Bodies, outlines: Outlines, i: int, before: tuple[float, float, float], p: Parameters,
    ledger: NDArray,
) -> int:  # fmt: skip
    """Update the corners of a body that has moved, and retire a body that has left the site.

    `before` holds its previous angle, x and y. Returns i if the body diverged, else -1.
    """
    if p.post_correction:
        place_corners(bodies, outlines, i)
    else:
        move_corners(bodies, outlines, i, before)
    return check_body(bodies, i, p, ledger)


@stage
def step_island(
    world: World, contacts: Contacts, work: Work, monitors: Monitors, time: float, island: int,
    p: Parameters, totals: Totals,
) -> int:  # fmt: skip
    """Advance an island by one step.

    Returns a body that diverged, or -1.
    """
    bodies, outlines = world.bodies, world.outlines
    counters, ledger = totals.counters, totals.ledger
    islands, rows = work.islands, work.rows
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    bad = -1
    for place in range(b0, b1):
        bodies[islands.block_item[place]].touching = False
    if c1 > c0:
        struck = settle_island(world, contacts, work, island, p, totals)
        if len(monitors.target) > 0:
            counters[EVENTS] = note_hits(
                bodies, contacts, islands, c0, c1, monitors, counters[EVENTS], time
            )
        account_contacts(bodies, contacts, islands, rows, c0, c1, monitors, p, ledger)
        push_out(contacts, islands, rows, island, struck, p)
    for place in range(b0, b1):
        i = islands.block_item[place]
        before = bodies[i].theta, bodies[i].x, bodies[i].y
        if c1 > c0:
            take_slot(bodies[i], rows.slot[place - b0], rows.scale[place - b0], p, ledger)
        elif bodies[i].brake > 0.0:
            stop_fence(bodies[i], p, ledger)
        else:
            fall(bodies[i], p, ledger)
        bad = max(bad, end_body(bodies, outlines, i, before, p, ledger))
    return bad
