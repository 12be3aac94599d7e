"""The system of equations of an island: inertia, damping, weight, loads and closed contacts."""

from __future__ import annotations

import math

from rigdda.assembly.inertia import inertia_force, inertia_stiffness
from rigdda.assembly.springs import add_block, add_force, normal_row, shear_row
from rigdda.constants import BOLT, OPEN, SLIP, SMALL_ISLAND, STICK
from rigdda.kernel import inlined, kernel
from rigdda.records import Bodies, Contacts, Islands, Matrix, Parameters


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


@inlined
def assemble_blocks(
    bodies: Bodies, m: Matrix, islands: Islands, low: int, high: int, p: Parameters
) -> None:
    """Set the diagonal blocks and forces of inertia, damping, weight and loads."""
    for place in range(low, high):
        i, s = islands.block_item[place], place - low
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
        m.rhs[s, 0] += bodies[i].mass * p.field_x + bodies[i].force_x
        m.rhs[s, 1] += bodies[i].mass * p.field_y + bodies[i].force_y
        m.rhs[s, 2] += load_moment(bodies, i)


@inlined
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


@inlined
def assemble_island(
    bodies: Bodies, c: Contacts, m: Matrix, islands: Islands, island: int, pairs: int, p: Parameters
) -> None:
    """Set the system of an island with its contacts in their current states."""
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    assemble_blocks(bodies, m, islands, b0, b1, p)
    for a in range(3):
        for b in range(3):
            m.lower[a, b] = 0.0
            for q in range(max(pairs, 1)):
                m.off[q, a, b] = 0.0
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        k = islands.contact_item[item]
        if c[k].state == OPEN:
            c[k].normal = c[k].shear = 0.0
        else:
            j = islands.slot[c[k].b] if c[k].pair >= 0 else -1
            assemble_contact(c, k, m, islands.slot[c[k].a], j, p.dt, b1 - b0 <= SMALL_ISLAND)
