"""Open-close iteration: find the state of every contact of an island with which the forces agree.

Which state that is `states` says. What does not settle, and islands of more than two blocks that
move, are relaxed.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Matrix, Motion, Rows, Scratch, System
from rigdda.dynamics.assembly.island import assemble_blocks, assemble_island
from rigdda.dynamics.constants import (
    BLOCK_PCG,
    BOLT,
    DIRECT,
    IMPACT,
    NEW,
    OPEN,
    PIN,
    PLAIN,
    QUIET_SPEED,
    REST,
    SLIP,
    SMALL_ISLAND,
    SOR,
    STICK,
    WAIT_STEPS,
)
from rigdda.dynamics.contact.joint import joint_breaks
from rigdda.dynamics.islands import pair_blocks
from rigdda.dynamics.linear.direct import solve_block, solve_two_blocks
from rigdda.dynamics.linear.pcg import solve_pcg
from rigdda.dynamics.linear.relaxation import relax_forces
from rigdda.dynamics.linear.rows import take_forces
from rigdda.dynamics.linear.skyline import profile, solve_skyline
from rigdda.dynamics.linear.sor import solve_sor
from rigdda.dynamics.motion import top_speed
from rigdda.dynamics.rebound import ask_rebound, impact_work, set_rebound
from rigdda.dynamics.records import (
    ITERATIONS,
    RELAXED,
    SOLVER_ITERATIONS,
    SOLVES,
    SWEEPS,
    Bodies,
    Contacts,
    Parameters,
)
from rigdda.dynamics.states import update_states
from rigdda.kernel import kernel


@kernel
def solve_island(m: Matrix, scratch: Scratch, n: int, pairs: int, p: Parameters) -> int:
    """Solve for the displacements of an island; returns the iterations, 0 of a direct solution."""
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
    bodies: Bodies, contacts: Contacts, m: Matrix, scratch: Scratch, islands: Islands, island: int,
    pairs: int, p: Parameters, counters: NDArray,
) -> bool:  # fmt: skip
    """Iterate until no contact of the island changes; returns whether that was reached.

    Afterwards normal and shear of each contact hold its force, zero where it is open.
    """
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    n = b1 - b0
    for s in range(n):
        body = bodies[islands.block_item[b0 + s]]
        m.d[s, 0], m.d[s, 1], m.d[s, 2] = body.vx * p.dt, body.vy * p.dt, body.omega * p.dt
    for _ in range(p.iterations):
        assemble_island(bodies, contacts, m, islands, island, pairs, p)
        counters[ITERATIONS] += 1
        if n == 1:
            solve_block(m.diagonal[0], m.rhs[0], m.d[0])
        elif n == 2:
            solve_two_blocks(m, scratch.dense)
        else:
            counters[SOLVES] += 1
            counters[SOLVER_ITERATIONS] += solve_island(m, scratch, n, pairs, p)
        if not update_states(bodies, contacts, m.d, islands, c0, c1, n <= SMALL_ISLAND, p):
            return True
    return False


@kernel
def relax(
    bodies: Bodies, contacts: Contacts, m: Matrix, motion: Motion, islands: Islands, rows: Rows,
    island: int, p: Parameters, counters: NDArray, speed: float,
) -> None:  # fmt: skip
    """Find the forces of an island by relaxation; set the state of each contact from its force."""
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    assemble_blocks(bodies, m, islands, b0, b1, p)
    counters[RELAXED] += 1
    counters[SWEEPS] += relax_forces(
        bodies, contacts, m.rhs, motion, islands, rows, island, speed, p
    )
    for item in range(c0, c1):
        c = contacts[islands.contact_item[item]]
        take_forces(c, rows.row[rows.place[item]])
    for item in range(c0, c1):
        c = contacts[islands.contact_item[item]]
        limit = c.cohesion + c.friction * max(c.normal, 0.0)
        within = limit > abs(c.shear)
        if c.bond > 0.0:
            if not joint_breaks(contacts, islands, c0, c1, item):
                c.state, c.kind, c.kappa = STICK, REST, c.stiffness
                continue
        kind = c.kind
        if kind == BOLT or kind == PIN:
            c.state = SLIP if c.normal == -c.tension else STICK
            continue
        c.state = OPEN if c.normal == 0.0 else (STICK if within else SLIP)
        if kind != IMPACT and kind != PLAIN:
            c.kind, c.kappa = NEW if kind == NEW else REST, c.stiffness


@kernel
def island_speed(bodies: Bodies, islands: Islands, low: int, high: int) -> float:
    """Return the greatest speed of the blocks low:high [m/s]."""
    speed = 0.0
    for place in range(low, high):
        speed = max(speed, top_speed(bodies[islands.block_item[place]]))
    return speed


@kernel
def is_waiting(bodies: Bodies, islands: Islands, low: int, high: int) -> bool:
    """Return whether one of the blocks low:high did not settle a moment ago."""
    waiting = False
    for place in range(low, high):
        waiting = waiting or bodies[islands.block_item[place]].wait > 0
    return waiting


@kernel
def let_wait(bodies: Bodies, islands: Islands, low: int, high: int) -> None:
    """Let the island of the blocks low:high be relaxed for a while before it is solved again."""
    for place in range(low, high):
        bodies[islands.block_item[place]].wait = WAIT_STEPS


@kernel
def open_close(
    bodies: Bodies, contacts: Contacts, system: System, islands: Islands, rows: Rows, island: int,
    p: Parameters, counters: NDArray,
) -> bool:  # fmt: skip
    """Settle the contacts of an island: solve or relax; lessen restitution that gains energy.

    The open-close iteration itself is `solve_states`. Islands at rest, and those of one or two
    blocks, are solved as one. Others are relaxed; so is, for a while, what did not settle.

    Restitution with friction can raise the kinetic energy of an eccentric impact. A plastic impact
    cannot, since the springs act on the velocity after the step. So impacts are settled as asked;
    if that gains, as plastic ones; then with a share of restitution. Energy is quadratic in the
    velocities, so the gain is convex in that share. Where the chord from plastic to asked is zero,
    the gain is zero at most.

    Returns
    -------
    bool
        Whether the displacements that relaxation found are to be used. False if the island was
        solved as one, and of a relaxed cluster in flight: its impulses act at one time, so that its
        angular momentum is kept.
    """
    c0, c1 = islands.contact_start[island], islands.contact_start[island + 1]
    m, motion = system.matrix, system.motion
    pairs, grounded = pair_blocks(bodies, contacts, m, islands, c0, c1)
    bouncing = ask_rebound(contacts, islands, c0, c1)
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    speed = island_speed(bodies, islands, b0, b1)
    waiting = is_waiting(bodies, islands, b0, b1)
    small, quiet = b1 - b0 <= SMALL_ISLAND, speed <= QUIET_SPEED
    relaxing = waiting if quiet else not small
    asked = 0.0
    for attempt in range(4):  # as asked, plastic, between them, and plastic if that gains, too
        if not relaxing:
            settled = solve_states(
                bodies, contacts, m, system.scratch, islands, island, pairs, p, counters
            )
            relaxing = not settled and not p.static
            if relaxing and not small:
                let_wait(bodies, islands, b0, b1)
        if relaxing:
            relax(bodies, contacts, m, motion, islands, rows, island, p, counters, speed)
        if not bouncing or attempt == 3:
            break
        work = impact_work(contacts, m.d, islands, c0, c1)
        if attempt == 0:
            asked, share = work, 0.0
        elif attempt == 1:
            share = work / (work - asked)
        else:
            share = 0.0
        if work <= 0.0 if attempt != 1 else work >= 0.0:
            break
        set_rebound(contacts, islands, c0, c1, share)
    return relaxing and grounded
