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
    ENERGY_HALVINGS,
    FLIPS,
    FRICTION_TOLERANCE,
    IMPACT,
    OPEN,
    OPENING_TOLERANCE,
    REST,
    SHOCK,
    SHOCK_SPEED,
    SLIP,
    STICK,
)
from rigdda.contact.law import set_shock
from rigdda.islands import pair_blocks
from rigdda.kernel import kernel
from rigdda.linear.direct import solve_block
from rigdda.linear.pcg import solve_pcg
from rigdda.records import Bodies, Contacts, Matrix, Parameters, Work


@kernel
def damping_of(bodies: Bodies, i: int, p: Parameters) -> float:
    """Return the damping coefficient of block i in this step [1/s]."""
    if p.damping_in_contact_only and bodies.touching[i] == 0:
        return 0.0
    return p.damping


@kernel
def assemble_blocks(
    bodies: Bodies, m: Matrix, work: Work, low: int, high: int, p: Parameters
) -> None:
    """Set the diagonal blocks and forces of inertia, damping and weight."""
    for place in range(low, high):
        i, s = work.block_item[place], place - low
        alpha = damping_of(bodies, i, p)
        inertia = inertia_stiffness(bodies.inertia[i], alpha, p.dt)
        mass = inertia_stiffness(bodies.mass[i], alpha, p.dt)
        for a in range(3):
            for b in range(3):
                m.diagonal[s, a, b] = 0.0
        m.diagonal[s, 0, 0] = m.diagonal[s, 1, 1] = mass
        m.diagonal[s, 2, 2] = inertia
        m.rhs[s, 0] = inertia_force(bodies.mass[i], bodies.vx[i], p.dt)
        m.rhs[s, 1] = inertia_force(bodies.mass[i], bodies.vy[i], p.dt)
        m.rhs[s, 1] -= bodies.mass[i] * p.gravity
        m.rhs[s, 2] = inertia_force(bodies.inertia[i], bodies.omega[i], p.dt)


@kernel
def assemble_contact(
    c: Contacts, k: int, m: Matrix, i: int, j: int, dt: float, coupled: bool
) -> None:
    """Add the springs of closed contact k between slots i and j (-1: no unknowns).

    On the displacement d of the step the spring N = kappa (b - dt u_1) has stiffness 2 kappa and
    force kappa (b + dt u_0). The friction of a slipping contact is a force; `coupled` takes it
    from the unknown normal force, which makes the matrix unsymmetric.
    """
    stiffness = 2.0 * c.kappa[k]
    normal = c.kappa[k] * (c.bias[k] + dt * c.un[k])
    shear = c.memory_shear[k] + c.kappa[k] * dt * c.us[k]
    en, es = normal_row(c, k, True), shear_row(c, k, True)
    add_block(m.diagonal[i], stiffness, en, en)
    add_force(m.rhs[i], normal, en)
    stick = c.state[k] == STICK
    if stick:
        add_block(m.diagonal[i], stiffness, es, es)
        add_force(m.rhs[i], shear, es)
    elif coupled:
        ratio = math.copysign(c.friction[k], c.lag[k])
        add_block(m.diagonal[i], stiffness * ratio, es, en)
        add_force(m.rhs[i], normal * ratio, es)
    else:
        add_force(m.rhs[i], c.lag[k], es)
    if j < 0:
        return
    fn, fs = normal_row(c, k, False), shear_row(c, k, False)
    add_block(m.diagonal[j], stiffness, fn, fn)
    add_block(m.off[c.pair[k]], stiffness, en, fn)
    add_force(m.rhs[j], normal, fn)
    if stick:
        add_block(m.diagonal[j], stiffness, fs, fs)
        add_block(m.off[c.pair[k]], stiffness, es, fs)
        add_force(m.rhs[j], shear, fs)
    else:
        add_force(m.rhs[j], c.lag[k], fs)


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
    after = 2.0 * dn / dt - c.un[k]
    normal = c.kappa[k] * (c.bias[k] - dt * after)
    shear = c.memory_shear[k] - c.kappa[k] * (2.0 * ds - dt * c.us[k])
    return normal, shear, after


@kernel
def next_state(c: Contacts, k: int, normal: float, shear: float, weight: float) -> bool:
    """Move contact k to the state that its forces ask for; returns whether that is a change."""
    state = c.state[k]
    if state == OPEN:
        if normal > OPENING_TOLERANCE * weight and c.flips[k] < FLIPS:
            c.state[k] = STICK
            return True
        return False
    if normal < -OPENING_TOLERANCE * weight:
        c.state[k] = OPEN
        c.flips[k] += 1
        c.normal[k] = c.shear[k] = 0.0
        return True
    c.normal[k] = max(normal, 0.0)
    limit = c.friction[k] * c.normal[k]
    c.shear[k] = min(max(shear, -limit), limit)
    if abs(shear) <= limit * (1.0 + FRICTION_TOLERANCE):
        if state == STICK or c.flips[k] >= FLIPS:
            c.lag[k] = c.shear[k]
            return False
        c.state[k] = STICK
        c.flips[k] += 1
        return True
    friction = math.copysign(limit, shear)
    change = abs(friction - c.lag[k]) if state == SLIP else math.inf
    c.state[k] = SLIP
    c.lag[k] = friction
    return change > FRICTION_TOLERANCE * (limit + OPENING_TOLERANCE * weight)


