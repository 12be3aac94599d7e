"""Projected successive relaxation of contact forces, for islands in motion.

In an avalanche many contacts open, close, stick and slip in one step, and open-close iteration
around a global solve does not settle. Relaxation decides the state of each contact as it visits
it: the normal force is kept from pulling, the shear force within its friction limit. Few sweeps
from the forces of the last step are enough while blocks move; at rest the global solve takes over.
"""

from __future__ import annotations

import math

import numpy as np

from rigdda.assembly.springs import normal_row, shear_row
from rigdda.constants import (
    BOLT,
    FAR_SPEED,
    LAST_SWEEPS,
    LEAST_QUIET,
    PIN,
    PLAIN,
    QUIET_SPEED,
    QUIET_SWEEPS,
    RELAXATION_SPEED,
    RELAXATION_STIFFNESS,
    RELAXATION_SWEEPS,
)
from rigdda.kernel import kernel
from rigdda.records import Contacts, Floats, Ints, Matrix, Work

# columns of work.row: rows of a and b along the normal and the shear direction, then by direction
# gain [N/m], free displacement [m], force [N]; friction, and forces that it bears beside [N]
NORMAL_A, NORMAL_B, SHEAR_A, SHEAR_B = 0, 3, 6, 9
GAIN, FREE, SOFT, FORCE = 12, 14, 16, 18
FRICTION, COHESION, TENSION = 20, 21, 22
COLUMNS = 23


@kernel
def flexibility(inverse: Floats, i: int, e: tuple[float, float, float]) -> float:
    """Return the displacement along e of slot i per force along e [m/N]."""
    return (e[0] * e[0] + e[1] * e[1]) * inverse[i, 0] + e[2] * e[2] * inverse[i, 2]


@kernel
def pack_row(c: Contacts, k: int, m: Matrix, work: Work, place: int, n: int, dt: float) -> None:
    """Write contact k as row `place` and add its starting force to the displacements.

    Slot n stands for bodies without unknowns.
    """
    row, old = work.row, c[k]
    i = work.slot[old.a]
    j = work.slot[old.b] if old.pair >= 0 else n
    work.row_i[place], work.row_j[place] = i, j
    en, es = normal_row(c, k, True), shear_row(c, k, True)
    fn, fs = normal_row(c, k, False), shear_row(c, k, False)
    for q in range(3):
        row[place, NORMAL_A + q], row[place, SHEAR_A + q] = en[q], es[q]
        row[place, NORMAL_B + q], row[place, SHEAR_B + q] = fn[q], fs[q]
    soft_n = flexibility(m.scaled, i, en) + flexibility(m.scaled, j, fn)
    soft_s = flexibility(m.scaled, i, es) + flexibility(m.scaled, j, fs)
    own = old.kind == PLAIN or old.kind == BOLT or old.kind == PIN
    # stiff against the inertia of the blocks
    kappa = old.kappa if own else RELAXATION_STIFFNESS / soft_n
    row[place, GAIN], row[place, SOFT] = kappa / (1.0 + 2.0 * kappa * soft_n), 1.0 / kappa
    row[place, FREE] = old.bias + dt * old.un
    if not own:
        row[place, FREE] += old.memory_normal * (1.0 / kappa - 1.0 / old.kappa)
    kappa = old.kappa if own else RELAXATION_STIFFNESS / soft_s
    row[place, GAIN + 1], row[place, SOFT + 1] = kappa / (1.0 + 2.0 * kappa * soft_s), 1.0 / kappa
    row[place, FREE + 1] = old.memory_shear / kappa + dt * old.us
    row[place, FORCE], row[place, FORCE + 1] = old.start_normal, old.start_shear
    row[place, FRICTION], row[place, TENSION] = old.friction, old.tension
    row[place, COHESION] = math.inf if old.kind == PIN else old.cohesion
    push(row, place, NORMAL_A, i, j, m.d, m.scaled, old.start_normal)
    push(row, place, SHEAR_A, i, j, m.d, m.scaled, old.start_shear)


@kernel
def push(
    row: Floats, place: int, column: int, i: int, j: int, d: Floats, inverse: Floats, force: float
) -> None:
    """Move the blocks of a row by what a force along its direction displaces each alone."""
    for q in range(3):
        d[i, q] += force * inverse[i, q] * row[place, column + q]
        d[j, q] += force * inverse[j, q] * row[place, column + 3 + q]


