"""Projected Gauss-Seidel sweeps, which find the impulses of the contacts of an island."""

from __future__ import annotations

import math

import numpy as np

from rigdda.dynamics.arrays import Rows
from rigdda.dynamics.constants import (
    MOST_SWEEPS,
    PROGRESS,
    ROUNDING,
    SET_OF_SWEEPS,
    SUBSTEPS,
)
from rigdda.dynamics.records import Floats
from rigdda.dynamics.rows import (
    AIM,
    AIM_SHEAR,
    BOTH,
    COHESION,
    FLEXIBLE,
    FREE,
    FRICTION,
    GAIN,
    GAIN_SHEAR,
    GOAL,
    IMPULSE,
    INVERSE,
    KEEP,
    KEEP_SHEAR,
    NORMAL,
    NOW,
    REACHED,
    RESIDUE,
    ROLL,
    ROLL_LIMIT,
    ROLLED,
    ROLLING,
    SHEAR,
    STIFFNESS,
    TENSION,
    along_six,
    push,
)
from rigdda.dynamics.slots import copy_velocities, kinetic
from rigdda.kernel import arithmetic_kernel, kernel


@arithmetic_kernel
def turn(row: Floats, a: Floats, b: Floats, impulse: float) -> None:
    """Add a rolling impulse to the slots of both bodies."""
    a[NOW + 2] += impulse * row[ROLL]
    b[NOW + 2] += impulse * row[ROLL + 1]


@kernel
def limit_rolling(rows: Rows, active: int) -> bool:
    """Limit rolling impulses by the present normal impulses; return whether any limit grew."""
    grew = False
    for q in range(active):
        row = rows.row[rows.active[q]]
        if row[ROLLING] > 0.0:
            limit = row[ROLLING] * max(row[IMPULSE], 0.0)
            grew = grew or limit > row[ROLL_LIMIT]
            row[ROLL_LIMIT] = limit
    return grew


@kernel
def list_visits(rows: Rows, active: int, tries: int, number: int) -> int:
    """Write the contacts that the next sweep visits into rows.visit; return their number.

    Contacts that cannot close before substep idle[k] are skipped. After the first sweep of a
    substep, so are contacts of which neither body moved in the last sweep; moved_in[s] is the last
    sweep of the substep in which slot s moved. A contact to be skipped is also written, but the
    next one overwrites it. This avoids a branch that the processor cannot predict.
    """
    visits = 0
    for q in range(active):
        place = rows.active[np.uintp(q)]
        k = np.uintp(place)
        i, j = np.uintp(rows.row_i[k]), np.uintp(rows.row_j[k])
        moved = (rows.moved_in[i] >= tries - 1) | (rows.moved_in[j] >= tries - 1)
        rows.visit[np.uintp(visits)] = place
        visits += int(moved & (rows.idle[k] <= number) & (rows.face[k] > 0))
    return visits


@arithmetic_kernel
def press_row(row: Floats, a: Floats, b: Floats) -> float:
    """Set the normal impulse of a contact; return the change of its normal velocity [m/s]."""
    speed = along_six(row[NORMAL : NORMAL + 6], a, b, NOW)
    before = row[IMPULSE]
    after = max(row[KEEP] * before + row[GAIN] * (row[AIM] - speed), -row[TENSION])
    if after != before:
        push(row, NORMAL, a, b, NOW, after - before)
        row[IMPULSE] = after
    return abs(after - before) * row[FLEXIBLE]


