"""Contacts of one island as rows of numbers, as relaxation and position correction read them.

A row holds a contact in two ways. Its place is kept in body coordinates: the vertex from the
centroid of the body that owns it, a point of the face and the normal from the body of the face. Its
directions are written anew for every substep, from where the bodies are then: e_n and e_s, the rows
of the contact along normal and shear for its bodies a and b, each divided by the root of the
inertia, so that an impulse p changes the scaled velocities V = sqrt(M) v by p e.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Rows
from rigdda.dynamics.constants import BOLT, PIN, PLAIN
from rigdda.dynamics.records import Contact, Contacts, Floats
from rigdda.kernel import arithmetic_kernel, inlined, kernel

# columns of rows.row, what a sweep reads. NORMAL to + 5: e_n of a and b [kg^-1/2]. IMPULSE and + 1:
# normal and shear impulse in this substep [N s]. AIM: normal velocity to reach at least [m/s].
NORMAL, IMPULSE, AIM = 0, 6, 8

# p = KEEP p + GAIN (AIM - v), see relaxation.sweep [-], [kg]. COHESION, TENSION: shear impulse
# and tension that the contact bears besides friction and pressure [N s].
KEEP, GAIN, COHESION, TENSION = 9, 10, 11, 12

# SHEAR to + 5, AIM_SHEAR, KEEP_SHEAR, GAIN_SHEAR: the same for shear. CROSS: shear impulse that a
# change of the normal impulse takes [-]. FLEXIBLE: normal velocity per impulse [1/kg]. FRICTION:
# tan phi. STIFFNESS of a spring [N/m], 0: it is rigid.
SHEAR, AIM_SHEAR, KEEP_SHEAR, GAIN_SHEAR, CROSS, FLEXIBLE = 14, 20, 21, 22, 23, 24
FRICTION, STIFFNESS = 25, 26

# GAP now [m]; BEND: its second time derivative as the bodies turn [m/s2], and + 1 along shear.
GAP, BEND = 27, 28

COLUMNS = 32

# columns of rows.fact. VERTEX, FACE, DIRECTION, each with + 1: place of the vertex and of the point
# of the face, and normal, in body coordinates [m]. FREE_GAP, FREE_SHEAR at which a spring is free
# [m]. STRENGTH, + 1: the forces of which COHESION and TENSION are impulses [N].
VERTEX, FACE, DIRECTION, FREE_GAP, FREE_SHEAR, STRENGTH = 0, 2, 4, 6, 7, 8

# RESTITUTION [-]. BOUNCE: velocity with which a contact that was struck in this substep is to open
# [m/s], 0: it was not. STRUCK: 1 if it was in this step, else 0. LOAD and + 1: impulses before a
# rebound [N s].
RESTITUTION, BOUNCE, STRUCK, LOAD = 11, 12, 13, 14

# SUM and + 1: impulses since the start of the step [N s]. WORK and + 1: work of normal and shear
# force [J]; WORK_ON_A: of both on body a.
SUM, WORK, WORK_ON_A = 16, 18, 20

FACTS = 21

# columns of rows.slot, one slot a body. NOW, FREE, BEFORE: scaled velocities now, those that the
# body would have in this substep without contacts, and in the substep before [kg^1/2 m/s]. X, Y:
# centroid [m]; TURN since the start of the step [rad], with its COS and SIN. PULL: scaled
# acceleration of weight and loads. DAMPING [1/s]. FIELD: work of weight and loads since the start
# of the step [J]. HELD: 1 if it was struck or touches another body in this substep, else 0.
NOW, FREE, BEFORE, X, Y, TURN, COS, SIN = 0, 3, 6, 9, 10, 11, 12, 13
PULL, DAMPING, FIELD, HELD = 14, 17, 18, 19

# BRAKE: force against which a fence gives way [N], 0: no fence. MOVES: its 1 / sqrt(M) along x,
# which counts while it does. LEFT: elongation that is left at the start of the step, START: x then
# [m].
BRAKE, MOVES, LEFT, START = 20, 21, 22, 23

SLOT_COLUMNS = 24

# rows.form: which body owns the vertex, or that it is a bolt
OF_A, OF_B, BETWEEN = 0, 1, 2


@arithmetic_kernel
def along_six(e: Floats, a: Floats, b: Floats, first: int) -> float:
    """Return the velocity along a row of two bodies, from three columns of their slots."""
    own = e[0] * a[first] + e[1] * a[first + 1] + e[2] * a[first + 2]
    return own + (e[3] * b[first] + e[4] * b[first + 1] + e[5] * b[first + 2])


@arithmetic_kernel
def push(row: Floats, first: int, a: Floats, b: Floats, column: int, impulse: float) -> None:
    """Change three columns of two slots by what an impulse along a row changes them."""
    for q in range(3):
        a[column + q] += impulse * row[first + q]
        b[column + q] += impulse * row[first + 3 + q]


@kernel
def is_elastic(c: Contact) -> bool:
    """Return whether a contact is a spring whose stiffness is given, or a support."""
    return c.kind == PLAIN or c.kind == BOLT or c.kind == PIN


@inlined
def pack_row(c: Contact, islands: Islands, rows: Rows, place: int, still: int) -> None:
    """Write a contact as row `place`; slot `still` stands for bodies without unknowns."""
    row, fact, slot = rows.row[place], rows.fact[place], rows.slot
    i = islands.slot[c.a]
    j = islands.slot[c.b] if c.pair >= 0 else still
    rows.row_i[place], rows.row_j[place], rows.idle[place] = i, j, 0
    of_a = c.owner == 1
    owner, face, side = (i, j, 1.0) if of_a else (j, i, -1.0)
    rows.form[place] = BETWEEN if c.kind == BOLT else (OF_A if of_a else OF_B)
    fact[VERTEX], fact[VERTEX + 1] = c.x - slot[owner, X], c.y - slot[owner, Y]
    fact[FACE] = c.x - side * c.gap * c.nx - slot[face, X]
    fact[FACE + 1] = c.y - side * c.gap * c.ny - slot[face, Y]
    fact[DIRECTION], fact[DIRECTION + 1] = c.nx, c.ny
    row[FRICTION], fact[RESTITUTION] = c.friction, max(c.restitution, 0.0)
    row[IMPULSE], row[IMPULSE + 1] = c.accumulated_normal, c.accumulated_shear
    support = c.kind == PIN
    fact[STRENGTH] = math.inf if support else c.cohesion
    fact[STRENGTH + 1] = c.tension
    row[STIFFNESS] = fact[FREE_GAP] = fact[FREE_SHEAR] = 0.0
    if c.kind == BOLT:
        row[STIFFNESS] = c.stiffness
        fact[FREE_GAP] = c.gap + c.bias * c.kappa / c.stiffness
    elif c.kind == PLAIN:
        row[STIFFNESS] = c.stiffness
        fact[FREE_SHEAR] = c.accumulated_shear / c.stiffness
    for q in range(BOUNCE, FACTS):
        fact[q] = 0.0


@arithmetic_kernel
def place_row(
    row: Floats, fact: Floats, form: int, a: Floats, b: Floats, one: Floats, two: Floats
) -> None:
    """Set the gap and the directions of a row from where its bodies a and b are now.

    `one` and `two` are the columns of `rows.scale`: the inverse roots of their inertia.
    """
    co, so, cf, sf = a[COS], a[SIN], b[COS], b[SIN]
    xo, yo, xf, yf, side = a[X], a[Y], b[X], b[Y], 1.0
    if form == OF_B:
        co, so, cf, sf = cf, sf, co, so
        xo, yo, xf, yf, side = xf, yf, xo, yo, -1.0
    px = xo + co * fact[VERTEX] - so * fact[VERTEX + 1]
    py = yo + so * fact[VERTEX] + co * fact[VERTEX + 1]
    dx = px - (xf + cf * fact[FACE] - sf * fact[FACE + 1])
    dy = py - (yf + sf * fact[FACE] + cf * fact[FACE + 1])
    ax, ay, bx, by = px - a[X], py - a[Y], px - b[X], py - b[Y]
    if form == BETWEEN:
        length = math.sqrt(dx * dx + dy * dy)
        nx, ny, bx, by = dx / length, dy / length, bx - dx, by - dy
    else:
        nx = cf * fact[DIRECTION] - sf * fact[DIRECTION + 1]
        ny = sf * fact[DIRECTION] + cf * fact[DIRECTION + 1]
    row[GAP] = side * (nx * dx + ny * dy)
    row[0], row[1], row[2] = nx * one[0], ny * one[1], (ax * ny - ay * nx) * one[2]
    row[3], row[4], row[5] = -nx * two[0], -ny * two[1], -(bx * ny - by * nx) * two[2]
    row[SHEAR], row[SHEAR + 1] = -ny * one[0], nx * one[1]
    row[SHEAR + 2] = (ax * nx + ay * ny) * one[2]
    row[SHEAR + 3], row[SHEAR + 4] = ny * two[0], -nx * two[1]
    row[SHEAR + 5] = -(bx * nx + by * ny) * two[2]
    # velocity of the vertex from the centroid of the face, and how the gap bends as bodies turn
    spin, turn = a[BEFORE + 2] * one[2], b[BEFORE + 2] * two[2]
    rx, ry, fx, fy = ax, ay, bx, by
    if form == OF_B:
        spin, turn, rx, ry, fx, fy = turn, spin, bx, by, ax, ay
    ux = (a[BEFORE] * one[0] - b[BEFORE] * two[0]) * side - spin * ry
    uy = (a[BEFORE + 1] * one[1] - b[BEFORE + 1] * two[1]) * side + spin * rx
    over = 2.0 * turn * (nx * uy - ny * ux) - turn * turn * (nx * fx + ny * fy)
    row[BEND] = side * (over - spin * spin * (nx * rx + ny * ry))
    row[BEND + 1] = -spin * spin * (nx * ry - ny * rx)


@kernel
def sort_by_height(contacts: Contacts, islands: Islands, rows: Rows, low: int, high: int) -> None:
    """Set the rows of the contacts low:high by height, lowest first: a sweep carries loads through.

    A counting sort in as many layers as there are contacts; within one the order does not matter.
    Contacts stay in order: to read them one after the other is what takes long in a large island.
    """
    place, height, layer = rows.place, rows.height, rows.layer
    layers = high - low
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
def pack_rows(contacts: Contacts, islands: Islands, rows: Rows, island: int) -> int:
    """Write the contacts of an island as rows, lowest first; returns how many."""
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    still = islands.block_start[island + 1] - islands.block_start[island]
    sort_by_height(contacts, islands, rows, low, high)
    for q in range(low, high):
        pack_row(contacts[islands.contact_item[q]], islands, rows, rows.place[q], still)
    return high - low