@kernel
def sweep(
    row: Floats, row_i: Ints, row_j: Ints, d: Floats, inverse: Floats, count: int, number: int,
    moved_in: Ints, quiet: float,
) -> float:  # fmt: skip
    """Visit every contact once; returns the greatest displacement that a visit changed [m].

    But not where neither body has moved by more than `quiet` [m] in this or the last sweep:
    moved_in[s] is the number of the last sweep in which slot s did.

    A body without unknowns has a slot of its own that nothing moves. Displacements of a visit are
    held in local variables, and unsigned indices spare numba's test for negative ones.
    """
    worst = 0.0
    for visit in range(count):
        place = np.uintp(count - 1 - visit if number % 2 == 1 else visit)
        i, j = np.uintp(row_i[place]), np.uintp(row_j[place])
        if moved_in[i] < number - 1 and moved_in[j] < number - 1:
            continue
        r = row[place]
        u, v, w, light, turn = d[i, 0], d[i, 1], d[i, 2], inverse[i, 0], inverse[i, 2]
        u2, v2, w2, light2, turn2 = d[j, 0], d[j, 1], d[j, 2], inverse[j, 0], inverse[j, 2]
        moved = r[NORMAL_A] * u + r[NORMAL_A + 1] * v + r[NORMAL_A + 2] * w
        moved += r[NORMAL_B] * u2 + r[NORMAL_B + 1] * v2 + r[NORMAL_B + 2] * w2
        force = r[FORCE]
        normal = force + r[GAIN] * (r[FREE] - 2.0 * moved - force * r[SOFT])
        normal = max(normal, -r[TENSION])
        push = normal - force
        limit = r[COHESION] + r[FRICTION] * max(normal, 0.0)
        before = r[FORCE + 1]
        if push == 0.0 and limit == 0.0 and before == 0.0:
            continue
        change = abs(push) * r[SOFT]
        worst = max(worst, change)
        u += push * light * r[NORMAL_A]
        v += push * light * r[NORMAL_A + 1]
        w += push * turn * r[NORMAL_A + 2]
        u2 += push * light2 * r[NORMAL_B]
        v2 += push * light2 * r[NORMAL_B + 1]
        w2 += push * turn2 * r[NORMAL_B + 2]
        moved = r[SHEAR_A] * u + r[SHEAR_A + 1] * v + r[SHEAR_A + 2] * w
        moved += r[SHEAR_B] * u2 + r[SHEAR_B + 1] * v2 + r[SHEAR_B + 2] * w2
        shear = before + r[GAIN + 1] * (r[FREE + 1] - 2.0 * moved - before * r[SOFT + 1])
        shear = min(max(shear, -limit), limit)
        push = shear - before
        if change + abs(push) * r[SOFT + 1] > quiet:
            moved_in[i] = number
            if light2 > 0.0:
                moved_in[j] = number
        d[i, 0] = u + push * light * r[SHEAR_A]
        d[i, 1] = v + push * light * r[SHEAR_A + 1]
        d[i, 2] = w + push * turn * r[SHEAR_A + 2]
        d[j, 0] = u2 + push * light2 * r[SHEAR_B]
        d[j, 1] = v2 + push * light2 * r[SHEAR_B + 1]
        d[j, 2] = w2 + push * turn2 * r[SHEAR_B + 2]
        r[FORCE], r[FORCE + 1] = normal, shear
    return worst


@kernel
def sort_by_height(c: Contacts, work: Work, low: int, high: int) -> None:
    """Order the contacts low:high by height, lowest first, so that a sweep carries loads through.

    A counting sort in as many layers as there is room for: within one the order does not matter.
    """
    item, layers = work.contact_item, min(len(work.layer) - 1, high - low)
    least, most = math.inf, -math.inf
    for place in range(low, high):
        y = c[item[place]].y
        least, most = min(least, y), max(most, y)
    scale = layers / (most - least) * (1.0 - 1e-9) if most > least else 0.0
    for s in range(layers + 1):
        work.layer[s] = 0
    for place in range(low, high):
        work.layer[int(scale * (c[item[place]].y - least)) + 1] += 1
    for s in range(layers):
        work.layer[s + 1] += work.layer[s]
    for place in range(low, high):
        s = int(scale * (c[item[place]].y - least))
        work.ordered[work.layer[s]] = item[place]
        work.layer[s] += 1
    for place in range(low, high):
        item[place] = work.ordered[place - low]


@kernel
def relax_forces(
    c: Contacts, m: Matrix, work: Work, low: int, high: int, n: int, dt: float, speed: float
) -> int:
    """Sweep to and fro over the contacts low:high until their forces settle; returns the sweeps.

    The matrix holds inertia and weight only; m.d is set to the displacements. `speed` is the
    greatest of the island [m/s].
    """
    for s in range(n):
        for q in range(3):
            m.scaled[s, q] = 1.0 / m.diagonal[s, q, q]
            m.d[s, q] = m.rhs[s, q] * m.scaled[s, q]
    for q in range(3):
        m.scaled[n, q] = m.d[n, q] = 0.0
    for s in range(n + 1):
        work.moved_in[s] = 0
    count = high - low
    sort_by_height(c, work, low, high)
    for place in range(count):
        pack_row(c, work.contact_item[low + place], m, work, place, n, dt)
    scale = dt / (2.0 * RELAXATION_STIFFNESS)
    share = min(max(speed / QUIET_SPEED, LEAST_QUIET), 1.0)
    limit, far = share * RELAXATION_SPEED * scale, FAR_SPEED * scale
    most = QUIET_SWEEPS if share < 1.0 else RELAXATION_SWEEPS
    sweeps, worst = 0, 1e300
    while (sweeps < most and worst > limit) or (sweeps < LAST_SWEEPS and worst > far):
        worst = sweep(
            work.row, work.row_i, work.row_j, m.d, m.scaled, count, sweeps, work.moved_in, limit
        )
        sweeps += 1
    for place in range(count):
        k = work.contact_item[low + place]
        c[k].normal, c[k].shear = work.row[place, FORCE], work.row[place, FORCE + 1]
    return sweeps
