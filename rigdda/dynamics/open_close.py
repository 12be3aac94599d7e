"""Open-close iteration: solve an island as a whole until contact states and forces agree.

`next_state` decides the state of each contact: a closed contact must press, an open contact must
not overlap, a sticking contact must stay within its friction limit, and a slipping contact must
slip against its friction. `island_step.is_tried_whole` lists the islands that are solved this way
first, such as all islands in static mode. Otherwise, an island is relaxed
(`rigdda.dynamics.relaxation`), and solved this way only if it is at rest and relaxation does not
converge.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Matrix, Rows, Scratch, Work
from rigdda.dynamics.constants import BLOCK_PCG, BOLT, DIRECT, OPEN, PIN, SETTLED, SLIP, SOR, STICK
from rigdda.dynamics.contact.joint import joint_breaks
from rigdda.dynamics.contact.law import set_law
from rigdda.dynamics.contact.links import bend_bolt
from rigdda.dynamics.equations import (
    add_force,
    assemble_blocks,
    assemble_island,
    load_moment,
    normal_row,
    relative_displacement,
    rolling_row,
    shear_row,
)
from rigdda.dynamics.records import (
    ITERATIONS,
    SOLVER_ITERATIONS,
    SOLVES,
    STEPS,
    Bodies,
    Contact,
    Contacts,
    Links,
    Parameters,
)
from rigdda.dynamics.rows import FIELD, NOW, TURN, WORK, WORK_ON_A, X, Y
from rigdda.dynamics.solvers import profile, solve_block, solve_pcg, solve_skyline, solve_sor
from rigdda.kernel import inlined, kernel


@inlined
def spring_forces(c: Contact, d: NDArray, i: int, j: int, dt: float) -> tuple[float, float, float]:
    """Return the normal force of a contact, and its shear and rolling force if it sticks [N]."""
    dn, ds, dr = relative_displacement(c, d, i, j)
    normal = c.kappa * (c.bias - (2.0 * dn - dt * c.un))
    shear = c.accumulated_shear - c.kappa * (2.0 * ds - dt * c.us)
    roll = c.accumulated_roll - c.kappa * (2.0 * dr - dt * c.ur)
    return normal, shear, roll


@kernel
def next_state_of_link(c: Contact, normal: float, shear: float) -> bool:
    """Update the state of a support; return whether it changed.

    A bolt is in state SLIP while it yields. A pin holds any force.
    """
    c.normal, c.shear = max(normal, -c.tension), 0.0 if c.kind == BOLT else shear
    before = c.state
    c.state = SLIP if normal < -c.tension else STICK
    return c.state != before


@kernel
def next_friction(c: Contact, shear: float) -> bool:
    """Apply Coulomb friction to a closed contact by a return mapping; return whether it changed."""
    state, limit = c.state, c.friction * c.normal
    c.shear = min(max(shear, -limit), limit)
    if abs(shear) <= limit:
        c.state = STICK
        return state != STICK
    change = abs(c.shear - c.lag) if state == SLIP else math.inf
    c.state = SLIP
    c.lag = c.shear
    return change > SETTLED * limit


@kernel
def next_rolling(c: Contact, roll: float) -> bool:
    """Apply rolling resistance to a closed contact as friction; return whether it changed."""
    turned, before, limit = c.turns, c.roll, c.rolling * c.normal
    c.roll = min(max(roll, -limit), limit)
    c.turns = int(abs(roll) > limit)
    if c.turns != turned:
        return True
    return c.turns == 1 and abs(c.roll - before) > SETTLED * limit


@inlined
def next_state(c: Contact, normal: float, shear: float, roll: float, breaks: bool) -> bool:
    """Update the state of a contact from its forces; return whether it changed.

    `breaks` is whether these forces have broken the joint of the contact.
    """
    if c.kind == BOLT or c.kind == PIN:
        return next_state_of_link(c, normal, shear)
    if c.state == OPEN:
        if normal > 0.0:
            c.state = STICK
        return normal > 0.0
    if c.bond > 0.0:
        c.normal, c.shear = normal, shear
        return False
    if breaks and normal >= 0.0:
        return True
    if normal < 0.0:
        c.state = OPEN
        return True
    c.normal = normal
    slips = next_friction(c, shear)
    return next_rolling(c, roll) or slips


@inlined
def update_states(
    contacts: Contacts, d: NDArray, islands: Islands, low: int, high: int, p: Parameters
) -> bool:
    """Update the state of every contact of an island; return whether any changed."""
    changed = False
    for item in range(low, high if p.bonded else low):
        c = contacts[islands.contact_item[item]]
        if c.bond > 0.0:
            j = islands.slot[c.b] if c.pair >= 0 else -1
            c.normal, c.shear, _ = spring_forces(c, d, islands.slot[c.a], j, p.dt)
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        i = islands.slot[c.a]
        j = islands.slot[c.b] if c.pair >= 0 else -1
        normal, shear, roll = spring_forces(c, d, i, j, p.dt)
        breaks = c.bond > 0.0 and joint_breaks(contacts, islands, low, high, item)
        changed = next_state(c, normal, shear, roll, breaks) or changed
    return changed


@kernel
def bend_bolts(
    bodies: Bodies, links: Links, contacts: Contacts, d: NDArray, islands: Islands, low: int,
    high: int,
) -> float:  # fmt: skip
    """Set the directions of all bolts of an island; return the greatest change [-]."""
    most = 0.0
    for item in range(low, high if len(links) > 0 else low):
        c = contacts[islands.contact_item[item]]
        if c.kind == BOLT:
            j = islands.slot[c.b] if c.pair >= 0 else -1
            link = links[-1 - c.key]
            most = max(most, bend_bolt(bodies, link, c, d, islands.slot[c.a], j))
    return most


@kernel
def solve_system(m: Matrix, scratch: Scratch, n: int, pairs: int, p: Parameters) -> int:
    """Solve for the displacements of an island; return the iterations, 0 for a direct solution."""
    if n == 1:
        solve_block(m.diagonal[0], m.rhs[0], m.d[0])
        return 0
    if p.solver == SOR:
        return solve_sor(m, scratch, n, pairs, p.tolerance, p.relaxation)
    if p.solver == DIRECT:
        count = profile(m, scratch, n, pairs)
        if count <= len(scratch.factor):
            solve_skyline(m, scratch, n, pairs, count)
            return 0
    return solve_pcg(m, scratch, n, pairs, p.tolerance, p.solver == BLOCK_PCG)


@kernel
def solve_states(
    bodies: Bodies, links: Links, contacts: Contacts, work: Work, island: int, pairs: int,
    p: Parameters, counters: NDArray,
) -> bool:  # fmt: skip
    """Iterate until no contact of the island changes its state; return whether that was reached.

    Afterwards `normal` and `shear` of each contact hold its forces, zero if it is open.
    """
    islands, m = work.islands, work.matrix
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    n = b1 - b0
    for item in range(c0, c1):
        c = contacts[islands.contact_item[item]]
        if c.kind != BOLT and c.kind != PIN:
            set_law(bodies, c, counters[STEPS] == 0, p)
    for s in range(n):
        body = bodies[islands.block_item[b0 + s]]
        m.d[s, 0], m.d[s, 1], m.d[s, 2] = body.vx * p.dt, body.vy * p.dt, body.omega * p.dt
    bend_bolts(bodies, links, contacts, m.d, islands, c0, c1)
    for _ in range(p.iterations):
        assemble_island(bodies, contacts, m, islands, island, pairs, p)
        counters[ITERATIONS] += 1
        counters[SOLVES] += 1
        counters[SOLVER_ITERATIONS] += solve_system(m, work.scratch, n, pairs, p)
        changed = update_states(contacts, m.d, islands, c0, c1, p)
        bent = bend_bolts(bodies, links, contacts, m.d, islands, c0, c1)
        if not changed and bent <= p.tolerance:
            return True
    for s in range(n):
        m.d[s, 0] = m.d[s, 1] = m.d[s, 2] = 0.0
    bend_bolts(bodies, links, contacts, m.d, islands, c0, c1)  # back to the start of the step
    return False


@inlined
def take_solution(
    bodies: Bodies, contacts: Contacts, m: Matrix, islands: Islands, rows: Rows, island: int,
    p: Parameters, ledger: NDArray,
) -> None:  # fmt: skip
    """Move the slots of an island by its forces; set the work of contacts and of damping.

    The forces are applied here once more, exactly and in equal and opposite pairs, so that momentum
    is conserved to rounding whatever the residual of the solver.
    """
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    assemble_blocks(bodies, m, islands, b0, b1, p)
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.state != OPEN:
            i = islands.slot[c.a]
            add_force(m.rhs[i], c.normal, normal_row(c, True))
            add_force(m.rhs[i], c.shear, shear_row(c, True))
            add_force(m.rhs[i], c.roll, rolling_row(c, True))
            if c.pair >= 0:
                j = islands.slot[c.b]
                add_force(m.rhs[j], c.normal, normal_row(c, False))
                add_force(m.rhs[j], c.shear, shear_row(c, False))
                add_force(m.rhs[j], c.roll, rolling_row(c, False))
    for s in range(b1 - b0):
        for q in range(3):
            m.d[s, q] = m.rhs[s, q] / m.diagonal[s, q, q]
    for s in range(b1 - b0):
        body, d, slot = bodies[islands.block_item[b0 + s]], m.d[s], rows.slot[s]
        slow = body.mass * (d[0] ** 2 + d[1] ** 2) + body.inertia * d[2] ** 2
        ledger[2] -= p.damping * slow / p.dt
        slot[FIELD] = (body.mass * p.field_x + body.force_x) * d[0]
        slot[FIELD] += (body.mass * p.field_y + body.force_y) * d[1] + load_moment(body, p.dt) * d[
            2
        ]
        for q in range(3):
            slot[NOW + q] = 2.0 * d[q] / (p.dt * rows.scale[s, q]) - slot[NOW + q]
        slot[X] += d[0]
        slot[Y] += d[1]
        slot[TURN] += d[2]
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c, row = contacts[islands.contact_item[item]], rows.fact[rows.place[item]]
        if c.state == OPEN:
            continue
        i, j = islands.slot[c.a], islands.slot[c.b] if c.pair >= 0 else -1
        dn, ds, dr = relative_displacement(c, m.d, i, -1)
        row[WORK_ON_A] = c.normal * dn + c.shear * ds + c.roll * dr
        dn, ds, dr = relative_displacement(c, m.d, i, j)
        row[WORK], row[WORK + 1] = c.normal * dn, c.shear * ds + c.roll * dr
