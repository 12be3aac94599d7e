"""Open-close iteration: find the state of every contact of an island with which the forces agree.

A closed contact must press, an open one must not overlap, a sticking one must stay within its
friction limit, a slipping one must slip against its friction.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.assembly.inertia import inertia_force, inertia_stiffness
from rigdda.assembly.springs import add_block, add_force, along, normal_row, shear_row
from rigdda.constants import (
    AUTO,
    BLOCK_PCG,
    BOLT,
    DIRECT,
    ENERGY_HALVINGS,
    FEW_MOVING,
    FLIPS,
    FRICTION_TOLERANCE,
    IMPACT,
    MOVING,
    ONE_BY_ONE,
    OPEN,
    OPENING_TOLERANCE,
    PATIENCE,
    PIN,
    PLAIN,
    QUIET_SPEED,
    REST,
    SHOCK_SPEED,
    SHORT_PROFILE,
    SLIP,
    SMALL_ISLAND,
    SOR,
    STICK,
    WAIT_STEPS,
)
from rigdda.contact.joint import break_joint
from rigdda.contact.law import set_shock
from rigdda.islands import pair_blocks
from rigdda.kernel import kernel
from rigdda.linear.direct import solve_block, solve_two_blocks
from rigdda.linear.pcg import solve_pcg
from rigdda.linear.psor import relax_forces
from rigdda.linear.skyline import profile, solve_skyline
from rigdda.linear.sor import solve_sor
from rigdda.motion import top_speed
from rigdda.records import (
    ITERATIONS,
    RELAXED,
    SOLVER_ITERATIONS,
    SOLVES,
    SWEEPS,
    Bodies,
    Contacts,
    Matrix,
    Parameters,
    Work,
)

NONE, MOVED, LOCKED = 0, 1, 2


@kernel
def damping_of(bodies: Bodies, i: int, p: Parameters) -> float:
    """Return the damping coefficient of block i in this step [1/s]."""
    if p.damping_in_contact_only and bodies[i].touching == 0:
        return 0.0
    return p.damping


@kernel
def load_moment(bodies: Bodies, i: int) -> float:
    """Return the moment of the dead loads of block i about its centroid [N m]."""
    if bodies[i].moment_cos == 0.0 and bodies[i].moment_sin == 0.0:
        return 0.0
    theta = bodies[i].theta
    return bodies[i].moment_cos * math.cos(theta) + bodies[i].moment_sin * math.sin(theta)


@kernel
def assemble_blocks(
    bodies: Bodies, m: Matrix, work: Work, low: int, high: int, p: Parameters
) -> None:
    """Set the diagonal blocks and forces of inertia, damping, weight and loads."""
    for place in range(low, high):
        i, s = work.block_item[place], place - low
        alpha = damping_of(bodies, i, p)
        inertia = inertia_stiffness(bodies[i].inertia, alpha, p.dt)
        mass = inertia_stiffness(bodies[i].mass, alpha, p.dt)
        for a in range(3):
            for b in range(3):
                m.diagonal[s, a, b] = 0.0
        m.diagonal[s, 0, 0] = m.diagonal[s, 1, 1] = mass
        m.diagonal[s, 2, 2] = inertia
        m.rhs[s, 0] = inertia_force(bodies[i].mass, bodies[i].vx, p.dt)
        m.rhs[s, 1] = inertia_force(bodies[i].mass, bodies[i].vy, p.dt)
        m.rhs[s, 2] = inertia_force(bodies[i].inertia, bodies[i].omega, p.dt)
        m.rhs[s, 0] += bodies[i].mass * work.field[0] + bodies[i].force_x
        m.rhs[s, 1] += bodies[i].mass * work.field[1] + bodies[i].force_y
        m.rhs[s, 2] += load_moment(bodies, i)


@kernel
def assemble_contact(
    c: Contacts, k: int, m: Matrix, i: int, j: int, dt: float, coupled: bool
) -> None:
    """Add the springs of closed contact k between slots i and j (-1: no unknowns).

    On the displacement d of the step the spring N = kappa (b - dt u_1) has stiffness 2 kappa and
    force kappa (b + dt u_0). The friction of a slipping contact is a force; `coupled` takes it
    from the unknown normal force, which makes the matrix of one or two blocks unsymmetric.
    """
    stiffness = 2.0 * c[k].kappa
    normal = c[k].kappa * (c[k].bias + dt * c[k].un)
    shear = c[k].memory_shear + c[k].kappa * dt * c[k].us
    en, es = normal_row(c, k, True), shear_row(c, k, True)
    bolt = c[k].kind == BOLT
    if bolt and c[k].state == SLIP:  # it yields
        stiffness, normal = 0.0, -c[k].tension
    add_block(m.diagonal[i], stiffness, en, en)
    add_force(m.rhs[i], normal, en)
    stick = c[k].state == STICK
    ratio = math.copysign(c[k].friction, c[k].lag) if coupled and not (stick or bolt) else 0.0
    if bolt:
        pass
    elif stick:
        add_block(m.diagonal[i], stiffness, es, es)
        add_force(m.rhs[i], shear, es)
    elif coupled:
        add_block(m.diagonal[i], stiffness * ratio, es, en)
        add_force(m.rhs[i], normal * ratio, es)
    else:
        add_force(m.rhs[i], c[k].lag, es)
    if j < 0:
        return
    fn, fs = normal_row(c, k, False), shear_row(c, k, False)
    add_block(m.diagonal[j], stiffness, fn, fn)
    add_block(m.off[c[k].pair], stiffness, en, fn)
    add_force(m.rhs[j], normal, fn)
    if coupled:
        add_block(m.lower, stiffness, fn, en)
    if bolt:
        return
    if stick:
        add_block(m.diagonal[j], stiffness, fs, fs)
        add_block(m.off[c[k].pair], stiffness, es, fs)
        add_force(m.rhs[j], shear, fs)
        if coupled:
            add_block(m.lower, stiffness, fs, es)
    elif coupled:
        add_block(m.diagonal[j], stiffness * ratio, fs, fn)
        add_block(m.off[c[k].pair], stiffness * ratio, es, fn)
        add_block(m.lower, stiffness * ratio, fs, en)
        add_force(m.rhs[j], normal * ratio, fs)
    else:
        add_force(m.rhs[j], c[k].lag, fs)


@kernel
def spring_forces(
    c: Contacts, k: int, m: Matrix, i: int, j: int, dt: float
) -> tuple[float, float, float]:
    """Return normal force, shear force if it stuck [N], and normal velocity after the step."""
    dn = along(normal_row(c, k, True), m.d[i])
    ds = along(shear_row(c, k, True), m.d[i])
    if j >= 0:
        dn += along(normal_row(c, k, False), m.d[j])
        ds += along(shear_row(c, k, False), m.d[j])
    after = 2.0 * dn / dt - c[k].un
    normal = c[k].kappa * (c[k].bias - dt * after)
    shear = c[k].memory_shear - c[k].kappa * (2.0 * ds - dt * c[k].us)
    return normal, shear, after


@kernel
def next_state_of_link(c: Contacts, k: int, normal: float, shear: float) -> int:
    """Let a bolt yield, or no more: SLIP stands for yielding; a pin holds whatever its force."""
    c[k].normal, c[k].shear = max(normal, -c[k].tension), 0.0 if c[k].kind == BOLT else shear
    state = SLIP if normal < -c[k].tension else STICK
    if state == c[k].state:
        return NONE
    if c[k].flips >= FLIPS:
        return LOCKED
    c[k].flips += 1
    c[k].state = state
    return MOVED


@kernel
def close(c: Contacts, k: int, normal: float, shear: float, coupled: bool) -> int:
    """Close contact k, which would bear these forces if it stuck; returns MOVED or LOCKED.

    Where friction is coupled to the normal force it slips at once if it slides faster than it
    closes: a contact that stuck would be torn open again.
    """
    if c[k].flips >= FLIPS:
        return LOCKED
    c[k].state = STICK
    if coupled and abs(shear) > c[k].friction * normal:
        c[k].state, c[k].lag = SLIP, shear
    return MOVED


@kernel
def next_friction(c: Contacts, k: int, shear: float, tension: float, coupled: bool) -> int:
    """Let closed contact k, whose normal force is set, stick or slip: a return mapping.

    Where friction is coupled to the normal force a slipping contact is settled if its direction
    is right.
    """
    state, limit = c[k].state, c[k].friction * c[k].normal
    c[k].shear = min(max(shear, -limit), limit)
    if abs(shear) <= limit:
        if state == STICK:
            return NONE
        if c[k].flips >= FLIPS:
            return LOCKED
        c[k].state = STICK
        c[k].flips += 1
        return MOVED
    change = abs(c[k].shear - c[k].lag) if state == SLIP else math.inf
    if coupled and state == SLIP and c[k].shear * math.copysign(1.0, c[k].lag) >= 0.0:
        change = 0.0
    c[k].state = SLIP
    c[k].lag = c[k].shear
    return MOVED if change > FRICTION_TOLERANCE * (limit - tension) else NONE


@kernel
def next_state(
    c: Contacts, k: int, normal: float, shear: float, weight: float, coupled: bool
) -> int:
    """Move contact k to the state that its forces ask for; returns NONE, MOVED or LOCKED.

    A contact that has flipped too often is LOCKED: it keeps its state and is at odds with it.
    """
    if c[k].kind == BOLT or c[k].kind == PIN:
        return next_state_of_link(c, k, normal, shear)
    tension = -OPENING_TOLERANCE * weight
    if c[k].state == OPEN:
        return NONE if normal <= -tension else close(c, k, normal, shear, coupled)
    if c[k].bond > 0.0:
        strength = c[k].cohesion + c[k].friction * max(normal, 0.0)
        if normal >= -c[k].tension and abs(shear) <= strength:
            c[k].normal, c[k].shear = normal, shear
            return NONE
        break_joint(c, k)
        if normal >= tension:
            return MOVED
    if normal < tension:
        c[k].state = OPEN
        c[k].flips += 1
        return MOVED
    c[k].normal = max(normal, 0.0)
    return next_friction(c, k, shear, tension, coupled)


@kernel
def update_states(
    bodies: Bodies, c: Contacts, m: Matrix, work: Work, low: int, high: int, coupled: bool,
    one: bool, p: Parameters,
) -> tuple[int, int]:  # fmt: skip
    """Move every contact of an island to its next state; returns how many moved and are locked.

    Or only the first that is at odds with its state, as often as it takes.
    """
    moved = locked = 0
    for item in range(low, high):
        k = work.contact_item[item]
        i = work.slot[c[k].a]
        j = work.slot[c[k].b] if c[k].pair >= 0 else -1
        normal, shear, after = spring_forces(c, k, m, i, j, p.dt)
        if c[k].state != OPEN and c[k].kind == REST and after < -SHOCK_SPEED:
            set_shock(bodies, c, k, p)
            moved += 1
            continue
        weight = bodies[c[k].a].mass * p.gravity
        if one:
            c[k].flips = 0
        change = next_state(c, k, normal, shear, weight, coupled)
        moved += change == MOVED
        locked += change == LOCKED
        if one and moved > 0:
            break
    return moved, locked


@kernel
def solve_island(m: Matrix, n: int, pairs: int, p: Parameters) -> int:
    """Solve for the displacements of an island; returns the iterations, 0 of a direct solution."""
    if p.solver == SOR:
        return solve_sor(m, n, pairs, p.tolerance, p.relaxation)
    if p.solver == DIRECT or p.solver == AUTO:
        count = profile(m, n, pairs)
        longest = len(m.factor) if p.solver == DIRECT else SHORT_PROFILE * 3 * n
        if count <= min(longest, len(m.factor)):
            solve_skyline(m, n, pairs, count)
            return 0
    return solve_pcg(m, n, pairs, p.tolerance, p.solver == BLOCK_PCG)


@kernel
def solve_states(
    bodies: Bodies, c: Contacts, m: Matrix, work: Work, island: int, pairs: int, p: Parameters,
    counters: NDArray,
) -> bool:  # fmt: skip
    """Iterate until no contact of the island changes; returns whether that was reached.

    Afterwards normal and shear of each contact hold its force, zero where it is open.
    """
    b0, b1 = work.block_start[island], work.block_start[island + 1]
    c0, c1 = work.contact_start[island], work.contact_start[island + 1]
    n = b1 - b0
    small = n <= SMALL_ISLAND
    for s in range(n):
        i = work.block_item[b0 + s]
        m.d[s, 0], m.d[s, 1] = bodies[i].vx * p.dt, bodies[i].vy * p.dt
        m.d[s, 2] = bodies[i].omega * p.dt
    few = 2 + (c1 - c0) // FEW_MOVING
    for iteration in range(PATIENCE * p.iterations):
        assemble_island(bodies, c, m, work, island, pairs, p)
        counters[ITERATIONS] += 1
        if n == 1:
            solve_block(m.diagonal[0], m.rhs[0], m.d[0])
        elif n == 2:
            solve_two_blocks(m)
        else:
            counters[SOLVES] += 1
            counters[SOLVER_ITERATIONS] += solve_island(m, n, pairs, p)
        one = small and iteration >= ONE_BY_ONE
        moved, locked = update_states(bodies, c, m, work, c0, c1, small, one, p)
        if moved == 0:
            return locked == 0
        if iteration >= p.iterations - 1 and moved > few:
            return False
    return False


@kernel
def assemble_island(
    bodies: Bodies, c: Contacts, m: Matrix, work: Work, island: int, pairs: int, p: Parameters
) -> None:
    """Set the system of an island with its contacts in their current states."""
    b0, b1 = work.block_start[island], work.block_start[island + 1]
    assemble_blocks(bodies, m, work, b0, b1, p)
    for a in range(3):
        for b in range(3):
            m.lower[a, b] = 0.0
            for q in range(max(pairs, 1)):
                m.off[q, a, b] = 0.0
    for item in range(work.contact_start[island], work.contact_start[island + 1]):
        k = work.contact_item[item]
        if c[k].state == OPEN:
            c[k].normal = c[k].shear = 0.0
        else:
            j = work.slot[c[k].b] if c[k].pair >= 0 else -1
            assemble_contact(c, k, m, work.slot[c[k].a], j, p.dt, b1 - b0 <= SMALL_ISLAND)


@kernel
def relax(
    bodies: Bodies,
    c: Contacts,
    m: Matrix,
    work: Work,
    island: int,
    p: Parameters,
    counters: NDArray,
    speed: float,
) -> None:
    """Find the forces of an island by projected relaxation, from those of the last step."""
    b0, b1 = work.block_start[island], work.block_start[island + 1]
    c0, c1 = work.contact_start[island], work.contact_start[island + 1]
    assemble_blocks(bodies, m, work, b0, b1, p)
    counters[RELAXED] += 1
    counters[SWEEPS] += relax_forces(c, m, work, c0, c1, b1 - b0, p.dt, speed, p.gravity)
    for item in range(c0, c1):
        k = work.contact_item[item]
        limit = c[k].cohesion + c[k].friction * max(c[k].normal, 0.0)
        within = limit > abs(c[k].shear)
        if c[k].bond > 0.0:
            if within and c[k].normal > -c[k].tension:
                c[k].state, c[k].kind = STICK, MOVING
                continue
            break_joint(c, k)
        kind = c[k].kind
        if kind == BOLT or kind == PIN:
            c[k].state = SLIP if c[k].normal == -c[k].tension else STICK
            continue
        c[k].state = OPEN if c[k].normal == 0.0 else (STICK if within else SLIP)
        if kind != IMPACT and kind != PLAIN:
            c[k].kind = MOVING


@kernel
def impact_work(c: Contacts, m: Matrix, work: Work, low: int, high: int, dt: float) -> float:
    """Return the work of the contact forces of an island in this step [J], supports left out.

    Friction that gives energy counts twice: to rebound out of a wedge a block would be pressed
    against its sides with any force, which friction there would have to yield.
    """
    total = 0.0
    for item in range(low, high):
        k = work.contact_item[item]
        if c[k].kind == BOLT or c[k].kind == PIN:
            continue
        i = work.slot[c[k].a]
        j = work.slot[c[k].b] if c[k].pair >= 0 else -1
        dn = along(normal_row(c, k, True), m.d[i])
        ds = along(shear_row(c, k, True), m.d[i])
        if j >= 0:
            dn += along(normal_row(c, k, False), m.d[j])
            ds += along(shear_row(c, k, False), m.d[j])
        total += c[k].normal * dn + c[k].shear * ds + max(c[k].shear * ds, 0.0)
    return total


@kernel
def island_speed(bodies: Bodies, work: Work, low: int, high: int) -> float:
    """Return the greatest speed of the blocks low:high [m/s]."""
    speed = 0.0
    for place in range(low, high):
        speed = max(speed, top_speed(bodies, work.block_item[place]))
    return speed


@kernel
def is_waiting(bodies: Bodies, work: Work, low: int, high: int) -> bool:
    """Return whether one of the blocks low:high did not settle a moment ago; counts down."""
    waiting = False
    for place in range(low, high):
        i = work.block_item[place]
        if bodies[i].wait > 0:
            bodies[i].wait -= 1
            waiting = True
    return waiting


@kernel
def let_wait(bodies: Bodies, work: Work, low: int, high: int) -> None:
    """Let the island of the blocks low:high be relaxed for a while before it is solved again."""
    for place in range(low, high):
        bodies[work.block_item[place]].wait = WAIT_STEPS


@kernel
def open_close(
    bodies: Bodies,
    c: Contacts,
    m: Matrix,
    work: Work,
    island: int,
    p: Parameters,
    counters: NDArray,
) -> bool:
    """Settle the contacts of an island, with less restitution where impacts would gain energy.

    Newton's restitution with friction can raise the kinetic energy of an eccentric impact; a
    plastic one cannot, since the springs act on the velocity after the step.

    Returns
    -------
    bool
        Whether they settled; a large island that did not is taken as it is.
    """
    c0, c1 = work.contact_start[island], work.contact_start[island + 1]
    bouncing = False
    for item in range(c0, c1):
        k = work.contact_item[item]
        bouncing = bouncing or (c[k].kind == IMPACT and c[k].bias > 0.0)
    pairs = pair_blocks(bodies, c, m, work, c0, c1)
    b0, b1 = work.block_start[island], work.block_start[island + 1]
    speed = island_speed(bodies, work, b0, b1)
    waiting = is_waiting(bodies, work, b0, b1)
    small, settled = b1 - b0 <= SMALL_ISLAND, True
    relaxing = not small and (waiting or speed > QUIET_SPEED)
    for halving in range(ENERGY_HALVINGS + 2):
        if not relaxing:
            relaxing = not solve_states(bodies, c, m, work, island, pairs, p, counters)
            settled = settled and not (relaxing and small)
            if relaxing and not small:
                let_wait(bodies, work, b0, b1)
        if relaxing:
            relax(bodies, c, m, work, island, p, counters, speed)
        if not bouncing or impact_work(c, m, work, c0, c1, p.dt) <= 0.0:
            return settled
        for item in range(c0, c1):
            k = work.contact_item[item]
            c[k].flips = 0
            if c[k].kind == IMPACT:
                c[k].bias *= 0.5 if halving < ENERGY_HALVINGS else 0.0
                c[k].state = STICK
    return settled
