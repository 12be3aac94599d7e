"""Contacts as rows of numbers, as the sweeps of relaxation read them."""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Rows
from rigdda.dynamics.assembly.springs import normal_row, shear_row
from rigdda.dynamics.constants import (
    BOLT,
    IMPACT,
    PIN,
    PLAIN,
    SUBSTEPS,
)
from rigdda.dynamics.records import Contact, Contacts, Floats
from rigdda.kernel import arithmetic_kernel, inlined, kernel

# columns of rows.row. NORMAL to + 5: normal row for a and b, times h / sqrt(M) [(m/N)^1/2]. FORCE
# and + 1: normal and shear force [N]. What a visit to an open contact reads comes first.
NORMAL, FORCE = 0, 6

# HERE: gap at the start of the substep [m]. AIM: normal displacement to reach once closed [m];
# infinite for a spring, which is free at a gap. REBOUND: displacement of the substep in which an
# impact bounces [m]. HIT: number of that substep, -1 before.
HERE, AIM, REBOUND, HIT = 8, 9, 10, 11

# N = KEEP N + GAIN (aim - moved), see relaxation.sweep [-], [N/m]. COHESION, TENSION: shear and
# tension that the contact bears besides friction and pressure [N].
KEEP, GAIN, COHESION, TENSION = 12, 13, 14, 15

# SHEAR to + 5, KEEP_SHEAR, GAIN_SHEAR: the same for shear. CROSS: shear force that a change of the
# normal force takes [-].
SHEAR, KEEP_SHEAR, GAIN_SHEAR, CROSS = 16, 22, 23, 24

# FLEXIBLE: normal displacement per force [m/N]. FRICTION: tan phi. FREE: shear displacement at
# which a spring is free [m]. GAP: at the start of the step, or at which a spring is free [m].
FLEXIBLE, FRICTION, FREE, GAP = 25, 26, 27, 28

# SINCE: substep from which on the force is borne. SUM and + 1: sums of forces over substeps [N].
SINCE, SUM = 29, 30

COLUMNS = 32

# columns of rows.motion, each in three directions, times the roots of inertia over h: displacement
# in this substep, since the start of the step, and in the substep before
NOW, SO_FAR, BEFORE = 0, 3, 6


@kernel
def write_row(row: Floats, first: int, e: tuple[float, float, float], scale: Floats) -> None:
    """Write a row, scaled by the inertia of its body."""
    row[first], row[first + 1], row[first + 2] = e[0] * scale[0], e[1] * scale[1], e[2] * scale[2]


@kernel
def product(row: Floats, first: int, second: int) -> float:
    """Return the displacement along one direction of a contact per force along another [m/N]."""
    total = 0.0
    for q in range(6):
        total += row[first + q] * row[second + q]
    return total


@kernel
def displace(row: Floats, first: int, motion: Floats, i: int, j: int, force: float) -> None:
    """Move slots i and j by what a force along one direction of a contact displaces them."""
    for q in range(3):
        motion[i, NOW + q] += force * row[first + q]
        motion[j, NOW + q] += force * row[first + 3 + q]


@arithmetic_kernel
def along_six(e: Floats, a: Floats, b: Floats, first: int) -> float:
    """Return the displacement along a row of two bodies that move by columns of a and b [m]."""
    own = e[0] * a[first] + e[1] * a[first + 1] + e[2] * a[first + 2]
    return own + (e[3] * b[first] + e[4] * b[first + 1] + e[5] * b[first + 2])


@kernel
def is_elastic(c: Contact) -> bool:
    """Return whether a contact is a spring whose stiffness is given."""
    return c.kind == PLAIN or c.kind == BOLT or c.kind == PIN


@kernel
def set_rigid(row: Floats, c: Contact, flexible: float, rolling: float) -> None:
    """Write what a visit needs of a contact that gives way to nothing in a substep."""
    row[KEEP], row[GAIN] = 1.0, 1.0 / flexible
    row[KEEP_SHEAR], row[GAIN_SHEAR] = 1.0, 1.0 / rolling
    row[GAP], row[AIM], row[REBOUND], row[HIT] = c.gap, 0.0, -math.inf, -1.0
    if c.kind == IMPACT and c.bias > 0.0:
        row[REBOUND] = c.bias / SUBSTEPS
    elif c.kind == IMPACT:  # a fence that fails lets blocks pass
        row[AIM] = c.bias / SUBSTEPS


