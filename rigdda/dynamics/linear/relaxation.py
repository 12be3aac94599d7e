r"""Projected relaxation of contact forces in substeps, for islands in motion.

In an avalanche many contacts open, close, stick and slip in one step, and open-close iteration
around a global solve does not settle. Relaxation decides the state of each contact as it visits
it: the normal force is kept from pulling, the shear force within its friction limit. A blow on one
block reaches the others contact by contact; many short steps of few sweeps find where it takes them
better than one step of many (Macklin et al. 2019, Small steps in physics simulation). So the step
is taken in substeps, of length h, along the normals and with the arms of the step:

.. math:: d_s = d_{s-1} + \frac{h^2}{M} \Bigl(F + \sum_c f_c e_c^t\Bigr), \qquad D_s = D_{s-1} + d_s

with d the displacement of a block in a substep and D that since the start of the step, F its weight
and loads, f_c the force of a contact and e_c its row. A contact whose gap g + e D is open may close
by that gap, one that is closed not at all; an impact that has closed leaves by what its restitution
asks for. Forces start from those of the last substep, so that d starts as 2 d_{s-1} - d_{s-2}.

The sweeps of a substep end at a tolerance, so that closed contacts may close a little more. That is
pushed out at the end of the step, see `recovery`. At rest the global solve takes over.
"""

from __future__ import annotations

import math

import numpy as np

from rigdda.dynamics.arrays import Islands, Motion, Rows
from rigdda.dynamics.assembly.island import damping_of
from rigdda.dynamics.constants import (
    LARGE_ISLAND,
    MOST_SWEEPS,
    RELAXATION_SHARE,
    SUBSTEPS,
)
from rigdda.dynamics.linear.rows import (
    AIM,
    BEFORE,
    COHESION,
    CROSS,
    FLEXIBLE,
    FORCE,
    FREE,
    FRICTION,
    GAIN,
    GAIN_SHEAR,
    GAP,
    HERE,
    HIT,
    KEEP,
    KEEP_SHEAR,
    NORMAL,
    NOW,
    REBOUND,
    SHEAR,
    SO_FAR,
    TENSION,
    add_up,
    along_six,
    pack_row,
    sort_by_height,
)
from rigdda.dynamics.records import Bodies, Body, Contacts, Floats, Ints, Parameters
from rigdda.kernel import arithmetic_kernel, inlined, kernel


@kernel
def list_visits(rows: Rows, count: int, tries: int, number: int) -> int:
    """Write the contacts that the next sweep is to visit into rows.visit; returns how many.

    Not those that cannot close before substep idle[k]; nor, after the first sweep of a substep,
    where neither body has moved in the last one: moved_in[s] is the number of the last sweep of the
    substep in which slot s did. Every contact is written, and the next one over it if it is not to
    be visited: branches that go either way would cost more than the visits.
    """
    visits = 0
    for place in range(count):
        k = np.uintp(place)
        i, j = np.uintp(rows.row_i[k]), np.uintp(rows.row_j[k])
        moved = (rows.moved_in[i] >= tries - 1) | (rows.moved_in[j] >= tries - 1)
        rows.visit[np.uintp(visits)] = place
        visits += int(moved & (rows.idle[k] <= number))
    return visits


@arithmetic_kernel
def sweep(
    row: Floats, row_i: Ints, row_j: Ints, motion: Floats, still: int, visit: Ints, visits: int,
    tries: int, number: int, idle: Ints, reach: float, moved_in: Ints, quiet: float,
) -> float:  # fmt: skip
    """Visit the contacts listed once, from the lowest up, or down.

    Returns the greatest change of a normal displacement [m]; shear does not count. One that is open
    is not visited for as long as it cannot close, at the speed at which it moves now and `reach`
    [m] a substep besides. A slot has moved if it did by more than `quiet` [m]; slot `still` never
    does.

    A visit reads the bodies once: what the normal force changes along the shear direction is added
    to what was read. Unsigned indices spare numba's test for negative ones.
    """
    worst = 0.0
    for q in range(visits):
        place = np.uintp(visit[np.uintp(visits - 1 - q if tries % 2 == 1 else q)])
        i, j = np.uintp(row_i[place]), np.uintp(row_j[place])
        r, a, b = row[place], motion[i], motion[j]
        n, s = r[NORMAL : NORMAL + 6], r[SHEAR : SHEAR + 6]
        u, v, w, u2, v2, w2 = a[0], a[1], a[2], b[0], b[1], b[2]
        moved = (n[0] * u + n[1] * v + n[2] * w) + (n[3] * u2 + n[4] * v2 + n[5] * w2)
        if tries == 0:
            r[HERE] = r[GAP] + along_six(n, a, b, SO_FAR)
        gap, force, before = r[HERE], r[FORCE], r[FORCE + 1]
        aim = min(r[AIM], -gap)
        if gap <= 0.0 and r[REBOUND] > moved and (r[HIT] < 0.0 or r[HIT] == number):
            aim, r[HIT] = r[REBOUND], number
        normal = max(r[KEEP] * force + r[GAIN] * (aim - moved), -r[TENSION])
        if normal == 0.0 and force == 0.0 and before == 0.0 and r[COHESION] == 0.0:
            if r[AIM] < math.inf:
                wait = (moved - aim) / (reach + abs(moved))
                idle[place] = number + int(min(wait, float(SUBSTEPS)))
            continue
        push = normal - force
        change = abs(push) * r[FLEXIBLE]
        worst = max(worst, change)
        slid = (s[0] * u + s[1] * v + s[2] * w) + (s[3] * u2 + s[4] * v2 + s[5] * w2)
        if r[AIM] == math.inf:
            slid += along_six(s, a, b, SO_FAR) - r[FREE]
        shear = r[KEEP_SHEAR] * before - r[GAIN_SHEAR] * slid - r[CROSS] * push
        limit = r[COHESION] + r[FRICTION] * max(normal, 0.0)
        shear = min(max(shear, -limit), limit)
        drag = shear - before
        if change + abs(drag) * r[FLEXIBLE] > quiet:
            moved_in[i] = tries
            if j != np.uintp(still):
                moved_in[j] = tries
        a[0], a[1] = (u + push * n[0]) + drag * s[0], (v + push * n[1]) + drag * s[1]
        b[0], b[1] = (u2 + push * n[3]) + drag * s[3], (v2 + push * n[4]) + drag * s[4]
        a[2], b[2] = (w + push * n[2]) + drag * s[2], (w2 + push * n[5]) + drag * s[5]
        add_up(r, number)
        r[FORCE], r[FORCE + 1] = normal, shear
    return worst