@arithmetic_kernel
def solve_face(
    own: float, other: float, both: float, inverse: float, speed: float, speed_2: float, low: float,
    low_2: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the normal impulses of the two contacts of a face [N s].

    Of the four cases in which each contact either reaches its aim or is open, that one holds in
    which no impulse is less than its limit and no contact closes faster than its aim.

    Parameters
    ----------
    own, other, both, inverse : float
        Change of each normal velocity by its own impulse, and of each by the other's [1/kg], and
        the inverse determinant of the matrix of these [kg2].
    speed, speed_2 : float
        Normal velocities without the impulses, less their aims [m/s].
    low, low_2 : float
        Least impulses [N s].
    """
    one = (both * speed_2 - other * speed) * inverse
    two = (both * speed - own * speed_2) * inverse
    if one >= low and two >= low_2:
        return one, two
    one = max(-(speed + both * low_2) / own, low)
    if speed_2 + both * one + other * low_2 >= 0.0:
        return one, low_2
    two = max(-(speed_2 + both * low) / other, low_2)
    if speed + both * two + own * low >= 0.0:
        return low, two
    return low, low_2


@arithmetic_kernel
def press_face(row: Floats, other: Floats, a: Floats, b: Floats) -> float:
    """Set the normal impulses of the two contacts of a face together.

    One after the other, they converge slowly if the face is narrow: a column of 0.2 x 4 m that
    lands flat would turn and fall. Returns the greatest change of a normal velocity [m/s].
    """
    if row[INVERSE] == 0.0:
        change = press_row(row, a, b)
        return max(change, press_row(other, a, b))
    own, its, both, one, two = (
        row[FLEXIBLE], other[FLEXIBLE], row[BOTH], row[IMPULSE], other[IMPULSE],
    )  # fmt: skip
    speed = along_six(row[NORMAL : NORMAL + 6], a, b, NOW) - row[AIM]
    speed_2 = along_six(other[NORMAL : NORMAL + 6], a, b, NOW) - other[AIM]
    low, low_2 = -row[TENSION], -other[TENSION]
    if one == low and two == low_2 and speed >= 0.0 and speed_2 >= 0.0:
        return 0.0  # both stay open
    speed -= own * one + both * two
    speed_2 -= both * one + its * two
    new, new_2 = solve_face(own, its, both, row[INVERSE], speed, speed_2, low, low_2)
    part = min(row[GAIN] * own, other[GAIN] * its)  # see aim_row
    more = max(part * (new - one), low - one)
    more_2 = max(part * (new_2 - two), low_2 - two)
    for q in range(3):
        a[NOW + q] += more * row[NORMAL + q] + more_2 * other[NORMAL + q]
        b[NOW + q] += more * row[NORMAL + 3 + q] + more_2 * other[NORMAL + 3 + q]
    row[IMPULSE] += more
    other[IMPULSE] += more_2
    return max(abs(own * more + both * more_2), abs(both * more + its * more_2))


@arithmetic_kernel
def drag_row(row: Floats, a: Floats, b: Floats) -> float:
    """Set the shear impulse of a contact; return its change [N s]."""
    slip = along_six(row[SHEAR : SHEAR + 6], a, b, NOW)
    before = row[IMPULSE + 1]
    after = row[KEEP_SHEAR] * before + row[GAIN_SHEAR] * (row[AIM_SHEAR] - slip)
    limit = row[COHESION] + row[FRICTION] * max(row[IMPULSE], 0.0)
    after = min(max(after, -limit), limit)
    if after != before:
        push(row, SHEAR, a, b, NOW, after - before)
        row[IMPULSE + 1] = after
    return abs(after - before)


@arithmetic_kernel
def roll_row(row: Floats, a: Floats, b: Floats) -> float:
    """Set the rolling impulse of a contact; return the change of R times the rotation [m/s]."""
    limit = min(row[ROLL_LIMIT], row[ROLLING] * max(row[IMPULSE], 0.0))
    light = row[ROLL] * row[ROLL] + row[ROLL + 1] * row[ROLL + 1]
    spin = row[ROLL] * a[NOW + 2] + row[ROLL + 1] * b[NOW + 2]
    change = min(max(row[ROLLED] - spin / light, -limit), limit) - row[ROLLED]
    turn(row, a, b, change)
    row[ROLLED] += change
    return abs(change) * light


@arithmetic_kernel
def wait_of(row: Floats, a: Floats, b: Floats, reach: float) -> float:
    """Return the number of substeps in which an open contact cannot close."""
    speed = along_six(row[NORMAL : NORMAL + 6], a, b, NOW)
    return min((speed - row[AIM]) / (reach + abs(speed)), float(SUBSTEPS))


@arithmetic_kernel
def sweep(
    rows: Rows, still: int, visits: int, tries: int, number: int, reach: float, quiet: float
) -> float:
    """Visit the listed contacts once, alternately from the lowest up and from the highest down.

    Returns the greatest change of a normal velocity, or of R times a rate of rotation [m/s];
    changes of shear velocities do not count. An open contact is not visited again until it could
    close at its current speed plus `reach` [m/s]. A slot has moved if its velocity changed by more
    than `quiet` [m/s]; slot `still` never moves. Unsigned indices avoid numba's handling of
    negative ones.
    """
    worst = 0.0
    for q in range(visits):
        place = np.uintp(rows.visit[np.uintp(visits - 1 - q if tries % 2 == 1 else q)])
        i, j = np.uintp(rows.row_i[place]), np.uintp(rows.row_j[place])
        row, a, b = rows.row[place], rows.slot[i], rows.slot[j]
        pair = rows.face[place] == 2
        other = rows.row[place + np.uintp(1 if pair else 0)]
        change = press_face(row, other, a, b) if pair else press_row(row, a, b)
        if change == 0.0 and is_open(row) and is_open(other):
            wait = min(wait_of(row, a, b, reach), wait_of(other, a, b, reach))
            rows.idle[place] = number + int(wait)
            if pair:
                rows.idle[place + np.uintp(1)] = number + int(wait)
            continue
        drag = drag_row(row, a, b)
        if row[ROLL_LIMIT] > 0.0:
            change = max(change, roll_row(row, a, b))
        if pair:
            drag += drag_row(other, a, b)
            if other[ROLL_LIMIT] > 0.0:
                change = max(change, roll_row(other, a, b))
        worst = max(worst, change)
        if change + drag * row[FLEXIBLE] > quiet:
            rows.moved_in[i] = tries
            if j != np.uintp(still):
                rows.moved_in[j] = tries
    return worst


@arithmetic_kernel
def is_open(row: Floats) -> bool:
    """Return whether a contact has no impulse, no strength and no stiffness."""
    free = row[COHESION] == 0.0 and row[STIFFNESS] == 0.0
    return free and row[IMPULSE] == 0.0 and row[IMPULSE + 1] == 0.0


@kernel
def settle(rows: Rows, n: int, active: int, number: int, reach: float, tolerance: float) -> int:
    """Sweep until no velocity changes by more than a tolerance; return the sweeps.

    Normal velocities count, and R times rates of rotation where rolling is resisted. See the module
    docstring on the second set of sweeps.
    """
    sweeps = sweep_until(rows, n, active, number, reach, tolerance, math.inf)
    if limit_rolling(rows, active):
        again = sweep_until(rows, n, active, number, reach, tolerance, math.inf)
        sweeps = max(sweeps, again)
    return sweeps


@kernel
def settle_safely(
    rows: Rows, n: int, active: int, number: int, reach: float, tolerance: float
) -> int:
    """Settle a substep without increasing the energy; return the sweeps.

    If the sweeps neither converge nor lose energy, as where a heavy body squeezes a light one
    aside, they are repeated from contacts without impulses and without extrapolation, which never
    increases the energy.
    """
    sweeps = settle(rows, n, active, number, reach, tolerance)
    if sweeps < MOST_SWEEPS or kinetic(rows.slot, n, NOW) <= kinetic(rows.slot, n, FREE):
        return sweeps
    copy_velocities(rows.slot, n, FREE, NOW)
    for q in range(active):
        row = rows.row[rows.active[q]]
        row[IMPULSE] = row[IMPULSE + 1] = row[ROLLED] = row[ROLL_LIMIT] = 0.0
    return sweep_until(rows, n, active, number, reach, tolerance, -1.0)


@kernel
def extrapolate(rows: Rows, active: int, most: float) -> float:
    """Extrapolate the impulses from their changes by the last sweeps and by those before.

    A set of sweeps is a step of a fixed-point iteration x -> G(x) with the residual r = G(x) - x.
    In Anderson's method of depth one (Anderson 1965), the next x is G - theta dG, where d is the
    change since the last extrapolation and theta = r dr / dr^2. It removes the error that decreases
    most slowly, as that of a heavy body that rests or falls on a light one. An extrapolation that
    does not decrease the square of the residual by `PROGRESS` is taken back, and no
    further extrapolation follows in these sweeps.

    Parameters
    ----------
    most : float
        Greatest square of the residual for which the last extrapolation is kept [J]; inf if there
        was none.

    Returns
    -------
    float
        The same for the next call, or -1 if the last extrapolation was taken back.
    """
    square = slope = curvature = 0.0
    for place in range(active):
        k = rows.active[place]
        row, fact = rows.row[k], rows.fact[k]
        for q in range(2):
            residue = row[IMPULSE + q] - fact[REACHED + q]
            change = residue - fact[RESIDUE + q]
            square += row[FLEXIBLE] * residue * residue
            slope += row[FLEXIBLE] * residue * change
            curvature += row[FLEXIBLE] * change * change
    failed = square > most
    slows = curvature > ROUNDING * square  # else the change of the residual is rounding
    share = max(-slope / curvature, 0.0) if slows and not failed else 0.0
    for place in range(active):
        k = rows.active[place]
        row, fact = rows.row[k], rows.fact[k]
        a, b = rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        for q in range(2):
            goal = row[IMPULSE + q]
            more = fact[GOAL + q] - goal if failed else share * (goal - fact[GOAL + q])
            push(row, NORMAL if q == 0 else SHEAR, a, b, NOW, more)
            fact[RESIDUE + q] = goal - fact[REACHED + q]
            fact[GOAL + q] = goal
            fact[REACHED + q] = row[IMPULSE + q] = goal + more
    if failed:
        return -1.0
    return (1.0 - PROGRESS) * square if share > 0.0 else math.inf


@kernel
def sweep_until(
    rows: Rows, n: int, active: int, number: int, reach: float, tolerance: float, most: float
) -> int:
    """Sweep until no velocity changes by more than a tolerance, or `MOST_SWEEPS` times.

    `most` is inf, or -1 to sweep without extrapolation, see `extrapolate`.
    """
    start_extrapolation(rows, active)
    for s in range(n + 1):
        rows.moved_in[s] = -1
    for tries in range(MOST_SWEEPS):
        visits = list_visits(rows, active, tries, number)
        worst = sweep(rows, n, visits, tries, number, reach, tolerance)
        if worst <= tolerance:
            return tries + 1
        if (tries + 1) % SET_OF_SWEEPS == 0 and most >= 0.0 and tries + 1 < MOST_SWEEPS:
            most = extrapolate(rows, active, most)
            for s in range(n + 1):
                rows.moved_in[s] = tries
    return MOST_SWEEPS


@kernel
def start_extrapolation(rows: Rows, active: int) -> None:
    """Begin to extrapolate the impulses from their present values."""
    for place in range(active):
        k = rows.active[place]
        row, fact = rows.row[k], rows.fact[k]
        for q in range(2):
            fact[REACHED + q], fact[RESIDUE + q], fact[GOAL + q] = row[IMPULSE + q], 0.0, 0.0
