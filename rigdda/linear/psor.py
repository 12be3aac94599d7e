"""Projected successive relaxation of contact forces, for islands in motion.

In an avalanche many contacts open, close, stick and slip in one step, and open-close iteration
around a global solve does not settle. Relaxation decides the state of each contact as it visits
it: the normal force is kept from pulling, the shear force within its friction limit. Few sweeps
from the forces of the last step are enough while blocks move; at rest the global solve takes over.
"""

from __future__ import annotations

from rigdda.assembly.springs import normal_row, shear_row
from rigdda.constants import RELAXATION_SPEED, RELAXATION_STIFFNESS, RELAXATION_SWEEPS
from rigdda.kernel import kernel
from rigdda.records import Contacts, Matrix, Work

# columns of work.row: rows of a and b along the normal and the shear direction, then by direction
# gain [N/m], free displacement [m], force [N]; friction
NORMAL_A, NORMAL_B, SHEAR_A, SHEAR_B = 0, 3, 6, 9
GAIN, FREE, SOFT, FORCE = 12, 14, 16, 18
FRICTION = 20
COLUMNS = 21


@kernel
def flexibility(m: Matrix, i: int, e: tuple[float, float, float]) -> float:
    """Return the displacement along e of slot i per force along e [m/N]."""
    if i < 0:
        return 0.0
    diagonal = m.diagonal[i]
    translation = (e[0] * e[0] + e[1] * e[1]) / diagonal[0, 0]
    return translation + e[2] * e[2] / diagonal[2, 2]


@kernel
def pack_row(c: Contacts, k: int, m: Matrix, work: Work, place: int, dt: float) -> None:
    """Write contact k as row `place` and add its starting force to the displacements."""
    row = work.row[place]
    i = work.slot[c.a[k]]
    j = work.slot[c.b[k]] if c.pair[k] >= 0 else -1
    work.row_i[place], work.row_j[place] = i, j
    en, es = normal_row(c, k, True), shear_row(c, k, True)
    fn, fs = normal_row(c, k, False), shear_row(c, k, False)
    for q in range(3):
        row[NORMAL_A + q], row[SHEAR_A + q] = en[q], es[q]
        row[NORMAL_B + q], row[SHEAR_B + q] = fn[q], fs[q]
    soft_n = flexibility(m, i, en) + flexibility(m, j, fn)
    soft_s = flexibility(m, i, es) + flexibility(m, j, fs)
    # stiff against the inertia of the blocks; the bias keeps the force that the law carries over
    kappa = RELAXATION_STIFFNESS / soft_n
    carried = c.memory_normal[k]
    row[GAIN], row[SOFT] = kappa / (1.0 + 2.0 * kappa * soft_n), 1.0 / kappa
    row[FREE] = c.bias[k] + (1.0 / kappa - 1.0 / c.kappa[k]) * carried + dt * c.un[k]
    kappa = RELAXATION_STIFFNESS / soft_s
    row[GAIN + 1], row[SOFT + 1] = kappa / (1.0 + 2.0 * kappa * soft_s), 1.0 / kappa
    row[FREE + 1] = c.memory_shear[k] / kappa + dt * c.us[k]
    row[FORCE], row[FORCE + 1] = carried, c.memory_shear[k]
    row[FRICTION] = c.friction[k]
    push(m, work, place, NORMAL_A, carried)
    push(m, work, place, SHEAR_A, c.memory_shear[k])


@kernel
def push(m: Matrix, work: Work, place: int, column: int, force: float) -> None:
    """Move the blocks of a row by what a force along its direction displaces each alone."""
    row, i, j = work.row[place], work.row_i[place], work.row_j[place]
    light, turn = force * m.scaled[i, 0], force * m.scaled[i, 2]
    m.d[i, 0] += light * row[column]
    m.d[i, 1] += light * row[column + 1]
    m.d[i, 2] += turn * row[column + 2]
    if j >= 0:
        light, turn = force * m.scaled[j, 0], force * m.scaled[j, 2]
        m.d[j, 0] += light * row[column + 3]
        m.d[j, 1] += light * row[column + 4]
        m.d[j, 2] += turn * row[column + 5]


@kernel
def overlap(m: Matrix, work: Work, place: int, column: int) -> float:
    """Return the relative displacement of a row along its direction [m]."""
    row, i, j = work.row[place], work.row_i[place], work.row_j[place]
    d = row[column] * m.d[i, 0] + row[column + 1] * m.d[i, 1] + row[column + 2] * m.d[i, 2]
    if j >= 0:
        d += row[column + 3] * m.d[j, 0] + row[column + 4] * m.d[j, 1] + row[column + 5] * m.d[j, 2]
    return d


@kernel
def relax_forces(c: Contacts, m: Matrix, work: Work, low: int, high: int, n: int, dt: float) -> int:
    """Sweep to and fro over the contacts low:high until their forces settle; returns the sweeps.

    The matrix holds inertia and weight only; m.d is set to the displacements.
    """
    for s in range(n):
        for q in range(3):
            m.scaled[s, q] = 1.0 / m.diagonal[s, q, q]
            m.d[s, q] = m.rhs[s, q] * m.scaled[s, q]
    count = high - low
    for place in range(count):
        pack_row(c, work.contact_item[low + place], m, work, place, dt)
    sweeps, worst = 0, 1e300
    while sweeps < RELAXATION_SWEEPS and worst > RELAXATION_SPEED:
        worst = 0.0
        for visit in range(count):
            place = visit if sweeps % 2 == 0 else count - 1 - visit
            row = work.row[place]
            force = row[FORCE]
            off = row[FREE] - 2.0 * overlap(m, work, place, NORMAL_A) - force * row[SOFT]
            normal = max(force + row[GAIN] * off, 0.0)
            if normal != force:
                push(m, work, place, NORMAL_A, normal - force)
                row[FORCE] = normal
                worst = max(worst, abs(normal - force) * row[SOFT])
            force, limit = row[FORCE + 1], row[FRICTION] * normal
            if limit == 0.0 and force == 0.0:
                continue
            off = row[FREE + 1] - 2.0 * overlap(m, work, place, SHEAR_A) - force * row[SOFT + 1]
            shear = min(max(force + row[GAIN + 1] * off, -limit), limit)
            push(m, work, place, SHEAR_A, shear - force)
            row[FORCE + 1] = shear
        worst *= 2.0 * RELAXATION_STIFFNESS / dt
        sweeps += 1
    for place in range(count):
        k = work.contact_item[low + place]
        c.normal[k], c.shear[k] = work.row[place, FORCE], work.row[place, FORCE + 1]
    return sweeps
