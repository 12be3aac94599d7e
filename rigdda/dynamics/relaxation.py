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
two contacts of a face are solved together (`sweeps.press_face`). The shear impulse stops slip
within the friction limit. Many short substeps with few sweeps resolve the path of an impact better
than one step with many sweeps (Macklin et al. 2019, Small steps in physics simulation). After each
`SET_OF_SWEEPS` sweeps, the impulses are extrapolated (`sweeps.extrapolate`), without which heavy
bodies on light ones would rebound from plastic impacts.

Rolling resistance is a moment of at most c N R against the relative rotation of the bodies of a
contact, where R is the radius of gyration of `law.rolling_radius`. As an impulse along e_r = (0, 0,
R), it acts like friction. Within the sweeps, its limit follows a decreasing normal impulse but not
an increasing one, as this could diverge. Therefore the substep is first settled with the limits of
the last one, and then with the limits of the normal impulses that it found
(`sweeps.limit_rolling`).

A contact that closes faster than a body that has fallen by the target penetration, and faster than
the tolerance of the sweeps, undergoes an impact. The impact is plastic during its substep. At the
end of the substep, contacts with an impact open with the velocities given by their restitution, see
`rebound`; the sum of both impulses of a contact obeys Coulomb friction. If the impact would gain
energy, restitution is reduced. (Impacts slower than the tolerance would end the support of a pile
by contacts that sweeps have not yet resolved: in a hopper of 1,000 blocks, penetration was ten
times as great.)

Contacts penetrate slightly, because sweeps end at a tolerance and bodies rotate within a substep.
Excess penetration is removed at the end of the step, see `position_correction`.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Rows
from rigdda.dynamics.constants import (
    AT_ONCE,
    MOST_SWEEPS,
    SETTLED,
    SUBSTEPS,
)
from rigdda.dynamics.motion import impact_speed
from rigdda.dynamics.rebound import rebound
from rigdda.dynamics.records import Parameters
from rigdda.dynamics.rows import (
    BRAKE,
    GAP,
    IMPULSE,
    NORMAL,
    NOW,
    PULL,
    ROLLED,
    STIFFNESS,
    STRUCK,
    along_six,
    place_row,
)
from rigdda.dynamics.slots import drift, drift_half, fade, greatest_pull, pull
from rigdda.dynamics.substep import end_rows, start_rows
from rigdda.dynamics.sweeps import settle, settle_safely
from rigdda.dynamics.yielding_fences import end_fences, hold_fences, release_fences, stop_uphill
from rigdda.kernel import kernel, variable


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
def to_forces(rows: Rows, count: int, last: float, short: bool) -> None:
    """Divide the impulses of the last substep by its duration `last` [s].

    After a `short` substep, contacts that had an impact have no force.
    """
    for place in range(count):
        lasts = 0.0 if rows.fact[place, STRUCK] > 0.0 and short else 1.0 / last
        rows.row[place, IMPULSE] *= lasts
        rows.row[place, IMPULSE + 1] *= lasts
        rows.row[place, ROLLED] *= lasts


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
    least_change = p.tolerance * (speed + greatest_pull(rows, n) * usual)
    tolerance = max(min(p.sweep_tolerance * (n - 1), SETTLED * speed), least_change)
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
        active = start_rows(rows, count, number, h, h - gone * h, h / last, touch)
        swept = settle_safely(rows, n, active, number, reach, tolerance)
        sweeps += swept
        while fenced and release_fences(rows, n, active, h, touch, ledger):
            sweeps += settle(rows, n, active, number, reach, tolerance)
        if fenced:
            end_fences(rows.slot, rows.scale, n, ledger)
        hit, bouncing = end_rows(rows, n, active, least)
        drift(rows.slot, rows.scale, n, h, gone)
        ledger[2] += fade(rows.slot, n, 0.5 * h)
        if bouncing:
            sweeps += rebound(rows, n, active, number, h, tolerance, touch)
            ledger[1] -= stop_uphill(rows.slot, n)
        struck, last, left = struck or hit, h, left - h if h < left else 0.0
        number += 0 if alone else 1
    to_forces(rows, count, last, last < 0.5 * usual)
    return sweeps, struck, swept < MOST_SWEEPS
