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
    RELAXATION_FALL,
    RELAXATION_SHARE,
    RELAXATION_SPEED,
    RELAXATION_STIFFNESS,
    RELAXATION_SWEEPS,
)
from rigdda.kernel import arithmetic_kernel, inlined, kernel
from rigdda.records import Contacts, Floats, Ints, Matrix, Parameters, Work

# columns of work.row, by direction: the rows of the contact for a and b, over the roots of their
# inertia, 2 M / dt^2 [(m/N)^1/2]; force [N]; the share of it that a visit keeps [-], what the
# spring adds [N], and what a displacement takes [N/m]; softness [m/N]. What a normal force takes
# from the shear force [-]; friction; shear and tension that it bears besides [N]
NORMAL, SHEAR = 0, 6
FORCE, KEEP, PULL, GAIN, SOFT = 12, 14, 16, 18, 20
CROSS, FRICTION, COHESION, TENSION = 22, 23, 24, 25
COLUMNS = 26


@kernel
def write_row(row: Floats, first: int, e: tuple[float, float, float], scale: Floats) -> None:
    """Write a row over the roots of the inertia of its body."""
    row[first], row[first + 1], row[first + 2] = e[0] * scale[0], e[1] * scale[1], e[2] * scale[2]


@kernel
def product(row: Floats, first: int, second: int) -> float:
    """Return the displacement along one direction of a contact per force along another [m/N]."""
    total = 0.0
    for q in range(6):
        total += row[first + q] * row[second + q]
    return total


@kernel
def displace(row: Floats, first: int, d: Floats, i: int, j: int, force: float) -> None:
    """Move slots i and j by what a force along one direction of a contact displaces them."""
    for q in range(3):
        d[i, q] += force * row[first + q]
        d[j, q] += force * row[first + 3 + q]


@kernel
def set_spring(row: Floats, direction: int, flexible: float, kappa: float, free: float) -> None:
    """Write what a visit needs of a spring, which is free at a displacement [m].

    Its force is kappa (free - 2 d), at the velocity that ends the step; of the displacement d its
    own part, `flexible` times the force, is solved for.
    """
    gain = kappa / (1.0 + 2.0 * kappa * flexible)
    row[KEEP + direction], row[PULL + direction] = 2.0 * gain * flexible, gain * free
    row[GAIN + direction], row[SOFT + direction] = 2.0 * gain, 1.0 / kappa


@inlined
def pack_row(c: Contacts, k: int, m: Matrix, work: Work, place: int, n: int, dt: float) -> None:
    """Write contact k as row `place` and add its starting force to the displacements.

    Slot n stands for bodies without unknowns.
    """
    row, old = work.row[place], c[k]
    i = work.slot[old.a]
    j = work.slot[old.b] if old.pair >= 0 else n
    work.row_i[place], work.row_j[place] = i, j
    write_row(row, NORMAL, normal_row(c, k, True), m.scaled[i])
    write_row(row, NORMAL + 3, normal_row(c, k, False), m.scaled[j])
    write_row(row, SHEAR, shear_row(c, k, True), m.scaled[i])
    write_row(row, SHEAR + 3, shear_row(c, k, False), m.scaled[j])
    flexible, rolling = product(row, NORMAL, NORMAL), product(row, SHEAR, SHEAR)
    own = old.kind == PLAIN or old.kind == BOLT or old.kind == PIN
    # stiff against the inertia of the blocks
    kappa = old.kappa if own else RELAXATION_STIFFNESS / flexible
    free = old.bias + dt * old.un
    if not own:
        free += old.memory_normal * (1.0 / kappa - 1.0 / old.kappa)
    set_spring(row, 0, flexible, kappa, free)
    kappa = old.kappa if own else RELAXATION_STIFFNESS / rolling
    set_spring(row, 1, rolling, kappa, old.memory_shear / kappa + dt * old.us)
    row[CROSS] = row[GAIN + 1] * product(row, NORMAL, SHEAR)
    row[FRICTION], row[TENSION] = old.friction, old.tension
    row[COHESION] = math.inf if old.kind == PIN else old.cohesion
    row[FORCE], row[FORCE + 1] = old.start_normal, old.start_shear
    displace(row, NORMAL, m.d, i, j, old.start_normal)
    displace(row, SHEAR, m.d, i, j, old.start_shear)


