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
    LEAST_RELAXATION,
    PIN,
    PLAIN,
    QUIET_SWEEPS,
    RELAXATION_SHARE,
    RELAXATION_SPEED,
    RELAXATION_STIFFNESS,
    RELAXATION_SWEEPS,
)
from rigdda.kernel import arithmetic_kernel, inlined, kernel
from rigdda.records import Contacts, Floats, Ints, Matrix, Parameters, Work

# columns of work.row: normal (x, y); moments of a unit force along normal and shear about a and b,
# by direction gain [N/m], free displacement [m], softness [m/N], force [N]; friction, and forces
# that it bears beside [N]; displacement along shear per normal force [m/N]
NORMAL, TURN_A, TURN_B = 0, 2, 4
GAIN, FREE, SOFT, FORCE = 6, 8, 10, 12
FRICTION, COHESION, TENSION, CROSS = 14, 15, 16, 17
COLUMNS = 18


@kernel
def flexibility(inverse: Floats, i: int, e: tuple[float, float, float]) -> float:
    """Return the displacement along e of slot i per force along e [m/N]."""
    return (e[0] * e[0] + e[1] * e[1]) * inverse[i, 0] + e[2] * e[2] * inverse[i, 2]


@inlined
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
    row[place, NORMAL], row[place, NORMAL + 1] = en[0], en[1]
    row[place, TURN_A], row[place, TURN_A + 1] = en[2], es[2]
    row[place, TURN_B], row[place, TURN_B + 1] = fn[2], fs[2]
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
    row[place, CROSS] = en[2] * es[2] * m.scaled[i, 2] + fn[2] * fs[2] * m.scaled[j, 2]
    row[place, COHESION] = math.inf if old.kind == PIN else old.cohesion
    push(m.d, m.scaled, i, en, old.start_normal)
    push(m.d, m.scaled, i, es, old.start_shear)
    push(m.d, m.scaled, j, fn, old.start_normal)
    push(m.d, m.scaled, j, fs, old.start_shear)


@kernel
def push(d: Floats, inverse: Floats, i: int, e: tuple[float, float, float], force: float) -> None:
    """Move slot i by what a force along e displaces it alone."""
    for q in range(3):
        d[i, q] += force * inverse[i, q] * e[q]


@arithmetic_kernel
def sweep(
    row: Floats, row_i: Ints, row_j: Ints, d: Floats, inverse: Floats, count: int, number: int,
    moved_in: Ints, quiet: float,
) -> float:  # fmt: skip
    """Visit every contact once; returns the greatest displacement that a visit changed [m].

    But not where neither body has moved by more than `quiet` [m] in this or the last sweep:
    moved_in[s] is the number of the last sweep in which slot s did.

    A body without unknowns has a slot of its own that nothing moves. A visit reads the bodies once:
    what the normal force changes along the shear direction is added to what was read. Unsigned
    indices spare numba's test for negative ones.
    """
    worst = 0.0
    for visit in range(count):
        place = np.uintp(count - 1 - visit if number % 2 == 1 else visit)
        i, j = np.uintp(row_i[place]), np.uintp(row_j[place])
        if moved_in[i] < number - 1 and moved_in[j] < number - 1:
            continue
        r = row[place]
        nx, ny = r[NORMAL], r[NORMAL + 1]
        turn_i, turn_j, roll_i, roll_j = r[TURN_A], r[TURN_B], r[TURN_A + 1], r[TURN_B + 1]
        u, v, w, u2, v2, w2 = d[i, 0], d[i, 1], d[i, 2], d[j, 0], d[j, 1], d[j, 2]
        apart_x, apart_y = u - u2, v - v2
        moved = (nx * apart_x + ny * apart_y) + (turn_i * w + turn_j * w2)
        slid = (nx * apart_y - ny * apart_x) + (roll_i * w + roll_j * w2)
        force, before = r[FORCE], r[FORCE + 1]
        normal = force + r[GAIN] * ((r[FREE] - force * r[SOFT]) - 2.0 * moved)
        normal = max(normal, -r[TENSION])
        push = normal - force
        limit = r[COHESION] + r[FRICTION] * max(normal, 0.0)
        if push == 0.0 and limit == 0.0 and before == 0.0:
            continue
        shear = before + r[GAIN + 1] * (
            (r[FREE + 1] - before * r[SOFT + 1]) - 2.0 * (slid + r[CROSS] * push)
        )
        shear = min(max(shear, -limit), limit)
        drag = shear - before
        change = abs(push) * r[SOFT]
        worst = max(worst, change)
        light_i, slow_i = inverse[i, 0], inverse[i, 2]
        light_j, slow_j = inverse[j, 0], inverse[j, 2]
        if change + abs(drag) * r[SOFT + 1] > quiet:
            moved_in[i] = number
            if light_j > 0.0:
                moved_in[j] = number
        x, y = push * nx - drag * ny, push * ny + drag * nx
        d[i, 0], d[i, 1] = u + light_i * x, v + light_i * y
        d[j, 0], d[j, 1] = u2 - light_j * x, v2 - light_j * y
        d[i, 2] = w + slow_i * (push * turn_i + drag * roll_i)
        d[j, 2] = w2 + slow_j * (push * turn_j + drag * roll_j)
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
    c: Contacts, m: Matrix, work: Work, low: int, high: int, n: int, speed: float, p: Parameters
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
        pack_row(c, work.contact_item[low + place], m, work, place, n, p.dt)
    scale = p.dt / (2.0 * RELAXATION_STIFFNESS)
    share = max(RELAXATION_SHARE * speed, LEAST_RELAXATION * p.gravity * p.dt)
    tolerance = min(share, p.sweep_tolerance)
    most = QUIET_SWEEPS if tolerance < RELAXATION_SPEED else RELAXATION_SWEEPS
    limit, far = tolerance * scale, FAR_SPEED * scale
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
