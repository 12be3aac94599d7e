"""The 6N x 6N simultaneous equations: blocks, contacts and conjugate gradients."""

from __future__ import annotations

from typing import NamedTuple

from experiments.deformable.submatrices import (
    UNKNOWNS,
    Row,
    add_elasticity,
    area_moments,
    row_along,
    set_inertia,
)
from rigdda.dynamics.arrays import Matrix, Outlines
from rigdda.dynamics.constants import OPEN, STICK
from rigdda.dynamics.records import Bodies, Contact, Contacts, Floats, Parameters
from rigdda.kernel import kernel


class Solid(NamedTuple):
    """State and equations of N deformable blocks with P pairs in contact."""

    velocity: Floats  # (N, 6) rates of the unknowns [m/s, rad/s, 1/s]
    stress: Floats  # (N, 3) sx, sy, txy, tension positive [Pa]
    load: Floats  # (N, 6) generalised dead loads [N, N m]
    elasticity: Floats  # (3, 3) [Pa]
    inertia: Floats  # (N, 6, 6)
    diagonal: Floats  # (N, 6, 6)
    off: Floats  # (P, 6, 6)
    rhs: Floats  # (N, 6)
    d: Floats  # (N, 6) displacements and strains of the step
    residual: Floats
    direction: Floats
    product: Floats
    scaled: Floats


@kernel
def assemble_blocks(bodies: Bodies, outlines: Outlines, s: Solid, n: int, p: Parameters) -> None:
    """Set inertia, damping, elasticity, weight and loads of all blocks.

    K = (2 / dt^2 + alpha / dt) M + S E and F = 2 M V0 / dt + weight + loads - S sigma_0.
    """
    factor = 2.0 / (p.dt * p.dt) + p.damping / p.dt
    for i in range(n):
        body = bodies[i]
        moments = area_moments(outlines, i, body.count, body.x, body.y)
        set_inertia(s.inertia[i], body.mass, moments)
        for a in range(UNKNOWNS):
            s.rhs[i, a] = s.load[i, a]
            for b in range(UNKNOWNS):
                s.diagonal[i, a, b] = factor * s.inertia[i, a, b]
                s.rhs[i, a] += 2.0 / p.dt * s.inertia[i, a, b] * s.velocity[i, b]
        s.rhs[i, 0] += body.mass * p.field_x
        s.rhs[i, 1] += body.mass * p.field_y
        add_elasticity(s.diagonal[i], s.rhs[i], moments[0], s.elasticity, s.stress[i])


@kernel
def rows(c: Contact, of_a: bool) -> tuple[Row, Row]:
    """Return the rows of a contact along its normal and shear directions for body a, or else b."""
    nx, ny = c.nx, c.ny
    if of_a:
        x, y = c.ra_x, c.ra_y
        return row_along(x, y, nx, ny), row_along(x, y, -ny, nx)
    x, y = c.rb_x, c.rb_y
    return row_along(x, y, -nx, -ny), row_along(x, y, ny, -nx)


@kernel
def add(matrix: Floats, stiffness: float, e: Row, f: Row) -> None:
    """Add stiffness e^t f to a (6, 6) block."""
    for a in range(UNKNOWNS):
        for b in range(UNKNOWNS):
            matrix[a, b] += stiffness * e[a] * f[b]


@kernel
def add_contact(c: Contact, s: Solid) -> None:
    """Add a closed contact: N = k_n (-gap - d_n) and, while it sticks, S = S_0 - k_n d_s."""
    i, j, stiffness = c.a, c.b, c.stiffness
    stick = c.state == STICK
    normal, shear = -stiffness * c.gap, c.accumulated_shear if stick else c.lag
    en, es = rows(c, True)
    fn, fs = rows(c, False)
    coupled = c.pair >= 0
    add(s.diagonal[i], stiffness, en, en)
    if stick:
        add(s.diagonal[i], stiffness, es, es)
    if coupled:
        add(s.diagonal[j], stiffness, fn, fn)
        add(s.off[c.pair], stiffness, en, fn)
        if stick:
            add(s.diagonal[j], stiffness, fs, fs)
            add(s.off[c.pair], stiffness, es, fs)
    for a in range(UNKNOWNS):
        s.rhs[i, a] += normal * en[a] + shear * es[a]
        if coupled:
            s.rhs[j, a] += normal * fn[a] + shear * fs[a]


