"""Open-close iteration: solve an island as a whole for states with which all its forces agree.

Which state a contact has `states` says. Islands at rest are solved like this, and all in static
mode; what moves is relaxed, see `relaxation`, and so is what does not settle.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Matrix, Rows, Scratch, Work
from rigdda.dynamics.assembly.island import (
    assemble_blocks,
    assemble_island,
    damping_of,
    load_moment,
)
from rigdda.dynamics.assembly.springs import add_force, along, normal_row, shear_row
from rigdda.dynamics.constants import BLOCK_PCG, DIRECT, OPEN, SOR
from rigdda.dynamics.linear.direct import solve_block
from rigdda.dynamics.linear.pcg import solve_pcg
from rigdda.dynamics.linear.skyline import profile, solve_skyline
from rigdda.dynamics.linear.sor import solve_sor
from rigdda.dynamics.records import (
    ITERATIONS,
    SOLVER_ITERATIONS,
    SOLVES,
    Bodies,
    Contacts,
    Parameters,
)
from rigdda.dynamics.rows import FIELD, NOW, TURN, WORK, WORK_ON_A, X, Y
from rigdda.dynamics.states import update_states
from rigdda.kernel import inlined, kernel


@kernel
def solve_system(m: Matrix, scratch: Scratch, n: int, pairs: int, p: Parameters) -> int:
    """Solve for the displacements of an island; returns the iterations, 0 of a direct solution."""
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
    bodies: Bodies, contacts: Contacts, work: Work, island: int, pairs: int, p: Parameters,
    counters: NDArray,
) -> bool:  # fmt: skip
    """Iterate until no contact of the island changes; returns whether that was reached.

    Afterwards normal and shear of each contact hold its force, zero where it is open.
    """
    islands, m = work.islands, work.matrix
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    n = b1 - b0
    for s in range(n):
        body = bodies[islands.block_item[b0 + s]]
        m.d[s, 0], m.d[s, 1], m.d[s, 2] = body.vx * p.dt, body.vy * p.dt, body.omega * p.dt
    for _ in range(p.iterations):
        assemble_island(bodies, contacts, m, islands, island, pairs, p)
        counters[ITERATIONS] += 1
        counters[SOLVES] += 1
        counters[SOLVER_ITERATIONS] += solve_system(m, work.scratch, n, pairs, p)
        if not update_states(contacts, m.d, islands, c0, c1, p):
            return True
    return False


@inlined
def take_solution(
    bodies: Bodies, contacts: Contacts, m: Matrix, islands: Islands, rows: Rows, island: int,
    p: Parameters, ledger: NDArray,
) -> None:  # fmt: skip
    """Move the slots of an island by its forces; set the work of contacts and of damping.

    Forces are applied equal and opposite here, once more and exactly, so that momentum is kept to
    rounding whatever the residual of the solver.
    """
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    assemble_blocks(bodies, m, islands, b0, b1, p)
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.state != OPEN:
            i = islands.slot[c.a]
            add_force(m.rhs[i], c.normal, normal_row(c, True))
            add_force(m.rhs[i], c.shear, shear_row(c, True))
            if c.pair >= 0:
                j = islands.slot[c.b]
                add_force(m.rhs[j], c.normal, normal_row(c, False))
                add_force(m.rhs[j], c.shear, shear_row(c, False))
    for s in range(b1 - b0):
        for q in range(3):
            m.d[s, q] = m.rhs[s, q] / m.diagonal[s, q, q]
    for s in range(b1 - b0):
        body, d, slot = bodies[islands.block_item[b0 + s]], m.d[s], rows.slot[s]
        slow = body.mass * (d[0] ** 2 + d[1] ** 2) + body.inertia * d[2] ** 2
        ledger[2] -= damping_of(body, p) * slow / p.dt
        slot[FIELD] = (body.mass * p.field_x + body.force_x) * d[0]
        slot[FIELD] += (body.mass * p.field_y + body.force_y) * d[1] + load_moment(body) * d[2]
        for q in range(3):
            slot[NOW + q] = 2.0 * d[q] / (p.dt * rows.scale[s, q]) - slot[NOW + q]
        slot[X] += d[0]
        slot[Y] += d[1]
        slot[TURN] += d[2]
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c, row = contacts[islands.contact_item[item]], rows.fact[rows.place[item]]
        if c.state == OPEN:
            continue
        dn = along(normal_row(c, True), m.d[islands.slot[c.a]])
        ds = along(shear_row(c, True), m.d[islands.slot[c.a]])
        row[WORK_ON_A] = c.normal * dn + c.shear * ds
        if c.pair >= 0:
            dn += along(normal_row(c, False), m.d[islands.slot[c.b]])
            ds += along(shear_row(c, False), m.d[islands.slot[c.b]])
        row[WORK], row[WORK + 1] = c.normal * dn, c.shear * ds