@inlined
def set_spring(row: Floats, c: Contact, flexible: float, rolling: float) -> None:
    """Write what a visit needs of a spring whose stiffness is given, see contact.law.

    Plain contacts and bolts are springs on the displacement of the step: of 2 and 4 times the
    stiffness in the law. A pin is one on the displacement at the end.
    """
    factor = 2.0 if c.kind == PLAIN else (4.0 if c.kind == BOLT else 1.0)
    stiffness = factor * c.kappa
    row[KEEP] = stiffness * flexible / (1.0 + stiffness * flexible)
    row[KEEP_SHEAR] = stiffness * rolling / (1.0 + stiffness * rolling)
    row[GAIN], row[GAIN_SHEAR] = row[KEEP] / flexible, row[KEEP_SHEAR] / rolling
    row[GAP], row[AIM], row[REBOUND] = -c.bias / factor, math.inf, -math.inf
    row[FREE] = c.accumulated_shear / stiffness


@inlined
def pack_row(c: Contact, islands: Islands, rows: Rows, place: int, n: int) -> None:
    """Write a contact as row `place` and add its starting force to the displacements.

    Slot n stands for bodies without unknowns.
    """
    row = rows.row[place]
    i = islands.slot[c.a]
    j = islands.slot[c.b] if c.pair >= 0 else n
    rows.row_i[place], rows.row_j[place], rows.idle[place] = i, j, 0
    write_row(row, NORMAL, normal_row(c, True), rows.scale[i])
    write_row(row, NORMAL + 3, normal_row(c, False), rows.scale[j])
    write_row(row, SHEAR, shear_row(c, True), rows.scale[i])
    write_row(row, SHEAR + 3, shear_row(c, False), rows.scale[j])
    flexible, rolling = product(row, NORMAL, NORMAL), product(row, SHEAR, SHEAR)
    if is_elastic(c):
        set_spring(row, c, flexible, rolling)
    else:
        set_rigid(row, c, flexible, rolling)
    row[FLEXIBLE], row[CROSS] = flexible, row[GAIN_SHEAR] * product(row, NORMAL, SHEAR)
    row[FRICTION], row[TENSION] = c.friction, c.tension
    row[COHESION] = math.inf if c.kind == PIN else c.cohesion
    row[FORCE], row[FORCE + 1] = c.start_normal, c.start_shear
    row[SUM] = row[SUM + 1] = row[SINCE] = 0.0
    displace(row, NORMAL, rows.motion, i, j, c.start_normal)
    displace(row, SHEAR, rows.motion, i, j, c.start_shear)


@arithmetic_kernel
def add_up(row: Floats, number: int) -> None:
    """Add the forces that a contact has had until the start of substep `number`."""
    row[SUM] += row[FORCE] * (number - row[SINCE])
    row[SUM + 1] += row[FORCE + 1] * (number - row[SINCE])
    row[SINCE] = number


@kernel
def sort_by_height(contacts: Contacts, islands: Islands, rows: Rows, low: int, high: int) -> None:
    """Set the rows of the contacts low:high by height, lowest first: a sweep carries loads through.

    A counting sort in as many layers as there is room for: within one the order does not matter.
    Contacts stay in order: to read them one after the other is what takes long in a large island.
    """
    place, height, layer = rows.place, rows.height, rows.layer
    layers = min(len(layer) - 1, high - low)
    least, most = math.inf, -math.inf
    for q in range(low, high):
        height[q] = contacts[islands.contact_item[q]].y
        least, most = min(least, height[q]), max(most, height[q])
    scale = layers / (most - least) * (1.0 - 1e-9) if most > least else 0.0
    for s in range(layers + 1):
        layer[s] = 0
    for q in range(low, high):
        place[q] = int(scale * (height[q] - least))
        layer[place[q] + 1] += 1
    for s in range(layers):
        layer[s + 1] += layer[s]
    for q in range(low, high):
        s = place[q]
        place[q] = layer[s]
        layer[s] += 1


@inlined
def take_forces(c: Contact, row: Floats) -> None:
    """Set the forces of a contact to their means over the step, its starting ones to the last."""
    add_up(row, SUBSTEPS)
    c.normal, c.shear = row[SUM] / SUBSTEPS, row[SUM + 1] / SUBSTEPS
    c.start_normal, c.start_shear = row[FORCE], row[FORCE + 1]
