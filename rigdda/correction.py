"""After the solve: velocities, displacements, and the post-correction of rotation."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.assembly.springs import add_force, along, normal_row, shear_row
from rigdda.constants import IMPACT, NEW, OPEN, REST
from rigdda.kernel import kernel
from rigdda.open_close import assemble_blocks
from rigdda.records import Bodies, Contacts, Gauges, Matrix, Outlines, Parameters, Work


@kernel
def place_corners(bodies: Bodies, outlines: Outlines, i: int) -> None:
    """Set the corners and edge normals of body i from its centroid and angle.

    The exact displacement function (equation 1), which replaces the linear one of the solve: the
    post-correction. Corners come from the angle and body coordinates, so area is kept exactly.
    """
    cos, sin = math.cos(bodies.theta[i]), math.sin(bodies.theta[i])
    n = bodies.count[i]
    for k in range(n):
        x, y = outlines.body_x[i, k], outlines.body_y[i, k]
        outlines.world_x[i, k] = bodies.x[i] + cos * x - sin * y
        outlines.world_y[i, k] = bodies.y[i] + sin * x + cos * y
    for k in range(n):
        end = k + 1 if k + 1 < n else 0
        ex = outlines.world_x[i, end] - outlines.world_x[i, k]
        ey = outlines.world_y[i, end] - outlines.world_y[i, k]
        length = math.sqrt(ex * ex + ey * ey)
        outlines.normal_x[i, k] = ey / length
        outlines.normal_y[i, k] = -ex / length


@kernel
def mean_impact_share(c: Contacts, work: Work, low: int, high: int) -> float:
    """Return the share of the step after the impacts of an island, weighted by impulse."""
    weight = total = 0.0
    for item in range(low, high):
        k = work.contact_item[item]
        if c.kind[k] == IMPACT:
            weight += c.normal[k]
            total += c.normal[k] * c.share[k]
    return total / weight if weight > 0.0 else 0.5


@kernel
def apply_forces(
    bodies: Bodies, c: Contacts, m: Matrix, work: Work, island: int, p: Parameters
) -> None:
    """Set m.d and m.residual of an island to the displacement and its impact correction.

    Forces are applied equal and opposite here, once more and exactly, so that momentum is kept to
    rounding whatever the residual of the solver. A constant force over the step displaces a block
    by dt^2 F / 2M; an impulse that acts for the share s of the step displaces it by s dt^2 F / M.
    """
    b0, b1 = work.block_start[island], work.block_start[island + 1]
    c0, c1 = work.contact_start[island], work.contact_start[island + 1]
    assemble_blocks(bodies, m, work, b0, b1, p)
    for s in range(b1 - b0):
        m.residual[s, 0] = m.residual[s, 1] = m.residual[s, 2] = 0.0
    shared = mean_impact_share(c, work, c0, c1)
    for item in range(c0, c1):
        k = work.contact_item[item]
        if c.state[k] == OPEN:
            continue
        share = c.share[k] if c.kind[k] == IMPACT else shared
        late_normal = (share - 0.5) * (c.normal[k] - c.memory_normal[k])
        late_shear = (share - 0.5) * (c.shear[k] - c.memory_shear[k])
        i = work.slot[c.a[k]]
        en, es = normal_row(c, k, True), shear_row(c, k, True)
        add_force(m.rhs[i], c.normal[k], en)
        add_force(m.rhs[i], c.shear[k], es)
        add_force(m.residual[i], late_normal, en)
        add_force(m.residual[i], late_shear, es)
        if c.pair[k] >= 0:
            j = work.slot[c.b[k]]
            en, es = normal_row(c, k, False), shear_row(c, k, False)
            add_force(m.rhs[j], c.normal[k], en)
            add_force(m.rhs[j], c.shear[k], es)
            add_force(m.residual[j], late_normal, en)
            add_force(m.residual[j], late_shear, es)
    for s in range(b1 - b0):
        i = work.block_item[b0 + s]
        for j in range(3):
            m.d[s, j] = m.rhs[s, j] / m.diagonal[s, j, j]
        late = p.dt * p.dt / bodies.mass[i]
        m.residual[s, 0] *= late
        m.residual[s, 1] *= late
        m.residual[s, 2] *= p.dt * p.dt / bodies.inertia[i]


@kernel
def account(
    bodies: Bodies, c: Contacts, m: Matrix, work: Work, island: int, p: Parameters,
    ledger: NDArray, gauges: Gauges,
) -> None:  # fmt: skip
    """Add the work of contact forces, damping and gravity in this step to the ledger."""
    b0, b1 = work.block_start[island], work.block_start[island + 1]
    for s in range(b1 - b0):
        i = work.block_item[b0 + s]
        drag = damping_of_step(m, s, bodies.mass[i], p)
        slow = m.d[s, 0] ** 2 + m.d[s, 1] ** 2
        slow = bodies.mass[i] * slow + bodies.inertia[i] * m.d[s, 2] ** 2
        ledger[2] -= drag * slow / p.dt
        ledger[3] -= bodies.mass[i] * p.gravity * (m.d[s, 1] + m.residual[s, 1])
    for item in range(work.contact_start[island], work.contact_start[island + 1]):
        k = work.contact_item[item]
        if c.state[k] == OPEN:
            continue
        i = work.slot[c.a[k]]
        dn = along(normal_row(c, k, True), m.d[i])
        ds = along(shear_row(c, k, True), m.d[i])
        if c.pair[k] >= 0:
            j = work.slot[c.b[k]]
            dn += along(normal_row(c, k, False), m.d[j])
            ds += along(shear_row(c, k, False), m.d[j])
        ledger[0] += c.shear[k] * ds
        ledger[1] += c.normal[k] * dn
        if c.b[k] >= p.blocks:
            gauges.absorbed[c.b[k] - p.blocks] -= c.normal[k] * dn + c.shear[k] * ds


@kernel
def damping_of_step(m: Matrix, s: int, mass: float, p: Parameters) -> float:
    """Return the damping coefficient that the diagonal of slot s holds [1/s]."""
    return (m.diagonal[s, 0, 0] - 2.0 * mass / (p.dt * p.dt)) * p.dt / mass


@kernel
def move_block(bodies: Bodies, i: int, m: Matrix, s: int, dt: float) -> None:
    """Move block i by its displacement; the velocity is that of constant acceleration."""
    bodies.vx[i] = 2.0 * m.d[s, 0] / dt - bodies.vx[i]
    bodies.vy[i] = 2.0 * m.d[s, 1] / dt - bodies.vy[i]
    bodies.omega[i] = 2.0 * m.d[s, 2] / dt - bodies.omega[i]
    bodies.x[i] += m.d[s, 0] + m.residual[s, 0]
    bodies.y[i] += m.d[s, 1] + m.residual[s, 1]
    bodies.theta[i] += m.d[s, 2] + m.residual[s, 2]


@kernel
def keep_memory(c: Contacts, k: int) -> None:
    """Carry the forces of contact k to the next step; an impulse is not carried on."""
    if c.state[k] == OPEN:
        c.memory_normal[k] = c.memory_shear[k] = 0.0
    elif c.kind[k] == REST or c.kind[k] == NEW:
        c.memory_normal[k], c.memory_shear[k] = c.normal[k], c.shear[k]