@kernel
def update_states(
    bodies: Bodies, c: Contacts, m: Matrix, work: Work, low: int, high: int, p: Parameters
) -> int:
    """Move every contact of an island to its next state; returns how many changed."""
    changes = 0
    for item in range(low, high):
        k = work.contact_item[item]
        i = work.slot[c.a[k]]
        j = work.slot[c.b[k]] if c.pair[k] >= 0 else -1
        normal, shear, after = spring_forces(c, k, m, i, j, p.dt)
        if c.state[k] != OPEN and c.kind[k] == REST and after < -SHOCK_SPEED:
            set_shock(bodies, c, k, p)
            changes += 1
            continue
        weight = bodies.mass[c.a[k]] * p.gravity
        if next_state(c, k, normal, shear, weight):
            changes += 1
    return changes


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
    for s in range(n):
        i = work.block_item[b0 + s]
        m.d[s, 0], m.d[s, 1] = bodies.vx[i] * p.dt, bodies.vy[i] * p.dt
        m.d[s, 2] = bodies.omega[i] * p.dt
    for iteration in range(p.iterations):
        assemble_blocks(bodies, m, work, b0, b1, p)
        for q in range(pairs):
            for a in range(3):
                for b in range(3):
                    m.off[q, a, b] = 0.0
        for item in range(c0, c1):
            k = work.contact_item[item]
            if c.state[k] == OPEN:
                c.normal[k] = c.shear[k] = 0.0
            else:
                j = work.slot[c.b[k]] if c.pair[k] >= 0 else -1
                assemble_contact(c, k, m, work.slot[c.a[k]], j, p.dt, n == 1)
        counters[1] += 1
        if n == 1:
            solve_block(m.diagonal[0], m.rhs[0], m.d[0])
        else:
            scale = 0.0
            for s in range(n):
                for j in range(3):
                    scale += m.rhs[s, j] ** 2 / m.diagonal[s, j, j]
            counters[3] += 1
            counters[4] += solve_pcg(m, n, pairs, scale, p.tolerance)
        if update_states(bodies, c, m, work, c0, c1, p) == 0:
            return True
    return False


@kernel
def impact_work(c: Contacts, m: Matrix, work: Work, low: int, high: int, dt: float) -> float:
    """Return the work of the contact forces of an island in this step [J]."""
    total = 0.0
    for item in range(low, high):
        k = work.contact_item[item]
        i = work.slot[c.a[k]]
        j = work.slot[c.b[k]] if c.pair[k] >= 0 else -1
        dn = along(normal_row(c, k, True), m.d[i])
        ds = along(shear_row(c, k, True), m.d[i])
        if j >= 0:
            dn += along(normal_row(c, k, False), m.d[j])
            ds += along(shear_row(c, k, False), m.d[j])
        total += c.normal[k] * dn + c.shear[k] * ds
    return total


@kernel
def open_close(
    bodies: Bodies, c: Contacts, m: Matrix, work: Work, island: int, p: Parameters, counters: NDArray
) -> None:
    """Settle the contacts of an island, with less restitution where impacts would gain energy.

    Newton's restitution with friction can raise the kinetic energy of an eccentric impact; a
    plastic one cannot, since the springs act on the velocity after the step.
    """
    c0, c1 = work.contact_start[island], work.contact_start[island + 1]
    bouncing = False
    for item in range(c0, c1):
        k = work.contact_item[item]
        bouncing = bouncing or (c.kind[k] == IMPACT and c.bias[k] > 0.0)
    pairs = pair_blocks(bodies, c, m, work, c0, c1)
    settled = solve_states(bodies, c, m, work, island, pairs, p, counters)
    halving = 0
    while bouncing and impact_work(c, m, work, c0, c1, p.dt) > 0.0 and halving <= ENERGY_HALVINGS:
        for item in range(c0, c1):
            k = work.contact_item[item]
            c.flips[k] = 0
            if c.kind[k] == IMPACT:
                c.bias[k] *= 0.5 if halving < ENERGY_HALVINGS else 0.0
                c.state[k] = STICK
        settled = solve_states(bodies, c, m, work, island, pairs, p, counters)
        halving += 1
    if not settled:
        counters[2] += 1
