r"""Relaxation: motion of an island whose contacts open, close, stick, slip and undergo impacts.

The step is divided into `SUBSTEPS` substeps of length h. In each, weight, loads and contacts act as
impulses, with the geometry of the start of the substep; then the bodies move with their new
velocities,

.. math:: v \leftarrow v + \frac{1}{M} \Bigl(h F + \sum_c p_c e_c^t\Bigr), \qquad
    x \leftarrow x + h v,

where F is weight and loads, p_c the impulse of a contact and e_c its row. (A body without contact
impulses moves with the mean of its old and new velocity, as under a constant force.) Linear and
angular momentum are conserved for any impulses.

A lone body takes a single substep, or several that end at its impacts. Its contacts act with the
geometry of the middle of the substep. This is accurate to second order, because no impact occurs
within the substep. The distance that a wheel of sixteen sides rolls is too large by a fraction of
1e-4; with ten substeps and the geometry of their start, it would be too large by 8e-4.

The impulses are found by projected Gauss-Seidel sweeps, which decide the state of each contact as
they visit it. The normal impulse cannot pull. It limits the closing velocity of an open contact to
that which just closes its gap within the substep, and stops the approach of a closed contact. The
two contacts of a face are solved together (`press_face`). The shear impulse stops slip within the
friction limit. Many short substeps with few sweeps resolve the path of an impact better than one
step with many sweeps (Macklin et al. 2019, Small steps in physics simulation). After each
`SET_OF_SWEEPS` sweeps, the impulses are extrapolated (`extrapolate`), without which heavy bodies on
light ones would rebound from plastic impacts.

Rolling resistance is a moment of at most c N R against the relative rotation of the bodies of a
contact, where R is the radius of gyration of `law.rolling_radius`. As an impulse along e_r = (0, 0,
R), it acts like friction. Within the sweeps, its limit follows a decreasing normal impulse but not
an increasing one, as this could diverge. Therefore the substep is first settled with the limits of
the last one, and then with the limits of the normal impulses that it found (`limit_rolling`).

A contact that closes faster than a body that has fallen by the target penetration, and faster than
the tolerance of the sweeps, undergoes an impact, together with all other contacts that are closing
and whose gap is at most that. The impact is plastic during its substep. At the end of the substep,
all contacts with an impact open with the velocities given by their restitution; the sum of both
impulses of a contact obeys Coulomb friction. If the impact would gain energy, restitution is
reduced. (Impacts slower than the tolerance would end the support of a pile by contacts that sweeps
have not yet resolved: in a hopper of 1,000 blocks, penetration was ten times as great.)

Contacts penetrate slightly, because sweeps end at a tolerance and bodies rotate within a substep.
Excess penetration is removed at the end of the step, see `position_correction`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Rows
from rigdda.dynamics.constants import (
    AT_ONCE,
    MOST_SWEEPS,
    ROUNDING,
    SET_OF_SWEEPS,
    SETTLED,
    SUBSTEPS,
)
from rigdda.dynamics.equations import load_moment
from rigdda.dynamics.motion import impact_speed
from rigdda.dynamics.records import Bodies, Body, Floats, Parameters
from rigdda.dynamics.rows import (
    AIM,
    AIM_SHEAR,
    BEFORE,
    BEND,
    BOUNCE,
    BRAKE,
    COHESION,
    COS,
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
    GOAL,
    HELD,
    IMPULSE,
    KEEP,
    KEEP_SHEAR,
    LEFT,
    LOAD,
    MOVES,
    NORMAL,
    NOW,
    PULL,
    REACHED,
    REBOUND,
    RESIDUE,
    RESTITUTION,
    RESTITUTION_SPEED,
    ROLL,
    ROLL_LIMIT,
    ROLLED,
    ROLLING,
    SHEAR,
    SIN,
    START,
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
from rigdda.kernel import arithmetic_kernel, inlined, kernel, variable


@kernel
def start_slot(body: Body, slot: Floats, scale: Floats, p: Parameters) -> None:
    """Set a slot from its body: position, velocity, weight and loads."""
    root, spin = math.sqrt(body.mass), math.sqrt(body.inertia)
    scale[0], scale[1], scale[2] = 1.0 / root, 1.0 / root, 1.0 / spin
    slot[NOW], slot[NOW + 1], slot[NOW + 2] = root * body.vx, root * body.vy, spin * body.omega
    slot[PULL] = p.field_x * root + body.force_x / root
    slot[PULL + 1] = p.field_y * root + body.force_y / root
    slot[PULL + 2] = load_moment(body, p.dt) / spin
    slot[X], slot[Y], slot[TURN], slot[COS], slot[SIN] = body.x, body.y, 0.0, 1.0, 0.0
    slot[DAMPING], slot[FIELD] = p.damping, 0.0
    slot[BRAKE], slot[MOVES], slot[LEFT] = body.brake, scale[0], body.elongation
    slot[START] = body.x
    if body.brake > 0.0:
        scale[1] = scale[2] = slot[PULL] = slot[PULL + 1] = slot[DAMPING] = 0.0


@inlined
def start_slots(bodies: Bodies, islands: Islands, rows: Rows, island: int, p: Parameters) -> None:
    """Set the slots of an island from its bodies, and one slot for all that does not move."""
    first = islands.block_start[island]
    n = islands.block_start[island + 1] - first
    for s in range(n):
        start_slot(bodies[islands.block_item[first + s]], rows.slot[s], rows.scale[s], p)
    for q in range(rows.slot.shape[1]):
        rows.slot[n, q] = 0.0
    rows.slot[n, COS] = 1.0
    for q in range(3):
        rows.scale[n, q] = 0.0


@kernel
def fade(slots: Floats, n: int, time: float) -> float:
    """Damp the velocities of the bodies for a time [s]; return the work of damping [J].

    Damping acts for half of a substep before all other impulses and for half of it after them, so
    that it does not change the forces on bodies at rest.
    """
    lost = 0.0
    for s in range(n):
        slot = slots[s]
        if slot[DAMPING] > 0.0:
            left = math.exp(-slot[DAMPING] * time)
            for q in range(3):
                lost -= 0.5 * (1.0 - left * left) * slot[NOW + q] * slot[NOW + q]
                slot[NOW + q] *= left
    return lost


@kernel
def pull(slots: Floats, n: int, h: float) -> None:
    """Apply weight and loads for a substep."""
    for s in range(n):
        slot = slots[s]
        for q in range(3):
            slot[BEFORE + q] = slot[NOW + q]
            slot[NOW + q] += h * slot[PULL + q]
            slot[FREE + q] = slot[NOW + q]
        slot[HELD] = 0.0


@kernel
def greatest_pull(rows: Rows, n: int) -> float:
    """Return the greatest acceleration of a centroid by weight and loads [m/s2]."""
    most = 0.0
    for s in range(n):
        x, y = rows.slot[s, PULL] * rows.scale[s, 0], rows.slot[s, PULL + 1] * rows.scale[s, 1]
        most = max(most, math.sqrt(x * x + y * y))
    return most


@kernel
def drift_half(slots: Floats, scale: Floats, n: int, h: float) -> None:
    """Move the bodies for half a substep h with their current velocities."""
    for s in range(n):
        slot = slots[s]
        for q in range(3):
            slot[X + q] += 0.5 * h * slot[NOW + q] * scale[s, q]
        slot[COS], slot[SIN] = math.cos(slot[TURN]), math.sin(slot[TURN])


@kernel
def drift(slots: Floats, scale: Floats, n: int, h: float, gone: float) -> None:
    """Move the bodies for a substep, and sum up the work of weight and loads.

    Every impulse, including those of contacts, does work along the mean of the velocities before
    and after the substep. `gone` is the fraction of the substep for which the bodies have already
    moved.
    """
    for s in range(n):
        slot = slots[s]
        new = 0.5 + 0.5 * slot[HELD]
        for q in range(3):
            mean = 0.5 * (slot[BEFORE + q] + slot[NOW + q])
            slot[FIELD] += h * slot[PULL + q] * mean
            way = h * (new * slot[NOW + q] + (1.0 - new - gone) * slot[BEFORE + q])
            slot[X + q] += way * scale[s, q]
        slot[COS], slot[SIN] = math.cos(slot[TURN]), math.sin(slot[TURN])


@arithmetic_kernel
def aim_row(
    row: Floats, fact: Floats, a: Floats, b: Floats, h: float, left: float, touch: float
) -> None:
    """Set the quantities that a visit of a row needs in a substep h.

    A contact whose gap exceeds `touch` [m] may close by its gap in the time `left` [s], corrected
    for the opening that rotation of the bodies causes. A spring acts with its force in the middle
    of the substep, so that it conserves energy at any step length.
    """
    flexible = rolling = cross = 0.0
    for q in range(6):
        flexible += row[NORMAL + q] * row[NORMAL + q]
        rolling += row[SHEAR + q] * row[SHEAR + q]
        cross += row[NORMAL + q] * row[SHEAR + q]
    row[FLEXIBLE] = flexible
    row[COHESION], row[TENSION] = h * fact[STRENGTH], h * fact[STRENGTH + 1]
    if row[STIFFNESS] == 0.0:
        row[KEEP] = row[KEEP_SHEAR] = 1.0
        # a contact along which neither body can move has no flexibility: between two fences
        # along x, or with a fence along y
        row[GAIN] = 1.0 / flexible if flexible > 0.0 else 0.0
        row[GAIN_SHEAR] = 1.0 / rolling if rolling > 0.0 else 0.0
        # The friction of a sliding contact may open it by more than the normal impulse closes it.
        # Full changes of the normal impulse would then alternate between two states. With this part
        # of them, errors of a sliding and of a sticking contact decrease equally fast.
        opening = row[FRICTION] * abs(cross) * row[GAIN]
        if opening > 1.0:
            row[GAIN] *= 2.0 / (2.0 + opening - cross * cross * row[GAIN] * row[GAIN_SHEAR])
        row[AIM], row[AIM_SHEAR] = -0.5 * h * row[BEND], 0.0
        if fact[STRENGTH] == math.inf:  # a pin; `mend_links` removes its drift
            row[AIM_SHEAR] = -0.5 * h * row[BEND + 1]
        elif row[GAP] > touch and fact[STRENGTH + 1] == 0.0:  # an open contact without a joint
            row[AIM] -= row[GAP] / left
    else:
        give = 0.25 * row[STIFFNESS] * h * h
        row[KEEP] = give * flexible / (1.0 + give * flexible)
        row[KEEP_SHEAR] = give * rolling / (1.0 + give * rolling)
        row[GAIN], row[GAIN_SHEAR] = give / (1.0 + give * flexible), give / (1.0 + give * rolling)
        stretch = row[GAP] - fact[FREE_GAP]
        row[AIM] = -4.0 * stretch / h - along_six(row[NORMAL : NORMAL + 6], a, b, BEFORE)
        slip = -fact[FREE_SHEAR]
        row[AIM_SHEAR] = -4.0 * slip / h - along_six(row[SHEAR : SHEAR + 6], a, b, BEFORE)


@kernel
def start_rows(
    rows: Rows, count: int, number: int, h: float, left: float, ratio: float, touch: float
) -> None:
    """Start a substep for all contacts that may close in it, with the impulses of the last one.

    `left` is the time for which the bodies still have to move in the substep [s], and `ratio` its
    length over that of the last one, which scales the warm start.
    """
    for place in range(count):
        k = np.uintp(place)
        if rows.idle[k] > number:
            continue
        i, j = np.uintp(rows.row_i[k]), np.uintp(rows.row_j[k])
        row, fact, a, b = rows.row[k], rows.fact[k], rows.slot[i], rows.slot[j]
        place_row(row, fact, rows.form[k], a, b, rows.scale[i], rows.scale[j])
        aim_row(row, fact, a, b, h, left, touch)
        row[ROLL_LIMIT] = 0.0
        if row[IMPULSE] != 0.0 or row[IMPULSE + 1] != 0.0:
            row[IMPULSE] *= ratio
            row[IMPULSE + 1] *= ratio
            push(row, NORMAL, a, b, NOW, row[IMPULSE])
            push(row, SHEAR, a, b, NOW, row[IMPULSE + 1])
        if row[ROLLING] > 0.0:
            limit = row[ROLL_LIMIT] = row[ROLLING] * max(row[IMPULSE], 0.0)
            row[ROLLED] = min(max(ratio * row[ROLLED], -limit), limit)
            turn(row, a, b, row[ROLLED])


@arithmetic_kernel
def turn(row: Floats, a: Floats, b: Floats, impulse: float) -> None:
    """Add a rolling impulse to the slots of both bodies."""
    a[NOW + 2] += impulse * row[ROLL]
    b[NOW + 2] += impulse * row[ROLL + 1]


@kernel
def limit_rolling(rows: Rows, count: int, number: int) -> bool:
    """Limit rolling impulses by the present normal impulses; return whether any limit grew."""
    grew = False
    for k in range(count):
        row = rows.row[k]
        if row[ROLLING] > 0.0 and rows.idle[k] <= number:
            limit = row[ROLLING] * max(row[IMPULSE], 0.0)
            grew = grew or limit > row[ROLL_LIMIT]
            row[ROLL_LIMIT] = limit
    return grew


@kernel
def list_visits(rows: Rows, count: int, tries: int, number: int) -> int:
    """Write the contacts that the next sweep visits into rows.visit; return their number.

    Contacts that cannot close before substep idle[k] are skipped. After the first sweep of a
    substep, so are contacts of which neither body moved in the last sweep; moved_in[s] is the last
    sweep of the substep in which slot s moved. A contact to be skipped is also written, but the
    next one overwrites it. This avoids a branch that the processor cannot predict.
    """
    visits = 0
    for place in range(count):
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
    own: float, other: float, both: float, speed: float, speed_2: float, low: float, low_2: float
) -> tuple[float, float]:
    """Return the normal impulses of the two contacts of a face [N s].

    Of the four cases in which each contact either reaches its aim or is open, that one holds in
    which no impulse is less than its limit and no contact closes faster than its aim.

    Parameters
    ----------
    own, other, both : float
        Change of each normal velocity by its own impulse, and of each by the other's [1/kg].
    speed, speed_2 : float
        Normal velocities without the impulses, less their aims [m/s].
    low, low_2 : float
        Least impulses [N s].
    """
    determinant = own * other - both * both
    one = (both * speed_2 - other * speed) / determinant
    two = (both * speed - own * speed_2) / determinant
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
    both = 0.0
    for q in range(6):
        both += row[NORMAL + q] * other[NORMAL + q]
    own, its = row[FLEXIBLE], other[FLEXIBLE]
    if own * its - both * both <= 1e-9 * own * its:
        change = press_row(row, a, b)
        return max(change, press_row(other, a, b))
    one, two = row[IMPULSE], other[IMPULSE]
    speed = along_six(row[NORMAL : NORMAL + 6], a, b, NOW) - row[AIM] - own * one - both * two
    speed_2 = along_six(other[NORMAL : NORMAL + 6], a, b, NOW) - other[AIM]
    speed_2 -= both * one + its * two
    low, low_2 = -row[TENSION], -other[TENSION]
    new, new_2 = solve_face(own, its, both, speed, speed_2, low, low_2)
    part = min(row[GAIN] * own, other[GAIN] * its)  # see aim_row
    more = max(part * (new - one), low - one)
    more_2 = max(part * (new_2 - two), low_2 - two)
    if more != 0.0 or more_2 != 0.0:
        push(row, NORMAL, a, b, NOW, more)
        push(other, NORMAL, a, b, NOW, more_2)
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


@arithmetic_kernel
def count_row(
    row: Floats, fact: Floats, a: Floats, b: Floats, normal: float, shear: float, rolled: float
) -> None:
    """Add impulses of a contact to its sums, together with their work."""
    fact[SUM] += normal
    fact[SUM + 1] += shear
    fact[SUM + 2] += rolled
    own = along = other = across = 0.0
    for q in range(3):
        mean, mean_b = 0.5 * (a[NOW + q] + a[BEFORE + q]), 0.5 * (b[NOW + q] + b[BEFORE + q])
        own += row[NORMAL + q] * mean
        along += row[SHEAR + q] * mean
        other += row[NORMAL + 3 + q] * mean_b
        across += row[SHEAR + 3 + q] * mean_b
    spin = 0.5 * rolled * row[ROLL] * (a[NOW + 2] + a[BEFORE + 2])
    spin_b = 0.5 * rolled * row[ROLL + 1] * (b[NOW + 2] + b[BEFORE + 2])
    fact[WORK] += normal * (own + other)
    fact[WORK + 1] += shear * (along + across) + (spin + spin_b)
    fact[WORK_ON_A] += normal * own + shear * along + spin


@kernel
def restitution(fact: Floats, speed: float) -> float:
    """Return the coefficient of restitution of a contact at a closing speed [m/s].

    It decreases as e / (1 + (v / K)^2) (Pfeiffer and Bowen 1989).
    """
    ratio = speed / fact[RESTITUTION_SPEED]
    return fact[RESTITUTION] / (1.0 + ratio * ratio)


@kernel
def end_rows(rows: Rows, n: int, count: int, number: int, least: float) -> tuple[bool, bool]:
    """End a substep for its contacts: sum up their impulses and detect impacts.

    An impact is a contact that closed faster than `least` [m/s] at the start of the substep.

    Returns
    -------
    struck, bouncing : bool
        Whether there was an impact, and whether any contact has to open again.
    """
    struck, bouncing = False, False
    for place in range(count):
        k = np.uintp(place)
        row, fact = rows.row[k], rows.fact[k]
        normal, shear = row[IMPULSE], row[IMPULSE + 1]
        if rows.idle[k] > number or (normal == 0.0 and shear == 0.0):
            continue
        a, b = rows.slot[np.uintp(rows.row_i[k])], rows.slot[np.uintp(rows.row_j[k])]
        count_row(row, fact, a, b, normal, shear, row[ROLLED])
        if row[STIFFNESS] > 0.0:
            continue
        # at an impact or between two bodies, impulses act at the start of the substep
        sudden = normal > 0.0 and -along_six(row[NORMAL : NORMAL + 6], a, b, BEFORE) > least
        if sudden or rows.row_j[k] < n:
            a[HELD] = b[HELD] = 1.0
        if sudden:
            opening = along_six(row[NORMAL : NORMAL + 6], a, b, FREE)
            fact[REBOUND] = restitution(fact, -opening)
            struck, fact[STRUCK], fact[BOUNCE] = True, 1.0, -fact[REBOUND] * opening
            fact[LOAD] = fact[LOAD + 1] = fact[LOAD + 2] = 0.0
            bouncing = bouncing or fact[BOUNCE] > 0.0
    return struck, bouncing


@kernel
def work_from(rows: Rows, count: int, number: int, first: int) -> float:
    """Return the work of contacts other than springs on instantaneous velocity changes [J].

    `first` is the column of the slots with the velocities before. A contact that has to open again
    counts with its impulse since LOAD.
    """
    work = 0.0
    for k in range(count):
        row, fact = rows.row[k], rows.fact[k]
        if rows.idle[k] > number or row[STIFFNESS] > 0.0:
            continue
        a, b = rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        opening = along_six(row[NORMAL : NORMAL + 6], a, b, first)
        slip = along_six(row[SHEAR : SHEAR + 6], a, b, first)
        opening += along_six(row[NORMAL : NORMAL + 6], a, b, NOW)
        slip += along_six(row[SHEAR : SHEAR + 6], a, b, NOW)
        spin = row[ROLL] * (a[first + 2] + a[NOW + 2])
        spin += row[ROLL + 1] * (b[first + 2] + b[NOW + 2])
        normal, shear, rolled = row[IMPULSE], row[IMPULSE + 1], row[ROLLED]
        if fact[BOUNCE] > 0.0:
            normal, shear = normal - fact[LOAD], shear - fact[LOAD + 1]
            rolled -= fact[LOAD + 2]
        work += 0.5 * (normal * opening + shear * slip + rolled * spin)
    return work


@kernel
def aim_rebound(rows: Rows, n: int, count: int, number: int, share: float) -> None:
    """Prepare an island for the rebound at the end of a substep with a fraction of restitution.

    Contacts with an impact keep their impulses, so that friction is limited by the total impulse of
    the impact.
    """
    for s in range(n):
        for q in range(3):
            rows.slot[s, NOW + q] = rows.slot[s, BEFORE + q]
    for k in range(count):
        row, fact = rows.row[k], rows.fact[k]
        if rows.idle[k] > number or row[STIFFNESS] > 0.0:
            continue
        row[ROLL_LIMIT] = row[ROLLING] * max(fact[LOAD], 0.0)
        if fact[BOUNCE] > 0.0:
            row[IMPULSE], row[IMPULSE + 1] = fact[LOAD], fact[LOAD + 1]
            row[ROLLED] = fact[LOAD + 2]
            row[ROLL_LIMIT] *= 1.0 + share * fact[REBOUND]
            row[AIM], row[TENSION] = share * fact[BOUNCE], -fact[LOAD]  # in sum no tension
        else:
            row[IMPULSE] = row[IMPULSE + 1] = row[ROLLED] = 0.0


@kernel
def rebound(
    rows: Rows, n: int, count: int, number: int, h: float, reach: float, tolerance: float,
    touch: float,
) -> int:  # fmt: skip
    """Open all contacts with an impact at the end of the substep; return the number of sweeps.

    `h` is the least length of the next substep [s], within which open contacts may close.

    Restitution with friction can increase the kinetic energy in an eccentric impact. A plastic
    impact, which did the work `lost` < 0 [J], cannot. Energy is quadratic in the velocities, so the
    gain is a convex function of the fraction of restitution. At the fraction where the chord from
    plastic to full restitution is zero, the gain is therefore not positive.
    """
    lost = work_from(rows, count, number, FREE)
    for s in range(n):
        for q in range(3):
            rows.slot[s, BEFORE + q] = rows.slot[s, NOW + q]
    for k in range(count):
        if rows.idle[k] <= number:
            i, j = rows.row_i[k], rows.row_j[k]
            row, fact, a, b = rows.row[k], rows.fact[k], rows.slot[i], rows.slot[j]
            place_row(row, fact, rows.form[k], a, b, rows.scale[i], rows.scale[j])
            aim_row(row, fact, a, b, h, h, touch)
            fact[LOAD], fact[LOAD + 1] = row[IMPULSE], row[IMPULSE + 1]
            fact[LOAD + 2] = row[ROLLED]
            if row[STIFFNESS] > 0.0:  # a spring keeps its impulse during the rebound
                row[KEEP] = row[KEEP_SHEAR] = 1.0
                row[GAIN] = row[GAIN_SHEAR] = 0.0
    sweeps, share = 0, 1.0
    for attempt in range(3):
        aim_rebound(rows, n, count, number, share)
        sweeps += settle(rows, n, count, number, reach, tolerance)
        work = work_from(rows, count, number, BEFORE)
        if lost + work <= -ROUNDING * lost:
            break
        share = min(max(-lost / work, 0.0), 1.0) if attempt == 0 else 0.0
        if attempt == 2:  # the sweeps do not converge: no rebound
            take_back(rows, n, count, number)
    for k in range(count):
        row, fact = rows.row[k], rows.fact[k]
        if rows.idle[k] > number or row[STIFFNESS] > 0.0:
            continue
        a, b = rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        if fact[BOUNCE] > 0.0:
            normal, shear = row[IMPULSE] - fact[LOAD], row[IMPULSE + 1] - fact[LOAD + 1]
            count_row(row, fact, a, b, normal, shear, row[ROLLED] - fact[LOAD + 2])
            fact[BOUNCE] = row[IMPULSE] = row[IMPULSE + 1] = row[ROLLED] = 0.0
        else:
            count_row(row, fact, a, b, row[IMPULSE], row[IMPULSE + 1], row[ROLLED])
            row[IMPULSE], row[IMPULSE + 1] = fact[LOAD], fact[LOAD + 1]
            row[ROLLED] = fact[LOAD + 2]
    return sweeps


@kernel
def take_back(rows: Rows, n: int, count: int, number: int) -> None:
    """Take back the rebound of an island."""
    for s in range(n):
        for q in range(3):
            rows.slot[s, NOW + q] = rows.slot[s, BEFORE + q]
    for k in range(count):
        row, fact = rows.row[k], rows.fact[k]
        if rows.idle[k] <= number and row[STIFFNESS] == 0.0:
            kept = 1.0 if fact[BOUNCE] > 0.0 else 0.0
            row[IMPULSE], row[IMPULSE + 1] = kept * fact[LOAD], kept * fact[LOAD + 1]
            row[ROLLED] = kept * fact[LOAD + 2]


@kernel
def settle(rows: Rows, n: int, count: int, number: int, reach: float, tolerance: float) -> int:
    """Sweep until no velocity changes by more than a tolerance; return the sweeps.

    Normal velocities count, and R times rates of rotation where rolling is resisted. See the module
    docstring on the second set of sweeps.
    """
    sweeps = sweep_until(rows, n, count, number, reach, tolerance, math.inf)
    if limit_rolling(rows, count, number):
        again = sweep_until(rows, n, count, number, reach, tolerance, math.inf)
        sweeps = max(sweeps, again)
    return sweeps


@kernel
def kinetic(slots: Floats, n: int, first: int) -> float:
    """Return the kinetic energy of the velocities in three columns of the slots [J]."""
    energy = 0.0
    for s in range(n):
        for q in range(3):
            energy += 0.5 * slots[s, first + q] * slots[s, first + q]
    return energy


@kernel
def settle_safely(
    rows: Rows, n: int, count: int, number: int, reach: float, tolerance: float
) -> int:
    """Settle a substep without increasing the energy; return the sweeps.

    If the sweeps neither converge nor lose energy, as where a heavy body squeezes a light one
    aside, they are repeated from contacts without impulses and without extrapolation, which never
    increases the energy.
    """
    sweeps = settle(rows, n, count, number, reach, tolerance)
    if sweeps < MOST_SWEEPS or kinetic(rows.slot, n, NOW) <= kinetic(rows.slot, n, FREE):
        return sweeps
    for s in range(n):
        for q in range(3):
            rows.slot[s, NOW + q] = rows.slot[s, FREE + q]
    for k in range(count):
        row = rows.row[k]
        if rows.idle[k] <= number:
            row[IMPULSE] = row[IMPULSE + 1] = row[ROLLED] = row[ROLL_LIMIT] = 0.0
    return sweep_until(rows, n, count, number, reach, tolerance, -1.0)


@kernel
def extrapolate(rows: Rows, count: int, number: int, before: float) -> float:
    """Extrapolate the impulses from their changes by the last sweeps and by those before.

    A set of sweeps is a step of a fixed-point iteration x -> G(x) with the residual r = G(x) - x.
    In Anderson's method of depth one (Anderson 1965), the next x is G - theta dG, where d is the
    change since the last extrapolation and theta = r dr / dr^2. It removes the error that decreases
    most slowly, as that of a heavy body that rests or falls on a light one. If the residual has
    grown, the last extrapolation is taken back.

    Parameters
    ----------
    before : float
        Square of the residual at the last extrapolation [J]; inf at the first.

    Returns
    -------
    float
        Square of the residual [J], or -1 if it has grown.
    """
    square = slope = curvature = 0.0
    for k in range(count):
        row, fact = rows.row[k], rows.fact[k]
        if rows.idle[k] > number:
            continue
        for q in range(2):
            residue = row[IMPULSE + q] - fact[REACHED + q]
            change = residue - fact[RESIDUE + q]
            square += row[FLEXIBLE] * residue * residue
            slope += row[FLEXIBLE] * residue * change
            curvature += row[FLEXIBLE] * change * change
    grew = square > before
    share = max(-slope / curvature, 0.0) if curvature > 0.0 and not grew else 0.0
    for k in range(count):
        row, fact = rows.row[k], rows.fact[k]
        if rows.idle[k] > number:
            continue
        a, b = rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        for q in range(2):
            goal = row[IMPULSE + q]
            more = fact[GOAL + q] - goal if grew else share * (goal - fact[GOAL + q])
            push(row, NORMAL if q == 0 else SHEAR, a, b, NOW, more)
            fact[RESIDUE + q] = goal - fact[REACHED + q]
            fact[GOAL + q] = goal
            fact[REACHED + q] = row[IMPULSE + q] = goal + more
    return -1.0 if grew else square


@kernel
def sweep_until(
    rows: Rows, n: int, count: int, number: int, reach: float, tolerance: float, square: float
) -> int:
    """Sweep until no velocity changes by more than a tolerance, or `MOST_SWEEPS` times.

    `square` is inf, or -1 to sweep without extrapolation, see `extrapolate`.
    """
    start_extrapolation(rows, count)
    for s in range(n + 1):
        rows.moved_in[s] = -1
    for tries in range(MOST_SWEEPS):
        visits = list_visits(rows, count, tries, number)
        worst = sweep(rows, n, visits, tries, number, reach, tolerance)
        if worst <= tolerance:
            return tries + 1
        if (tries + 1) % SET_OF_SWEEPS == 0 and square >= 0.0 and tries + 1 < MOST_SWEEPS:
            square = extrapolate(rows, count, number, square)
            for s in range(n + 1):
                rows.moved_in[s] = tries
    return MOST_SWEEPS


@kernel
def start_extrapolation(rows: Rows, count: int) -> None:
    """Begin to extrapolate the impulses from their present values."""
    for k in range(count):
        row, fact = rows.row[k], rows.fact[k]
        for q in range(2):
            fact[REACHED + q], fact[RESIDUE + q], fact[GOAL + q] = row[IMPULSE + q], 0.0, 0.0


@kernel
def hold_fences(slots: Floats, scale: Floats, n: int) -> float:
    """Hold the fences of an island for a substep; return the kinetic energy that they had [J]."""
    energy = 0.0
    for s in range(n):
        slot = slots[s]
        if slot[BRAKE] > 0.0:
            energy += 0.5 * slot[BEFORE] * slot[BEFORE]
            slot[NOW] = slot[FREE] = scale[s, 0] = 0.0
    return energy


@kernel
def push_downhill(rows: Rows, k: int, s: int) -> float:
    """Return the downhill impulse of row k on slot s, a held fence [N s]."""
    i, j = rows.row_i[k], rows.row_j[k]
    other, first = (j, 3) if i == s else (i, 0)
    scale = rows.scale[other, 0]
    return -rows.row[k, IMPULSE] * rows.row[k, first] / scale if scale > 0.0 else 0.0


@kernel
def rest_on(rows: Rows, count: int, number: int, s: int, share: float) -> None:
    """Reduce the impulses on a held fence before it is released.

    Downhill normal impulses keep the fraction `share`, all others are set to zero. The impulses on
    a fence at rest are much greater than those that a light moving fence can transmit, and sweeps
    that start from them may gain energy.
    """
    for k in range(count):
        i, j = rows.row_i[k], rows.row_j[k]
        if rows.idle[k] > number or (i != s and j != s):
            continue
        row, a, b = rows.row[k], rows.slot[i], rows.slot[j]
        kept = share if push_downhill(rows, k, s) > 0.0 else 0.0
        push(row, NORMAL, a, b, NOW, (kept - 1.0) * row[IMPULSE])
        push(row, SHEAR, a, b, NOW, (kept - 1.0) * row[IMPULSE + 1])
        row[IMPULSE] *= kept
        row[IMPULSE + 1] *= kept


@kernel
def release_fences(
    rows: Rows, n: int, count: int, number: int, h: float, touch: float, ledger: NDArray
) -> bool:  # fmt: skip
    """Release fences that contacts push harder than their brakes; return whether any was released.

    While it is held, a fence has lost its velocity of the last substep. When it is released, its
    brake acts with its braking force, and the contacts must be solved again. The brake of a fence
    whose elongation is used up does not act.
    """
    released = False
    for s in range(n):
        slot = rows.slot[s]
        if slot[BRAKE] == 0.0 or rows.scale[s, 0] > 0.0:
            continue
        brake = h * slot[BRAKE] if slot[X] - slot[START] < slot[LEFT] else 0.0
        net = pushed = 0.0
        for k in range(count):
            if rows.idle[k] <= number and (rows.row_i[k] == s or rows.row_j[k] == s):
                net += push_downhill(rows, k, s)
                pushed += max(push_downhill(rows, k, s), 0.0)
        if net + slot[BEFORE] / slot[MOVES] <= brake:
            continue
        released = True
        ledger[1] += 0.5 * slot[BEFORE] * slot[BEFORE]
        slot[NOW] = slot[FREE] = slot[BEFORE] - brake * slot[MOVES]
        share = min(brake / pushed, 1.0) if pushed > 0.0 else 0.0
        rest_on(rows, count, number, s, share)
        rows.scale[s, 0] = slot[MOVES]
        for k in range(count):
            i, j = rows.row_i[k], rows.row_j[k]
            if rows.idle[k] > number or (i != s and j != s):
                continue
            row, fact, a, b = rows.row[k], rows.fact[k], rows.slot[i], rows.slot[j]
            place_row(row, fact, rows.form[k], a, b, rows.scale[i], rows.scale[j])
            aim_row(row, fact, a, b, h, h, touch)
            slot[NOW] += row[IMPULSE] * row[0 if i == s else 3]
    return released


@kernel
def end_fences(slots: Floats, scale: Floats, n: int, ledger: NDArray) -> None:
    """Account for the work of the brakes of yielding fences; stop those that would move uphill."""
    for s in range(n):
        slot = slots[s]
        if slot[BRAKE] > 0.0 and scale[s, 0] == 0.0:
            slot[BEFORE] = 0.0
        elif slot[BRAKE] > 0.0:
            if slot[NOW] < 0.0:
                ledger[1] -= 0.5 * slot[BEFORE] * slot[NOW]
                slot[NOW] = 0.0
            ledger[4] += (slot[FREE] - slot[BEFORE]) * 0.5 * (slot[BEFORE] + slot[NOW])


@kernel
def stop_uphill(slots: Floats, n: int) -> float:
    """Stop the fences that a rebound moves uphill; return the kinetic energy that they had [J]."""
    energy = 0.0
    for s in range(n):
        slot = slots[s]
        if slot[BRAKE] > 0.0 and slot[NOW] < 0.0:
            energy += 0.5 * slot[NOW] * slot[NOW]
            slot[NOW] = 0.0
    return energy


@kernel
def time_to_blow(rows: Rows, count: int, most: float, least: float, touch: float) -> float:
    """Return the time, at most `most`, until a contact closes faster than `least` [m/s].

    It then has a gap of half of `touch` [m]; a contact with a gap of at most `touch` closes now.
    """
    for k in range(count):
        i, j = rows.row_i[k], rows.row_j[k]
        row, a, b = rows.row[k], rows.slot[i], rows.slot[j]
        place_row(row, rows.fact[k], rows.form[k], a, b, rows.scale[i], rows.scale[j])
        closing = -along_six(row[NORMAL : NORMAL + 6], a, b, NOW)
        pulling = -along_six(row[NORMAL : NORMAL + 6], a, b, PULL)
        gap = row[GAP] - 0.5 * touch if row[GAP] > touch else 0.0
        root = math.sqrt(max(closing * closing + 2.0 * pulling * gap, 0.0))
        if root > least and closing + root > 0.0 and row[STIFFNESS] == 0.0:
            most = min(most, 2.0 * gap / (closing + root))
    return most


@kernel
def part_of_step(
    rows: Rows, count: int, left: float, least: float, shortest: float, touch: float
) -> float:
    """Return the length of the next substep of a lone body, with a time `left` in the step [s].

    The substep ends just before a contact closes faster than `least` [m/s]. A substep that begins
    there has the shortest permitted length. All contacts with a gap of at most `touch` [m] undergo
    the impact together.
    """
    return min(left, max(time_to_blow(rows, count, left, least, touch), shortest))


@kernel
def relax(
    rows: Rows, n: int, count: int, speed: float, p: Parameters, ledger: NDArray
) -> tuple[int, bool, bool]:
    """Move the slots of an island through the step by the impulses of its contacts.

    A lone body takes only the substeps that end at its impacts. Its contacts act at the position in
    the middle of each substep, which is accurate to second order because no impact occurs within
    it.

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
        Whether any contact had an impact.
    settled : bool
        Whether the sweeps of the last substep converged to the tolerance.
    """
    alone, fenced, shortest, touch = n == 1, False, AT_ONCE * p.dt, p.penetration
    usual, reach, gone = p.dt / SUBSTEPS, speed + greatest_pull(rows, n) * p.dt, 0.0
    if alone:
        usual, reach, gone = p.dt, math.inf, 0.5
    tolerance = max(min(p.sweep_tolerance * (n - 1), SETTLED * speed), p.tolerance * speed)
    least = max(impact_speed(p), tolerance)
    for s in range(n):
        fenced = fenced or rows.slot[s, BRAKE] > 0.0
    sweeps, struck, last, left, number, swept = 0, False, 1.0, p.dt, variable(0), 0
    while left > 0.0:
        h = min(usual, left)
        if alone:
            h = part_of_step(rows, count, h, least, shortest, touch)
        if left - h < 0.5 * shortest:
            h = left
        if alone:
            drift_half(rows.slot, rows.scale, n, h)
        ledger[2] += fade(rows.slot, n, 0.5 * h)
        pull(rows.slot, n, h)
        if fenced:
            ledger[1] -= hold_fences(rows.slot, rows.scale, n)
        start_rows(rows, count, number, h, h - gone * h, h / last, touch)
        swept = settle_safely(rows, n, count, number, reach, tolerance)
        sweeps += swept
        while fenced and release_fences(rows, n, count, number, h, touch, ledger):
            sweeps += settle(rows, n, count, number, reach, tolerance)
        if fenced:
            end_fences(rows.slot, rows.scale, n, ledger)
        hit, bouncing = end_rows(rows, n, count, number, least)
        drift(rows.slot, rows.scale, n, h, gone)
        ledger[2] += fade(rows.slot, n, 0.5 * h)
        if bouncing:
            following = shortest if alone else h
            sweeps += rebound(rows, n, count, number, following, reach, tolerance, touch)
            ledger[1] -= stop_uphill(rows.slot, n)
        struck, last, left = struck or hit, h, left - h if h < left else 0.0
        number += 0 if alone else 1
    for place in range(count):  # to forces; none after an impact in a short substep
        lasts = 0.0 if rows.fact[place, STRUCK] > 0.0 and last < 0.5 * usual else 1.0 / last
        rows.row[place, IMPULSE] *= lasts
        rows.row[place, IMPULSE + 1] *= lasts
        rows.row[place, ROLLED] *= lasts
    return sweeps, struck, swept < MOST_SWEEPS