@kernel
def assemble(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, count: int, s: Solid, n: int,
    pairs: int, p: Parameters,
) -> None:  # fmt: skip
    """Assemble the equations for the current states of all contacts."""
    assemble_blocks(bodies, outlines, s, n, p)
    for q in range(pairs):
        s.off[q] = 0.0
    for k in range(count):
        c = contacts[k]
        if c.state == OPEN:
            c.normal = c.shear = 0.0
        else:
            add_contact(c, s)


@kernel
def forces(c: Contact, s: Solid) -> tuple[float, float]:
    """Return the normal force of a contact and the shear force if it sticks [N]."""
    en, es = rows(c, True)
    fn, fs = rows(c, False)
    dn = ds = 0.0
    for a in range(UNKNOWNS):
        dn += en[a] * s.d[c.a, a]
        ds += es[a] * s.d[c.a, a]
        if c.pair >= 0:
            dn += fn[a] * s.d[c.b, a]
            ds += fs[a] * s.d[c.b, a]
    return -c.stiffness * (c.gap + dn), c.accumulated_shear - c.stiffness * ds


@kernel
def multiply(s: Solid, m: Matrix, n: int, pairs: int, x: Floats, y: Floats) -> None:
    """Set y = K x."""
    for i in range(n):
        for a in range(UNKNOWNS):
            total = 0.0
            for b in range(UNKNOWNS):
                total += s.diagonal[i, a, b] * x[i, b]
            y[i, a] = total
    for q in range(pairs):
        i, j = m.pair_i[q], m.pair_j[q]
        for a in range(UNKNOWNS):
            for b in range(UNKNOWNS):
                y[i, a] += s.off[q, a, b] * x[j, b]
                y[j, b] += s.off[q, a, b] * x[i, a]


@kernel
def solve_pcg(s: Solid, m: Matrix, n: int, pairs: int, tolerance: float) -> int:
    """Solve K d = F, starting from s.d; return the iterations, see `solvers.solve_pcg`."""
    multiply(s, m, n, pairs, s.d, s.product)
    scale = rho = 0.0
    for i in range(n):
        for a in range(UNKNOWNS):
            s.residual[i, a] = s.rhs[i, a] - s.product[i, a]
            scale += s.rhs[i, a] ** 2 / s.diagonal[i, a, a]
            s.direction[i, a] = s.residual[i, a] / s.diagonal[i, a, a]
            rho += s.residual[i, a] * s.direction[i, a]
    limit, iterations = tolerance * tolerance * scale, 0
    while rho > limit and iterations < 20 * n + 60:
        multiply(s, m, n, pairs, s.direction, s.product)
        curvature = 0.0
        for i in range(n):
            for a in range(UNKNOWNS):
                curvature += s.direction[i, a] * s.product[i, a]
        alpha, before, rho = rho / curvature, rho, 0.0
        for i in range(n):
            for a in range(UNKNOWNS):
                s.d[i, a] += alpha * s.direction[i, a]
                s.residual[i, a] -= alpha * s.product[i, a]
                s.scaled[i, a] = s.residual[i, a] / s.diagonal[i, a, a]
                rho += s.residual[i, a] * s.scaled[i, a]
        for i in range(n):
            for a in range(UNKNOWNS):
                s.direction[i, a] = s.scaled[i, a] + rho / before * s.direction[i, a]
        iterations += 1
    return iterations
