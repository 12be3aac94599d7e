"""Assembly of the equations of an island: inertia, damping, weight, loads and closed contacts.

A spring of stiffness k along a direction (l, m), the normal or the shear direction, adds k e_i^t
e_j to the stiffness matrix, where e_i = (l, m, r x (l, m)) is the row of T_i along that direction.
`assemble_contact` adds the springs of a contact, including the friction submatrix.
Mass-proportional damping is added with the inertia (`inertia_stiffness`); relaxation applies it in
`slots.fade`.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Matrix
from rigdda.dynamics.constants import BOLT, OPEN, SLIP, STICK
from rigdda.dynamics.records import Bodies, Body, Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


@kernel
def inertia_stiffness(mass: float, damping: float, dt: float) -> float:
    """Return 2 M / dt^2 + alpha M / dt: inertia and damping on the diagonal [N/m].

    With the second moment instead of the mass, it is the entry of the rotation. The submatrices are
    integrals of T^t T over the block and are diagonal about the centroid.
    """
    return 2.0 * mass / (dt * dt) + damping * mass / dt


@kernel
def inertia_force(mass: float, velocity: float, dt: float) -> float:
    """Return 2 M V0 / dt, the inertia force in dynamic mode [N]."""
    return 2.0 * mass * velocity / dt


@kernel
def normal_row(c: Contact, of_a: bool) -> tuple[float, float, float]:
    """Return e along the normal of a contact for body a, or else for body b."""
    if of_a:
        return c.nx, c.ny, c.ra_x * c.ny - c.ra_y * c.nx
    return -c.nx, -c.ny, -(c.rb_x * c.ny - c.rb_y * c.nx)


@kernel
def shear_row(c: Contact, of_a: bool) -> tuple[float, float, float]:
    """Return e along the normal turned by +90 degrees for body a, or else for body b."""
    if of_a:
        return -c.ny, c.nx, c.ra_x * c.nx + c.ra_y * c.ny
    return c.ny, -c.nx, -(c.rb_x * c.nx + c.rb_y * c.ny)


@kernel
def rolling_row(c: Contact, of_a: bool) -> tuple[float, float, float]:
    """Return e along the relative rotation times R for body a, or else for body b."""
    return 0.0, 0.0, c.radius if of_a else -c.radius


@kernel
def add_block(
    matrix: NDArray, stiffness: float, e: tuple[float, float, float], f: tuple[float, float, float]
) -> None:
    """Add stiffness e^t f to a 3x3 block."""
    for i in range(3):
        for j in range(3):
            matrix[i, j] += stiffness * e[i] * f[j]


@kernel
def add_force(rhs: NDArray, force: float, e: tuple[float, float, float]) -> None:
    """Add the generalised force of a force along e to a right-hand side."""
    rhs[0] += force * e[0]
    rhs[1] += force * e[1]
    rhs[2] += force * e[2]


@kernel
def along(e: tuple[float, float, float], d: NDArray) -> float:
    """Return the displacement along e of a block with displacements d."""
    return e[0] * d[0] + e[1] * d[1] + e[2] * d[2]


@kernel
def relative_displacement(c: Contact, d: NDArray, i: int, j: int) -> tuple[float, float, float]:
    """Return the normal, shear and rolling displacement at a contact of slots i and j [m].

    Slot -1 is at rest. The rolling displacement is R times the relative rotation.
    """
    dn, ds, dr = along(normal_row(c, True), d[i]), along(shear_row(c, True), d[i]), d[i, 2]
    if j >= 0:
        dn += along(normal_row(c, False), d[j])
        ds += along(shear_row(c, False), d[j])
        dr -= d[j, 2]
    return dn, ds, c.radius * dr


@kernel
def load_moment(body: Body, dt: float) -> float:
    """Return the moment of the dead loads of a block about its centroid in mid-step [N m]."""
    if body.moment_cos == 0.0 and body.moment_sin == 0.0:
        return 0.0
    theta = body.theta + 0.5 * dt * body.omega
    return body.moment_cos * math.cos(theta) + body.moment_sin * math.sin(theta)


@inlined
def assemble_blocks(
    bodies: Bodies, m: Matrix, islands: Islands, low: int, high: int, p: Parameters
) -> None:
    """Set the diagonal blocks and the forces from inertia, damping, weight and loads."""
    for place in range(low, high):
        body, s = bodies[islands.block_item[place]], place - low
        inertia = inertia_stiffness(body.inertia, p.damping, p.dt)
        mass = inertia_stiffness(body.mass, p.damping, p.dt)
        for a in range(3):
            for b in range(3):
                m.diagonal[s, a, b] = 0.0
        m.diagonal[s, 0, 0] = m.diagonal[s, 1, 1] = mass
        m.diagonal[s, 2, 2] = inertia
        m.rhs[s, 0] = inertia_force(body.mass, body.vx, p.dt)
        m.rhs[s, 1] = inertia_force(body.mass, body.vy, p.dt)
        m.rhs[s, 2] = inertia_force(body.inertia, body.omega, p.dt)
        m.rhs[s, 0] += body.mass * p.field_x + body.force_x
        m.rhs[s, 1] += body.mass * p.field_y + body.force_y
        m.rhs[s, 2] += load_moment(body, p.dt)


@kernel
def add_spring(
    m: Matrix, stiffness: float, force: float, i: int, j: int, pair: int,
    e: tuple[float, float, float], f: tuple[float, float, float],
) -> None:  # fmt: skip
    """Add a spring between slots i and j (-1: no unknowns), with rows e and f, and its force."""
    add_block(m.diagonal[i], stiffness, e, e)
    add_force(m.rhs[i], force, e)
    if j >= 0:
        add_block(m.diagonal[j], stiffness, f, f)
        add_block(m.off[pair], stiffness, e, f)
        add_force(m.rhs[j], force, f)


@inlined
def assemble_contact(c: Contact, m: Matrix, i: int, j: int, dt: float) -> None:
    """Add the springs of a closed contact between slots i and j (-1: no unknowns).

    In terms of the displacement d of the step, the spring N = kappa (b - dt w_1) has stiffness 2
    kappa and force kappa (b + dt w_0). The friction of a slipping contact is a given force, that of
    the last iteration, and so is rolling resistance at its limit. A bolt has no shear force; a
    yielding bolt is a given force.
    """
    stiffness, normal = 2.0 * c.kappa, c.kappa * (c.bias + dt * c.un)
    if c.kind == BOLT:
        if c.state == SLIP:  # the bolt yields
            stiffness, normal = 0.0, -c.tension
        add_spring(m, stiffness, normal, i, j, c.pair, normal_row(c, True), normal_row(c, False))
        return
    add_spring(m, stiffness, normal, i, j, c.pair, normal_row(c, True), normal_row(c, False))
    es, fs = shear_row(c, True), shear_row(c, False)
    if c.state == STICK:
        shear = c.accumulated_shear + c.kappa * dt * c.us
        add_spring(m, stiffness, shear, i, j, c.pair, es, fs)
    else:
        add_spring(m, 0.0, c.lag, i, j, c.pair, es, fs)
    if c.rolling == 0.0:
        return
    er, fr = rolling_row(c, True), rolling_row(c, False)
    if c.turns == 0:
        add_spring(m, stiffness, c.accumulated_roll + c.kappa * dt * c.ur, i, j, c.pair, er, fr)
    else:
        add_spring(m, 0.0, c.roll, i, j, c.pair, er, fr)


@inlined
def assemble_island(
    bodies: Bodies,
    contacts: Contacts,
    m: Matrix,
    islands: Islands,
    island: int,
    pairs: int,
    p: Parameters,
) -> None:
    """Assemble the system of an island for the current states of its contacts."""
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    assemble_blocks(bodies, m, islands, b0, b1, p)
    for a in range(3):
        for b in range(3):
            for q in range(pairs):
                m.off[q, a, b] = 0.0
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.state == OPEN:
            c.normal = c.shear = c.roll = 0.0
        else:
            j = islands.slot[c.b] if c.pair >= 0 else -1
            assemble_contact(c, m, islands.slot[c.a], j, p.dt)
