"""Thinning of trajectories: kinds of motion, and the states that a drawing needs.

A step is free flight if it changes the velocity of a block as `island_step.fall` does. A flight
shorter than `HOP` is part of rolling. The line between the states that are kept is within a
tolerance of all others.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.island_step import fall
from rigdda.dynamics.motion import kinetic_energy
from rigdda.dynamics.records import Bodies
from rigdda.kernel import entry_kernel, kernel, variable

START, FLIGHT, CONTACT, IMPACT, END = range(5)
"""Kinds of state, see `rigdda.trajectory.PointKind`."""

HOP = 0.1
"""Shortest free flight that ends with an impact [s]. A block that hops for less rises by less than
1.3 cm above the chord of its flight: it rolls or slides."""

TOUCH = 1e-6
"""Change of the velocity of any point of a block, beyond that of free flight, from which a step is
not free flight [m/s]. A block at rest is changed by g dt, 1e4 times as much; rounding errors are a
thousandth of it."""

X, Y, THETA, VX, VY, OMEGA = range(6)
"""Columns of a motion [m, m, rad, m/s, m/s, rad/s], see `frames.keep_frame`."""

NUMBER = 4
"""Number of coordinates that are kept within the tolerance, see `coordinates`."""


@entry_kernel
def classify(
    motion: NDArray,
    body: Bodies,
    parameters: NDArray[np.void],
    stride: int,
    kinds: NDArray,
    energies: NDArray,
    ledger: NDArray,
) -> None:
    """Determine the kind and the kinetic energy of each state of a block.

    Parameters
    ----------
    motion : (n, 6) array
        The states.
    body : (1,) array of BODY
        A copy of the block, which is overwritten.
    parameters : array of PARAMETERS
        Parameters of the scene and the settings.
    stride : int
        Number of steps between two states.
    kinds : (n,) array of int8
        Filled with the kinds.
    energies : (n,) array
        Filled with the kinetic energies [J/m].
    ledger : array
        Overwritten; room for `records.LEDGER`.
    """
    one, p, last = body[0], parameters[0], len(motion) - 1
    for k in range(len(motion)):
        one.theta, one.vx, one.vy = motion[k, THETA], motion[k, VX], motion[k, VY]
        one.omega = motion[k, OMEGA]
        energies[k] = kinetic_energy(one)
        if k == last:
            break
        for _ in range(stride):
            fall(one, p, ledger)
        change = math.hypot(motion[k + 1, VX] - one.vx, motion[k + 1, VY] - one.vy)
        change += one.radius * abs(motion[k + 1, OMEGA] - one.omega)
        kinds[k + 1] = FLIGHT if change < TOUCH else CONTACT
    _mark_impacts(kinds, HOP / (stride * p.dt))
    kinds[0] = START
    if last > 0:
        kinds[last] = END


@kernel
def _mark_impacts(kinds: NDArray, shortest: float) -> None:
    """Mark the ends of flights of at least so many states, and turn shorter ones into contact."""
    first = 1  # of the current flight
    for k in range(1, len(kinds)):
        if kinds[k] == FLIGHT:
            continue
        if k - first >= shortest:
            kinds[k] = IMPACT
        else:
            for hop in range(first, k):
                kinds[hop] = CONTACT
        first = k + 1


@entry_kernel
def keep(
    times: NDArray,
    motion: NDArray,
    heads: NDArray,
    kinds: NDArray,
    radius: float,
    tolerance: float,
    kept: NDArray,
    door: NDArray,
) -> int:
    """Choose the states of a block between which straight lines are within a tolerance.

    The first and the last state, impacts and the states before them, and those at the start of a
    flight are always kept. Others are kept as late as possible: a line from the last kept state
    must pass every later one within the tolerance (the "swinging door" of Bristol 1990).

    Parameters
    ----------
    times : (n,) array
        Ascending times [s].
    motion : (n, 6) array
        The states.
    heads : (n,) array
        Kinetic energy over weight, the height from which the block would have to fall [m].
    kinds : (n,) array of int8
        Their kinds.
    radius : float
        Radius of the block; the path of a point at this distance is kept within the tolerance [m].
    tolerance : float
        Greatest deviation [m].
    kept : (n,) array of int64
        Filled with the indices of the kept states, ascending.
    door : (4, NUMBER) array
        Overwritten.

    Returns
    -------
    int
        Their number.
    """
    kept[0], count, anchor, last = 0, variable(1), 0, len(times) - 1
    low, high, here, start = door[0], door[1], door[2], door[3]
    _open_door(low, high)
    _coordinates(motion, heads, 0, radius, start)
    for k in range(1, len(times)):
        _coordinates(motion, heads, k, radius, here)
        if not _is_in_door(low, high, start, here, times[k] - times[anchor]):
            anchor = k - 1
            kept[count] = anchor
            count += 1
            _open_door(low, high)
            _coordinates(motion, heads, anchor, radius, start)
        _narrow_door(low, high, start, here, times[k] - times[anchor], tolerance)
        if k == last or kinds[k] == IMPACT or (kinds[k] == FLIGHT) != (kinds[k + 1] == FLIGHT):
            anchor = k
            kept[count] = anchor
            count += 1
            _open_door(low, high)
            _coordinates(motion, heads, anchor, radius, start)
    return count


@kernel
def _coordinates(motion: NDArray, heads: NDArray, k: int, radius: float, found: NDArray) -> None:
    """Write what is kept within the tolerance at state k: place, path of the rim and head [m]."""
    found[0], found[1] = motion[k, X], motion[k, Y]
    found[2], found[3] = radius * motion[k, THETA], heads[k]


@kernel
def _open_door(low: NDArray, high: NDArray) -> None:
    """Permit all rates of the coordinates."""
    for c in range(NUMBER):
        low[c], high[c] = -math.inf, math.inf


@kernel
def _is_in_door(low: NDArray, high: NDArray, start: NDArray, here: NDArray, time: float) -> bool:
    """Return whether a line to a state passes all states since the last kept one closely."""
    for c in range(NUMBER):
        rate = (here[c] - start[c]) / time
        if rate < low[c] or rate > high[c]:
            return False
    return True


@kernel
def _narrow_door(
    low: NDArray, high: NDArray, start: NDArray, here: NDArray, time: float, tolerance: float
) -> None:
    """Permit only rates with which a line passes a state within the tolerance."""
    for c in range(NUMBER):
        low[c] = max(low[c], (here[c] - start[c] - tolerance) / time)
        high[c] = min(high[c], (here[c] - start[c] + tolerance) / time)