@arithmetic_kernel
def sweep(
    row: Floats, row_i: Ints, row_j: Ints, d: Floats, still: int, count: int, number: int,
    moved_in: Ints, quiet: float,
) -> float:  # fmt: skip
    """Visit every contact once; returns the greatest displacement that a visit changed [m].

    But not where neither body has moved by more than `quiet` [m] in this or the last sweep:
    moved_in[s] is the number of the last sweep in which slot s did. Slot `still` never does.

    A visit reads the bodies once: what the normal force changes along the shear direction is added
    to what was read. Unsigned indices spare numba's test for negative ones.
    """
    worst = 0.0
    for visit in range(count):
        place = np.uintp(count - 1 - visit if number % 2 == 1 else visit)
        i, j = np.uintp(row_i[place]), np.uintp(row_j[place])
        if moved_in[i] < number - 1 and moved_in[j] < number - 1:
            continue
        r = row[place]
        n, s = r[NORMAL : NORMAL + 6], r[SHEAR : SHEAR + 6]
        u, v, w, u2, v2, w2 = d[i, 0], d[i, 1], d[i, 2], d[j, 0], d[j, 1], d[j, 2]
        moved = (n[0] * u + n[1] * v + n[2] * w) + (n[3] * u2 + n[4] * v2 + n[5] * w2)
        slid = (s[0] * u + s[1] * v + s[2] * w) + (s[3] * u2 + s[4] * v2 + s[5] * w2)
        force, before = r[FORCE], r[FORCE + 1]
        normal = (r[KEEP] * force + r[PULL]) - r[GAIN] * moved
        normal = max(normal, -r[TENSION])
        push = normal - force
        limit = r[COHESION] + r[FRICTION] * max(normal, 0.0)
        if push == 0.0 and limit == 0.0 and before == 0.0:
            continue
        shear = (r[KEEP + 1] * before + r[PULL + 1]) - r[GAIN + 1] * slid - r[CROSS] * push
        shear = min(max(shear, -limit), limit)
        drag = shear - before
        change = abs(push) * r[SOFT]
        worst = max(worst, change)
        if change + abs(drag) * r[SOFT + 1] > quiet:
            moved_in[i] = number
            if j != np.uintp(still):
                moved_in[j] = number
        d[i, 0], d[i, 1] = (u + push * n[0]) + drag * s[0], (v + push * n[1]) + drag * s[1]
        d[j, 0], d[j, 1] = (u2 + push * n[3]) + drag * s[3], (v2 + push * n[4]) + drag * s[4]
        d[i, 2], d[j, 2] = (w + push * n[2]) + drag * s[2], (w2 + push * n[5]) + drag * s[5]
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

    The matrix holds inertia and weight only; m.d is set to the displacements. They are times the
    root of the inertia while forces are sought: a row then tells both what moves a contact and what
    its force moves. `speed` is the greatest of the island [m/s].
    """
    for s in range(n):
        for q in range(3):
            m.scaled[s, q] = 1.0 / math.sqrt(m.diagonal[s, q, q])
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
    usual = max(RELAXATION_SPEED, RELAXATION_FALL * p.gravity * p.dt)
    tolerance = min(share, p.sweep_tolerance if p.sweep_tolerance > 0.0 else usual)
    most = QUIET_SWEEPS if tolerance < RELAXATION_SPEED else RELAXATION_SWEEPS
    limit, far = tolerance * scale, FAR_SPEED * scale
    sweeps, worst = 0, 1e300
    while (sweeps < most and worst > limit) or (sweeps < LAST_SWEEPS and worst > far):
        worst = sweep(work.row, work.row_i, work.row_j, m.d, n, count, sweeps, work.moved_in, limit)
        sweeps += 1
    for s in range(n):
        for q in range(3):
            m.d[s, q] *= m.scaled[s, q]
    for place in range(count):
        k = work.contact_item[low + place]
        c[k].normal, c[k].shear = work.row[place, FORCE], work.row[place, FORCE + 1]
    return sweeps
