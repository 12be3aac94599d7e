r"""Relaxation: the motion of an island whose contacts open, close, stick, slip and are struck.

The step is taken in `SUBSTEPS` substeps of length h, each with the geometry of its start. Bodies
move by the leapfrog scheme: contacts, weight and loads act as impulses at the ends of substeps, at
both ends of the step with half of the time, and between them bodies move straight,

.. math:: v \leftarrow v + \frac{k}{M} F + \frac{1}{M} \sum_c p_c e_c^t, \qquad x \leftarrow x + h v,

with k = h, or h / 2 at the ends of the step, F weight and loads, p_c the impulse of a contact and
e_c its row. So a body that touches nothing moves exactly as under a constant force, and momentum
and angular momentum are kept whatever the impulses are.

Impulses are found by projected Gauss-Seidel sweeps, which decide the state of each contact as they
visit it. The normal impulse does not pull. It leaves an open contact at most the velocity with
which its gap closes within the substep, a closed one none. The shear impulse stops the bodies from
slipping, within the friction limit. Many short substeps of few sweeps find where a blow goes better
than one step of many (Macklin et al. 2019, Small steps in physics simulation).

A contact that closes faster than gravity would make it close in `IMPACT_STEPS` substeps is struck.
In the substep in which that happens it is plastic; in the next one it opens with the velocity that
its restitution asks for, together with all others that were struck in the same substep.

Contacts close a little more than they should: sweeps end at a tolerance, and bodies turn in a
substep. What is too deep is pushed out at the end of the step, see `correction`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Rows
from rigdda.dynamics.assembly.island import damping_of, load_moment
from rigdda.dynamics.constants import (
    AT_ONCE,
    IMPACT_STEPS,
    LARGE_ISLAND,
    MOST_SUBSTEPS,
    MOST_SWEEPS,
    RELAXATION_SHARE,
    SUBSTEPS,
)
from rigdda.dynamics.records import Bodies, Body, Floats, Ints, Parameters
from rigdda.dynamics.rows import (
    AIM,
    AIM_SHEAR,
    BEFORE,
    BEND,
    BOUNCE,
    CARRIED,
    COHESION,
    COS,
    CROSS,
    DAMPING,
    FIELD,
    FLEXIBLE,
    FREE,
    FREE_GAP,
    FREE_SHEAR,
    FRICTION,
    GAIN,
    GAIN_SHEAR,
    GAP,
    IMPULSE,
    KEEP,
    KEEP_SHEAR,
    MOST,
    NORMAL,
    NOW,
    PULL,
    RESTITUTION,
    SHEAR,
    SIN,
    STIFFNESS,
    STRENGTH,
    STRUCK,
    SUM,
    TENSION,
    TURN,
    WORK,
    WORK_ON_A,
    X,
    Y,
    along_six,
    place_row,
    push,
)
from rigdda.kernel import arithmetic_kernel, inlined, kernel


@kernel
def start_slot(body: Body, slot: Floats, scale: Floats, p: Parameters) -> None:
    """Set a slot from its body: where it is, how it moves, and what pulls it."""
    damping = damping_of(body, p)
    for q in range(3):
        inertia = body.inertia if q == 2 else body.mass
        scale[q] = 1.0 / math.sqrt(inertia)
    slot[NOW], slot[NOW + 1] = body.vx / scale[0], body.vy / scale[1]
    slot[NOW + 2] = body.omega / scale[2]
    slot[PULL] = p.field_x / scale[0] + body.force_x * scale[0]
    slot[PULL + 1] = p.field_y / scale[1] + body.force_y * scale[1]
    slot[PULL + 2] = load_moment(body) * scale[2]
    slot[X], slot[Y], slot[TURN], slot[COS], slot[SIN] = body.x, body.y, 0.0, 1.0, 0.0
    slot[DAMPING], slot[FIELD] = damping, 0.0


@kernel
def rest_slot(slot: Floats, scale: Floats) -> None:
    """Set the slot that stands for what does not move, with the origin as its place."""
    for q in range(len(slot)):
        slot[q] = 0.0
    slot[COS] = 1.0
    for q in range(3):
        scale[q] = 0.0


@inlined
def start_slots(
    bodies: Bodies, islands: Islands, rows: Rows, island: int, p: Parameters
) -> None:
    """Set the slots of an island from its bodies, and the one for what does not move."""
    first = islands.block_start[island]
    n = islands.block_start[island + 1] - first
    for s in range(n):
        start_slot(bodies[islands.block_item[first + s]], rows.slot[s], rows.scale[s], p)
    rest_slot(rows.slot[n], rows.scale[n])


@kernel
def kick(slots: Floats, n: int, time: float) -> None:
    """Let weight, loads and damping act for a time."""
    for s in range(n):
        slot = slots[s]
        half = 0.5 * time * slot[DAMPING]
        for q in range(3):
            slot[BEFORE + q] = slot[NOW + q]
            after = ((1.0 - half) * slot[NOW + q] + time * slot[PULL + q]) / (1.0 + half)
            slot[NOW + q] = slot[FREE + q] = after


@kernel
def account_kick(slots: Floats, n: int, time: float) -> float:
    """Add up the work of weight and loads in a kick; returns that of damping [J].

    Each impulse, of contacts too, works along the mean of the velocities before and after all of
    them.
    """
    lost = 0.0
    for s in range(n):
        slot = slots[s]
        for q in range(3):
            mean = 0.5 * (slot[BEFORE + q] + slot[NOW + q])
            slot[FIELD] += time * slot[PULL + q] * mean
            lost -= 0.5 * time * slot[DAMPING] * (slot[BEFORE + q] + slot[FREE + q]) * mean
    return lost


@kernel
def drift(slots: Floats, scale: Floats, n: int, h: float) -> None:
    """Move the bodies straight for a substep."""
    for s in range(n):
        slot = slots[s]
        slot[X] += h * slot[NOW] * scale[s, 0]
        slot[Y] += h * slot[NOW + 1] * scale[s, 1]
        slot[TURN] += h * slot[NOW + 2] * scale[s, 2]
        slot[COS], slot[SIN] = math.cos(slot[TURN]), math.sin(slot[TURN])


@arithmetic_kernel
def aim_row(row: Floats, a: Floats, b: Floats, before: float, h: float) -> None:
    """Set what a visit needs of a row whose impulse acts between two substeps, `before` and h [s].

    An open contact may close by its gap, less what it opens by itself as the bodies turn. A spring
    acts with its forces in the middle of both substeps (the implicit midpoint rule), so that it
    keeps energy at any step.
    """
    time = 0.5 * (before + h)
    flexible = rolling = cross = 0.0
    for q in range(6):
        flexible += row[NORMAL + q] * row[NORMAL + q]
        rolling += row[SHEAR + q] * row[SHEAR + q]
        cross += row[NORMAL + q] * row[SHEAR + q]
    row[FLEXIBLE] = flexible
    row[COHESION], row[TENSION] = time * row[STRENGTH], time * row[STRENGTH + 1]
    row[MOST] = time * row[STRENGTH + 2]
    if row[STIFFNESS] == 0.0:
        row[KEEP] = row[KEEP_SHEAR] = 1.0
        row[GAIN], row[GAIN_SHEAR] = 1.0 / flexible, 1.0 / rolling
        row[AIM], row[AIM_SHEAR] = -0.5 * h * row[BEND], 0.0
        if row[STRENGTH] == math.inf:  # a pin, which `mend_links` puts in its place
            row[AIM_SHEAR] = -0.5 * h * row[BEND + 1]
        elif row[BOUNCE] > 0.0:
            row[AIM], row[TENSION] = row[BOUNCE], -row[IMPULSE]  # it does not pull
        elif h == 0.0 and row[IMPULSE] == 0.0:  # what strikes now does so in the next step
            row[AIM] = -math.inf
        elif row[GAP] > 0.0:
            row[AIM] -= row[GAP] / (h if h > 0.0 else time)
    else:
        give = 0.25 * row[STIFFNESS] * (h * h + 1e-12 * time * time)
        row[KEEP] = give * flexible / (1.0 + give * flexible)
        row[KEEP_SHEAR] = give * rolling / (1.0 + give * rolling)
        row[GAIN], row[GAIN_SHEAR] = give / (1.0 + give * flexible), give / (1.0 + give * rolling)
        stretch = time * (row[GAP] - row[FREE_GAP])
        stretch -= 0.25 * before * before * along_six(row[NORMAL : NORMAL + 6], a, b, NOW)
        row[AIM] = -row[STIFFNESS] * stretch / give
        slip = -time * row[FREE_SHEAR]
        slip -= 0.25 * before * before * along_six(row[SHEAR : SHEAR + 6], a, b, NOW)
        row[AIM_SHEAR] = -row[STIFFNESS] * slip / give
    row[CROSS] = row[GAIN_SHEAR] * cross


@kernel
def place_rows(rows: Rows, count: int, number: int) -> None:
    """Write gap and directions of all contacts that may close before substep `number` ends."""
    for place in range(count):
        k = np.uintp(place)
        if rows.idle[k] <= number:
            i, j = np.uintp(rows.row_i[k]), np.uintp(rows.row_j[k])
            a, b = rows.slot[i], rows.slot[j]
            place_row(rows.row[k], rows.form[k], a, b, rows.scale[i], rows.scale[j])


@kernel
def time_to_blow(rows: Rows, count: int, most: float, least: float) -> float:
    """Return in what time, at most `most`, an open contact closes faster than `least` [m/s].

    It is 0 where one that is closed does so, or has to open after a blow.
    """
    for k in range(count):
        row, a, b = rows.row[k], rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        if row[BOUNCE] > 0.0:
            return 0.0
        closing = -along_six(row[NORMAL : NORMAL + 6], a, b, NOW)
        pull = -along_six(row[NORMAL : NORMAL + 6], a, b, PULL)
        root = math.sqrt(max(closing * closing + 2.0 * pull * max(row[GAP], 0.0), 0.0))
        if root > least and closing + root > 0.0 and row[STIFFNESS] == 0.0:
            most = min(most, 2.0 * max(row[GAP], 0.0) / (closing + root))
    return most


@kernel
def start_impulses(rows: Rows, count: int, number: int, ratio: float) -> None:
    """Let contacts act as before, `ratio` times as long; what was struck goes on."""
    for place in range(count):
        k = np.uintp(place)
        row = rows.row[k]
        if rows.idle[k] > number:
            continue
        a, b = rows.slot[np.uintp(rows.row_i[k])], rows.slot[np.uintp(rows.row_j[k])]
        if row[BOUNCE] > 0.0:
            row[CARRIED], row[CARRIED + 1] = row[IMPULSE], row[IMPULSE + 1]
            continue
        row[CARRIED] = row[CARRIED + 1] = 0.0
        if row[IMPULSE] != 0.0 or row[IMPULSE + 1] != 0.0:
            row[IMPULSE] *= ratio
            row[IMPULSE + 1] *= ratio
            push(row, NORMAL, a, b, NOW, row[IMPULSE])
            push(row, SHEAR, a, b, NOW, row[IMPULSE + 1])


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
    row: Floats, row_i: Ints, row_j: Ints, slot: Floats, still: int, visit: Ints, visits: int,
    tries: int, number: int, idle: Ints, reach: float, moved_in: Ints, quiet: float,
) -> float:  # fmt: skip
    """Visit the contacts listed once, from the lowest up, or down.

    Returns the greatest change of a normal velocity [m/s]; shear does not count. One that is open
    is not visited for as long as it cannot close, at the speed at which it moves now and `reach`
    [m/s] besides. A slot has moved if its velocity changed by more than `quiet` [m/s]; slot `still`
    never does.

    A visit reads the bodies once: what the normal impulse changes along the shear direction is
    added to what was read. Unsigned indices spare numba's test for negative ones.
    """
    worst = 0.0
    for q in range(visits):
        place = np.uintp(visit[np.uintp(visits - 1 - q if tries % 2 == 1 else q)])
        i, j = np.uintp(row_i[place]), np.uintp(row_j[place])
        r, a, b = row[place], slot[i], slot[j]
        n, s = r[NORMAL : NORMAL + 6], r[SHEAR : SHEAR + 6]
        u, v, w, u2, v2, w2 = a[0], a[1], a[2], b[0], b[1], b[2]
        speed = (n[0] * u + n[1] * v + n[2] * w) + (n[3] * u2 + n[4] * v2 + n[5] * w2)
        force, before = r[IMPULSE], r[IMPULSE + 1]
        normal = r[KEEP] * force + r[GAIN] * (r[AIM] - speed)
        normal = min(max(normal, -r[TENSION]), r[MOST])
        if normal == 0.0 and force == 0.0 and before == 0.0 and r[COHESION] == 0.0:
            if r[STIFFNESS] == 0.0:
                wait = (speed - r[AIM]) / (reach + abs(speed))
                idle[place] = number + int(min(wait, float(SUBSTEPS)))
            continue
        change = (normal - force) * r[FLEXIBLE]
        worst = max(worst, abs(change))
        slip = (s[0] * u + s[1] * v + s[2] * w) + (s[3] * u2 + s[4] * v2 + s[5] * w2)
        more = normal - force
        shear = r[KEEP_SHEAR] * before + r[GAIN_SHEAR] * (r[AIM_SHEAR] - slip) - r[CROSS] * more
        limit = r[COHESION] + r[FRICTION] * max(normal, 0.0)
        shear = min(max(shear, -limit), limit)
        drag = shear - before
        if abs(change) + abs(drag) * r[FLEXIBLE] > quiet:
            moved_in[i] = tries
            if j != np.uintp(still):
                moved_in[j] = tries
        a[0], a[1] = (u + more * n[0]) + drag * s[0], (v + more * n[1]) + drag * s[1]
        b[0], b[1] = (u2 + more * n[3]) + drag * s[3], (v2 + more * n[4]) + drag * s[4]
        a[2], b[2] = (w + more * n[2]) + drag * s[2], (w2 + more * n[5]) + drag * s[5]
        r[IMPULSE], r[IMPULSE + 1] = normal, shear
    return worst


@arithmetic_kernel
def end_row(row: Floats, a: Floats, b: Floats, least: float) -> bool:
    """Count the impulses of a row and their work, and note whether it was struck.

    It was if it closed faster than `least` [m/s] before its bodies touched others. What it was
    struck with goes on into the next substep, so that both are one blow; no other impulse of a blow
    starts the next substep.
    """
    normal, shear = row[IMPULSE] - row[CARRIED], row[IMPULSE + 1] - row[CARRIED + 1]
    row[SUM] += normal
    row[SUM + 1] += shear
    own = normal_work = shear_work = 0.0
    for q in range(3):
        mean, mean_b = 0.5 * (a[NOW + q] + a[BEFORE + q]), 0.5 * (b[NOW + q] + b[BEFORE + q])
        normal_work += row[NORMAL + q] * mean + row[NORMAL + 3 + q] * mean_b
        shear_work += row[SHEAR + q] * mean + row[SHEAR + 3 + q] * mean_b
        own += (normal * row[NORMAL + q] + shear * row[SHEAR + q]) * mean
    row[WORK] += normal * normal_work
    row[WORK + 1] += shear * shear_work
    row[WORK_ON_A] += own
    if row[STIFFNESS] > 0.0:
        return False
    if row[BOUNCE] > 0.0:
        row[BOUNCE] = row[IMPULSE] = row[IMPULSE + 1] = 0.0
        return True
    closing = -along_six(row[NORMAL : NORMAL + 6], a, b, FREE)
    if row[IMPULSE] <= 0.0 or closing <= least:
        return False
    row[STRUCK], row[BOUNCE] = 1.0, row[RESTITUTION] * closing
    return True


@kernel
def end_rows(rows: Rows, count: int, number: int, least: float) -> bool:
    """End a substep for its contacts; returns whether one was struck."""
    struck = False
    for place in range(count):
        k = np.uintp(place)
        row = rows.row[k]
        if rows.idle[k] > number or (row[IMPULSE] == 0.0 and row[IMPULSE + 1] == 0.0):
            row[BOUNCE] = 0.0
            continue
        a, b = rows.slot[np.uintp(rows.row_i[k])], rows.slot[np.uintp(rows.row_j[k])]
        struck = end_row(row, a, b, least) or struck
    return struck


@kernel
def settle(
    rows: Rows, n: int, count: int, number: int, reach: float, tolerance: float
) -> int:  # fmt: skip
    """Sweep until no normal velocity changes by more than a tolerance; returns how often."""
    for s in range(n + 1):
        rows.moved_in[s] = -1
    for tries in range(MOST_SWEEPS):
        visits = list_visits(rows, count, tries, number)
        worst = sweep(
            rows.row, rows.row_i, rows.row_j, rows.slot, n, rows.visit, visits, tries, number,
            rows.idle, reach, rows.moved_in, tolerance,
        )  # fmt: skip
        if worst <= tolerance:
            return tries + 1
    return MOST_SWEEPS


@kernel
def work_of_contacts(rows: Rows, count: int, number: int) -> tuple[float, bool]:
    """Return the work of all contacts in this substep [J], and whether one opens after a blow."""
    total, bouncing = 0.0, False
    for place in range(count):
        k = np.uintp(place)
        row = rows.row[k]
        if rows.idle[k] > number or row[STIFFNESS] > 0.0:
            continue
        bouncing = bouncing or row[BOUNCE] > 0.0
        normal, shear = row[IMPULSE] - row[CARRIED], row[IMPULSE + 1] - row[CARRIED + 1]
        if normal == 0.0 and shear == 0.0:
            continue
        a, b = rows.slot[np.uintp(rows.row_i[k])], rows.slot[np.uintp(rows.row_j[k])]
        for q in range(3):
            mean, mean_b = 0.5 * (a[NOW + q] + a[FREE + q]), 0.5 * (b[NOW + q] + b[FREE + q])
            total += (normal * row[NORMAL + q] + shear * row[SHEAR + q]) * mean
            total += (normal * row[NORMAL + 3 + q] + shear * row[SHEAR + 3 + q]) * mean_b
    return total, bouncing


@kernel
def lessen_bounce(rows: Rows, n: int, count: int, number: int, share: float) -> None:
    """Set an island back to the start of its substep, with a share of the restitution."""
    for s in range(n):
        for q in range(3):
            rows.slot[s, NOW + q] = rows.slot[s, FREE + q]
    for k in range(count):
        row = rows.row[k]
        if rows.idle[k] <= number:
            row[IMPULSE], row[IMPULSE + 1] = row[CARRIED], row[CARRIED + 1]
            if row[BOUNCE] > 0.0:
                row[AIM] = share * row[BOUNCE]


@kernel
def relax(
    rows: Rows, n: int, count: int, speed: float, p: Parameters, ledger: NDArray
) -> tuple[int, bool]:
    """Move the slots of an island through the step, with the impulses of its contacts.

    The substeps of a lone body end where it is struck.

    Parameters
    ----------
    rows : Rows
        Slots of the n bodies and rows of the `count` contacts, at the start of the step.
    speed : float
        Greatest speed of the island [m/s].

    Returns
    -------
    sweeps : int
        Number of sweeps.
    struck : bool
        Whether a contact was struck.
    """
    usual = p.dt / SUBSTEPS
    most = p.sweep_tolerance * min((n - 1) / LARGE_ISLAND, 1.0) + 1e-7 * speed
    tolerance = min(RELAXATION_SHARE * speed, most)
    least = IMPACT_STEPS * p.gravity * (usual if n == 1 else p.dt)
    sweeps, struck, last, before, left, number = 0, False, 1.0, 0.0, p.dt, 0
    alone, shortest, reach = n == 1, usual, speed
    if alone:
        shortest, reach = AT_ONCE * p.dt, math.inf
    parts, taken, hit = 0, 0.0, False
    while True:
        place_rows(rows, count, number)
        h = min(usual, left)
        if alone and parts < MOST_SUBSTEPS:
            h = min(h, max(time_to_blow(rows, count, h, least), shortest))
        if left - h < 0.5 * shortest:
            h = left
        time = 0.5 * (before + h)
        for k in range(count):
            if rows.idle[k] <= number:
                a, b = rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
                aim_row(rows.row[k], a, b, before, h)
        kick(rows.slot, n, time)
        ratio = time / last
        start_impulses(rows, count, number, min(ratio, 1.0) if hit else ratio)
        sweeps += settle(rows, n, count, number, reach, tolerance)
        work, bouncing = work_of_contacts(rows, count, number)
        if bouncing and taken + work > 0.0:
            lessen_bounce(rows, n, count, number, -taken / work)
            sweeps += settle(rows, n, count, number, reach, tolerance)
            work, bouncing = work_of_contacts(rows, count, number)
            if taken + work > 0.0:
                lessen_bounce(rows, n, count, number, 0.0)
                sweeps += settle(rows, n, count, number, reach, tolerance)
                work, bouncing = work_of_contacts(rows, count, number)
        taken = min(work, 0.0)
        ledger[2] += account_kick(rows.slot, n, time)
        hit = end_rows(rows, count, number, least)
        struck = struck or hit
        last, before = time, h
        if left <= 0.0:
            break
        drift(rows.slot, rows.scale, n, h)
        left = left - h if h < left else 0.0
        number += 0 if alone else 1
        parts += 1
    for place in range(count):  # a force again
        rows.row[place, IMPULSE] /= last
        rows.row[place, IMPULSE + 1] /= last
    return sweeps, struck
