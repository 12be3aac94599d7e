"""Rebound: contacts with an impact open at the end of a substep by restitution.

A rebound takes no time. It changes the velocities of the bodies that were struck, and of the bodies
that they touch. Only contacts of bodies that were struck take part. Those with a gap cannot close
in it, at any velocity; if they had no impact of their own, the impulses by which the plastic impact
slowed them are taken back. They close in a later substep, where they may have an impact, as may the
contacts of the bodies that a struck body pushes.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Rows
from rigdda.dynamics.constants import MOST_SWEEPS, ROUNDING, SPEED_LIMIT
from rigdda.dynamics.rows import (
    AIM,
    BEFORE,
    BOUNCE,
    BOUNCES,
    FREE,
    GAIN,
    GAIN_SHEAR,
    GAP,
    IMPULSE,
    KEEP,
    KEEP_SHEAR,
    LOAD,
    NORMAL,
    NOW,
    REBOUND,
    ROLL,
    ROLL_LIMIT,
    ROLLED,
    ROLLING,
    SHEAR,
    STIFFNESS,
    STRENGTH,
    TAKEN_BACK,
    TENSION,
    along_six,
    place_row,
)
from rigdda.dynamics.slots import copy_velocities
from rigdda.dynamics.substep import aim_row, count_row, couple_face
from rigdda.dynamics.sweeps import settle
from rigdda.kernel import kernel


@kernel
def list_struck(rows: Rows, active: int) -> int:
    """Keep only the active contacts of bodies that were struck; return their number."""
    kept = 0
    for q in range(active):
        k = rows.active[q]
        if rows.slot[rows.row_i[k], BOUNCES] + rows.slot[rows.row_j[k], BOUNCES] > 0.0:
            rows.active[kept] = k
            kept += 1
    return kept


@kernel
def start_rebound(rows: Rows, active: int, h: float, touch: float) -> None:
    """Set up the contacts of a rebound at the end of a substep of length `h` [s].

    Contacts with a gap do not limit the velocity with which they close.
    """
    for q in range(active):
        k = rows.active[q]
        i, j = rows.row_i[k], rows.row_j[k]
        row, fact, a, b = rows.row[k], rows.fact[k], rows.slot[i], rows.slot[j]
        free = row[STIFFNESS] == 0.0 and fact[STRENGTH + 1] == 0.0 and fact[STRENGTH] < math.inf
        if free and row[GAP] > touch and row[IMPULSE] > 0.0 and fact[BOUNCE] == 0.0:
            fact[BOUNCE] = TAKEN_BACK
        place_row(row, fact, rows.form[k], a, b, rows.scale[i], rows.scale[j])
        aim_row(row, fact, a, b, h, h, touch)
        if row[STIFFNESS] > 0.0:  # a spring keeps its impulse during the rebound
            row[KEEP] = row[KEEP_SHEAR] = 1.0
            row[GAIN] = row[GAIN_SHEAR] = 0.0
        elif free and (row[GAP] > touch or fact[BOUNCE] == TAKEN_BACK):
            row[AIM] = -SPEED_LIMIT
        if rows.face[k] == 0:
            couple_face(rows.row[k - 1], row)
        fact[LOAD], fact[LOAD + 1], fact[LOAD + 2] = row[IMPULSE], row[IMPULSE + 1], row[ROLLED]


@kernel
def work_from(rows: Rows, active: int, first: int) -> float:
    """Return the work of contacts other than springs on instantaneous velocity changes [J].

    `first` is the column of the slots with the velocities before. A contact that has to open again
    counts with its impulse since LOAD.
    """
    work = 0.0
    for place in range(active):
        k = rows.active[place]
        row, fact = rows.row[k], rows.fact[k]
        if row[STIFFNESS] > 0.0:
            continue
        a, b = rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        opening = along_six(row[NORMAL : NORMAL + 6], a, b, first)
        slip = along_six(row[SHEAR : SHEAR + 6], a, b, first)
        opening += along_six(row[NORMAL : NORMAL + 6], a, b, NOW)
        slip += along_six(row[SHEAR : SHEAR + 6], a, b, NOW)
        spin = row[ROLL] * (a[first + 2] + a[NOW + 2])
        spin += row[ROLL + 1] * (b[first + 2] + b[NOW + 2])
        normal, shear, rolled = row[IMPULSE], row[IMPULSE + 1], row[ROLLED]
        if fact[BOUNCE] != 0.0:
            normal, shear = normal - fact[LOAD], shear - fact[LOAD + 1]
            rolled -= fact[LOAD + 2]
        work += 0.5 * (normal * opening + shear * slip + rolled * spin)
    return work


@kernel
def aim_rebound(rows: Rows, n: int, active: int, share: float) -> None:
    """Prepare the contacts of a rebound with a fraction of restitution.

    Contacts with an impact keep their impulses, so that friction is limited by the total impulse of
    the impact.
    """
    copy_velocities(rows.slot, n, BEFORE, NOW)
    for q in range(active):
        k = rows.active[q]
        row, fact = rows.row[k], rows.fact[k]
        if row[STIFFNESS] > 0.0:
            continue
        row[ROLL_LIMIT] = row[ROLLING] * max(fact[LOAD], 0.0)
        if fact[BOUNCE] != 0.0:
            row[IMPULSE], row[IMPULSE + 1] = fact[LOAD], fact[LOAD + 1]
            row[ROLLED] = fact[LOAD + 2]
        else:
            row[IMPULSE] = row[IMPULSE + 1] = row[ROLLED] = 0.0
        if fact[BOUNCE] > 0.0:
            row[ROLL_LIMIT] *= 1.0 + share * fact[REBOUND]
            row[AIM], row[TENSION] = share * fact[BOUNCE], -fact[LOAD]  # in sum no tension


@kernel
def impulses_from(rows: Rows, active: int) -> tuple[float, float]:
    """Return the sums of the normal impulses of the impact and of its rebound [N s]."""
    impact = opened = 0.0
    for q in range(active):
        row, fact = rows.row[rows.active[q]], rows.fact[rows.active[q]]
        if row[STIFFNESS] == 0.0:
            impact += fact[LOAD]
            opened += row[IMPULSE] - (fact[LOAD] if fact[BOUNCE] != 0.0 else 0.0)
    return impact, opened


@kernel
def rebound(
    rows: Rows, n: int, active: int, number: int, h: float, tolerance: float, touch: float
) -> int:
    """Open all contacts with an impact at the end of a substep; return the number of sweeps.

    `h` is the length of the substep [s].

    Restitution with friction can increase the kinetic energy in an eccentric impact. A plastic
    impact, which did the work `lost` < 0 [J], cannot. Energy is quadratic in the velocities, so the
    gain is a convex function of the fraction of restitution. At the fraction where the chord from
    plastic to full restitution is zero, the gain is therefore not positive.

    Contacts that friction locks, as those on both sides of a wedge, cannot open: the sweeps do not
    converge, and their impulses exceed those of the impact. Then there is no restitution, and if
    the contacts are locked without it, too, the rebound is taken back.
    """
    rows.slot[n, BOUNCES] = 0.0  # what does not move is not struck
    struck = list_struck(rows, active)
    lost = work_from(rows, struck, FREE)
    start_rebound(rows, struck, h, touch)
    copy_velocities(rows.slot, n, NOW, BEFORE)
    sweeps, share, first = 0, 1.0, True
    while True:
        aim_rebound(rows, n, struck, share)
        swept = settle(rows, n, struck, number, math.inf, tolerance)
        sweeps += swept
        work = work_from(rows, struck, BEFORE)
        impact, opened = impulses_from(rows, struck)
        locked = swept == MOST_SWEEPS and opened > impact
        if lost + work <= -ROUNDING * lost and not locked:
            break
        if share == 0.0:  # the sweeps do not converge: no rebound
            take_back(rows, n, struck)
            break
        share = min(max(-lost / work, 0.0), 1.0) if first and not locked else 0.0
        first = False
    end_rebound(rows, struck)
    return sweeps


@kernel
def end_rebound(rows: Rows, active: int) -> None:
    """Sum up the impulses of a rebound, and resume those before it where there was no impact."""
    for q in range(active):
        k = rows.active[q]
        row, fact = rows.row[k], rows.fact[k]
        if row[STIFFNESS] > 0.0:
            continue
        a, b = rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        if fact[BOUNCE] != 0.0:
            normal, shear = row[IMPULSE] - fact[LOAD], row[IMPULSE + 1] - fact[LOAD + 1]
            count_row(row, fact, a, b, normal, shear, row[ROLLED] - fact[LOAD + 2])
            fact[BOUNCE] = row[IMPULSE] = row[IMPULSE + 1] = row[ROLLED] = 0.0
        else:
            count_row(row, fact, a, b, row[IMPULSE], row[IMPULSE + 1], row[ROLLED])
            row[IMPULSE], row[IMPULSE + 1] = fact[LOAD], fact[LOAD + 1]
            row[ROLLED] = fact[LOAD + 2]


@kernel
def take_back(rows: Rows, n: int, active: int) -> None:
    """Take back a rebound."""
    copy_velocities(rows.slot, n, BEFORE, NOW)
    for q in range(active):
        k = rows.active[q]
        row, fact = rows.row[k], rows.fact[k]
        if row[STIFFNESS] == 0.0:
            kept = 1.0 if fact[BOUNCE] != 0.0 else 0.0
            row[IMPULSE], row[IMPULSE + 1] = kept * fact[LOAD], kept * fact[LOAD + 1]
            row[ROLLED] = kept * fact[LOAD + 2]