@inlined
def start(body: Body, rhs: Floats, rows: Rows, s: int, h: float, p: Parameters) -> None:
    """Set the displacement of a block, slot s, in the first substep without contacts."""
    v, alpha = (body.vx, body.vy, body.omega), damping_of(body, p)
    for q in range(3):
        inertia = body.inertia if q == 2 else body.mass
        scale = h / math.sqrt(inertia)
        pull = (rhs[s, q] - 2.0 * inertia * v[q] / p.dt) / inertia - alpha * v[q]
        rows.scale[s, q] = scale
        rows.motion[s, BEFORE + q] = h * v[q] / scale
        rows.motion[s, NOW + q] = (h * v[q] + h * h * pull) / scale
        rows.motion[s, SO_FAR + q] = 0.0


@kernel
def go_on(motion: Floats, n: int, last: bool) -> None:
    """End a substep: add its displacements, start the next with the accelerations of this one."""
    for s in range(n):
        for q in range(3):
            now = motion[s, NOW + q]
            motion[s, SO_FAR + q] += now
            if not last:
                motion[s, NOW + q] = 2.0 * now - motion[s, BEFORE + q]
                motion[s, BEFORE + q] = now


@kernel
def relax_forces(
    bodies: Bodies, contacts: Contacts, rhs: Floats, found: Motion, islands: Islands, rows: Rows,
    island: int, speed: float, p: Parameters,
) -> int:  # fmt: skip
    """Find the forces of an island in substeps, in the rows of its contacts: see `take_forces`.

    `speed` is the greatest of the island [m/s]. `rhs` holds inertia, weight and loads. found.d is
    set to the displacements at constant mean force, found.relaxed to what the blocks move besides,
    since forces act early or late in the step. Returns the number of sweeps.
    """
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    first = islands.block_start[island]
    n = islands.block_start[island + 1] - first
    h, motion = p.dt / SUBSTEPS, rows.motion
    usual = p.sweep_tolerance * min(n / LARGE_ISLAND, 1.0)
    tolerance = min(RELAXATION_SHARE * speed, usual)
    for s in range(n):
        start(bodies[islands.block_item[first + s]], rhs, rows, s, h, p)
    for q in range(3):
        rows.scale[n, q] = 0.0
        motion[n, NOW + q] = motion[n, SO_FAR + q] = motion[n, BEFORE + q] = 0.0
    sort_by_height(contacts, islands, rows, low, high)
    for q in range(low, high):
        c = contacts[islands.contact_item[q]]
        pack_row(c, islands, rows, rows.place[q], n)
    sweeps = 0
    for number in range(SUBSTEPS):
        for s in range(n + 1):
            rows.moved_in[s] = -1
        for tries in range(MOST_SWEEPS):
            visits = list_visits(rows, high - low, tries, number)
            worst = sweep(
                rows.row, rows.row_i, rows.row_j, motion, n, rows.visit, visits, tries, number,
                rows.idle, speed * h, rows.moved_in, tolerance * h,
            )  # fmt: skip
            sweeps += 1
            if worst <= tolerance * h:
                break
        go_on(motion, n, number == SUBSTEPS - 1)
    for s in range(n):
        body = bodies[islands.block_item[first + s]]
        v = body.vx, body.vy, body.omega
        for q in range(3):
            scale = rows.scale[s, q]
            found.d[s, q] = 0.5 * p.dt * (v[q] + motion[s, NOW + q] * scale / h)
            found.relaxed[s, q] = motion[s, SO_FAR + q] * scale - found.d[s, q]
    return sweeps
