"""Start and end of a substep for the contacts of an island: aims, warm start, sums and impacts."""

from __future__ import annotations

import math

import numpy as np

from rigdda.dynamics.arrays import Rows
from rigdda.dynamics.records import Floats
from rigdda.dynamics.rows import (
    AIM,
    AIM_SHEAR,
    BEFORE,
    BEND,
    BOTH,
    BOUNCE,
    BOUNCES,
    COHESION,
    FLEXIBLE,
    FREE,
    FREE_GAP,
    FREE_SHEAR,
    FRICTION,
    GAIN,
    GAIN_SHEAR,
    GAP,
    HELD,
    IMPULSE,
    INVERSE,
    KEEP,
    KEEP_SHEAR,
    LOAD,
    NORMAL,
    NOW,
    REBOUND,
    RESTITUTION,
    RESTITUTION_SPEED,
    ROLL,
    ROLL_LIMIT,
    ROLLED,
    ROLLING,
    SHEAR,
    STIFFNESS,
    STRENGTH,
    STRUCK,
    SUM,
    TENSION,
    WORK,
    WORK_ON_A,
    along_six,
    place_row,
    push,
)
from rigdda.dynamics.sweeps import turn
from rigdda.kernel import arithmetic_kernel, kernel


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


@arithmetic_kernel
def couple_face(row: Floats, other: Floats) -> None:
    """Set the coupling of the two contacts of a face, after `aim_row` of both."""
    both = 0.0
    for q in range(6):
        both += row[NORMAL + q] * other[NORMAL + q]
    product = row[FLEXIBLE] * other[FLEXIBLE]
    determinant = product - both * both
    row[BOTH], row[INVERSE] = both, 1.0 / determinant if determinant > 1e-9 * product else 0.0


@kernel
def start_rows(
    rows: Rows, count: int, number: int, h: float, left: float, ratio: float, touch: float
) -> int:
    """Start a substep for all contacts that may close in it, with the impulses of the last one.

    They are listed in rows.active, in their order; returns their number.

    `left` is the time for which the bodies still have to move in the substep [s], and `ratio` its
    length over that of the last one, which scales the warm start.
    """
    active = 0
    for place in range(count):
        k = np.uintp(place)
        if rows.idle[k] > number:
            continue
        rows.active[np.uintp(active)] = place
        active += 1
        i, j = np.uintp(rows.row_i[k]), np.uintp(rows.row_j[k])
        row, fact, a, b = rows.row[k], rows.fact[k], rows.slot[i], rows.slot[j]
        place_row(row, fact, rows.form[k], a, b, rows.scale[i], rows.scale[j])
        aim_row(row, fact, a, b, h, left, touch)
        if rows.face[k] == 0:
            couple_face(rows.row[k - np.uintp(1)], row)
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
    return active


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
def end_rows(rows: Rows, n: int, active: int, least: float) -> tuple[bool, bool]:
    """End a substep for its contacts: sum up their impulses and detect impacts.

    An impact is a contact that closed faster than `least` [m/s] at the start of the substep.

    Returns
    -------
    struck, bouncing : bool
        Whether there was an impact, and whether any contact has to open again.
    """
    struck, bouncing = False, False
    for q in range(active):
        k = np.uintp(rows.active[np.uintp(q)])
        row, fact = rows.row[k], rows.fact[k]
        normal, shear = row[IMPULSE], row[IMPULSE + 1]
        if normal == 0.0 and shear == 0.0:
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
            if fact[BOUNCE] > 0.0:
                bouncing, a[BOUNCES], b[BOUNCES] = True, 1.0, 1.0
    return struck, bouncing
