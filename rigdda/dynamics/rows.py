"""Contacts of one island as rows of numbers, for relaxation and position correction.

A row describes a contact in two ways. The geometry is fixed in body coordinates: the vertex
relative to the centroid of its owner, and a point and the normal of the face relative to the body
of the face. The directions are recomputed in every substep from the positions of the bodies: e_n
and e_s, the rows of the contact along the normal and shear directions for its bodies a and b, each
divided by the square root of the inertia, so that an impulse p changes the scaled velocities V =
sqrt(M) v by p e.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Rows
from rigdda.dynamics.constants import BOLT, PIN, PLAIN, SAME_FACE
from rigdda.dynamics.records import Contact, Contacts, Floats
from rigdda.kernel import arithmetic_kernel, inlined, kernel

# Columns of rows.row, read by a sweep. NORMAL to + 5: e_n of a and b [kg^-1/2]. IMPULSE and + 1:
# normal and shear impulse in this substep [N s]. AIM: least normal velocity to be reached [m/s].
NORMAL, IMPULSE, AIM = 0, 6, 8

# p = KEEP p + GAIN (AIM - v), see relaxation.sweep [-], [kg]. COHESION, TENSION: impulses of the
# shear strength at zero pressure and of the tensile strength [N s].
KEEP, GAIN, COHESION, TENSION = 9, 10, 11, 12

# SHEAR to + 5, AIM_SHEAR, KEEP_SHEAR, GAIN_SHEAR: the same for shear. FLEXIBLE: normal velocity per
# impulse [1/kg]. FRICTION: tan phi. STIFFNESS of a spring [N/m], 0 for a rigid contact.
SHEAR, AIM_SHEAR, KEEP_SHEAR, GAIN_SHEAR, FLEXIBLE = 14, 20, 21, 22, 24
FRICTION, STIFFNESS = 25, 26

# GAP [m]. BEND: second time derivative of the gap due to rotation [m/s2]; + 1: along shear.
GAP, BEND = 27, 28

# ROLL and + 1: e_r, R times the rates of rotation of a and b. ROLLED: rolling impulse, the moment
# impulse over R [N s], at most ROLL_LIMIT and at most ROLLING [-] times the normal impulse.
ROLL, ROLLED, ROLL_LIMIT, ROLLING = 30, 32, 33, 34

# BOTH, of the first of the two contacts of a face: normal velocity of each per impulse of the other
# [1/kg]. INVERSE: inverse determinant of the 2 x 2 matrix of both, 0 if it is singular [kg2].
BOTH, INVERSE = 35, 36

COLUMNS = 37

# Columns of rows.fact. VERTEX, FACE, DIRECTION, each with + 1: position of the vertex and of the
# point of the face, and the normal, in body coordinates [m]. FREE_GAP, FREE_SHEAR: displacements at
# which a spring is force-free [m]. STRENGTH and + 1: cohesion and tension of a contact [N].
VERTEX, FACE, DIRECTION, FREE_GAP, FREE_SHEAR, STRENGTH = 0, 2, 4, 6, 7, 8

# RADIUS: R [m]. RESTITUTION [-], which has fallen to half at RESTITUTION_SPEED [m/s]. REBOUND:
# restitution of the impact in this substep [-]. BOUNCE: opening velocity after it [m/s], 0 without
# one, TAKEN_BACK of a contact whose impulse a rebound takes back. STRUCK: 1 after an impact in this
# step, else 0. LOAD, + 1 and + 2: normal, shear and rolling impulse before a rebound [N s].
RADIUS, RESTITUTION, RESTITUTION_SPEED, REBOUND, BOUNCE, STRUCK, LOAD = 10, 11, 12, 13, 14, 15, 16

# SUM, + 1 and + 2: sums of these impulses since the start of the step [N s]. WORK: work of the
# normal force; + 1: of the shear and the rolling force [J]. WORK_ON_A: work of all on body a [J].
SUM, WORK, WORK_ON_A = 19, 22, 24

# REACHED and + 1: normal and shear impulse after the last extrapolation; RESIDUE and + 1, GOAL and
# + 1: their changes by the sweeps before it, and their values after these [N s].
REACHED, RESIDUE, GOAL = 25, 27, 29

FACTS = 31

# Columns of rows.slot, one slot per body. NOW, FREE, BEFORE: scaled velocities at the end of this
# substep, the same without contacts, and in the substep before [kg^1/2 m/s]. X, Y: centroid [m].
# TURN: rotation since the start of the step [rad], with its COS and SIN. PULL: scaled acceleration
# by weight and loads. DAMPING [1/s]. FIELD: work of weight and loads since the start of the step
# [J]. HELD: 1 if it has an impact or touches another body in this substep, else 0.
NOW, FREE, BEFORE, X, Y, TURN, COS, SIN = 0, 3, 6, 9, 10, 11, 12, 13
PULL, DAMPING, FIELD, HELD = 14, 17, 18, 19

# BRAKE: force at which a fence yields [N], 0 for other bodies. MOVES: 1 / sqrt(M) of a fence along
# x, used while it yields. LEFT, START: remaining elongation and x at the start of the step [m].
BRAKE, MOVES, LEFT, START = 20, 21, 22, 23

# BOUNCES: 1 if one of its contacts has to open again at the end of this substep, else 0.
BOUNCES = 24

SLOT_COLUMNS = 25

TAKEN_BACK = -1.0

# rows.form: the vertex belongs to a, to b, or the contact is a bolt between two points
OF_A, OF_B, BETWEEN = 0, 1, 2


@arithmetic_kernel
def along_six(e: Floats, a: Floats, b: Floats, first: int) -> float:
    """Return the velocity along a row of two bodies, from three columns of their slots."""
    own = e[0] * a[first] + e[1] * a[first + 1] + e[2] * a[first + 2]
    return own + (e[3] * b[first] + e[4] * b[first + 1] + e[5] * b[first + 2])


@arithmetic_kernel
def push(row: Floats, first: int, a: Floats, b: Floats, column: int, impulse: float) -> None:
    """Add an impulse along a row to three columns of the slots of both bodies."""
    for q in range(3):
        a[column + q] += impulse * row[first + q]
        b[column + q] += impulse * row[first + 3 + q]


@kernel
def is_elastic(c: Contact) -> bool:
    """Return whether a contact is a spring of given stiffness or a support."""
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
    row[FRICTION], row[ROLLING] = c.friction, c.rolling
    fact[RADIUS], fact[RESTITUTION] = c.radius, max(c.restitution, 0.0)
    fact[RESTITUTION_SPEED] = c.restitution_speed
    row[IMPULSE], row[IMPULSE + 1] = c.accumulated_normal, c.accumulated_shear
    row[ROLLED] = c.accumulated_roll
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
    for q in range(REBOUND, REACHED):
        fact[q] = 0.0


@arithmetic_kernel
def place_row(
    row: Floats, fact: Floats, form: int, a: Floats, b: Floats, one: Floats, two: Floats
) -> None:
    """Set the gap and the directions of a row from the current positions of its bodies a and b.

    `one` and `two` are their entries of `rows.scale`: inverse square roots of the inertia.
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
    row[ROLL], row[ROLL + 1] = fact[RADIUS] * one[2], -fact[RADIUS] * two[2]
    # velocity of the vertex relative to the centroid of the face, and the second time derivative
    # of the gap due to rotation
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
def shares_face(c: Contact, other: Contact) -> bool:
    """Return whether two successive contacts are the two ends of one contact face."""
    same = c.a == other.a and c.b == other.b and not (is_elastic(c) or is_elastic(other))
    return same and c.nx * other.nx + c.ny * other.ny > SAME_FACE


@kernel
def sort_by_height(contacts: Contacts, islands: Islands, rows: Rows, low: int, high: int) -> None:
    """Assign the rows of the contacts low:high by height, lowest first.

    The two contacts of a face have successive rows.

    In this order a sweep carries loads through a pile. The counting sort has as many layers as
    there are contacts; the order within a layer does not matter. The contacts themselves stay in
    order, because reading them consecutively dominates the time in a large island.
    """
    place, height, layer = rows.place, rows.height, rows.layer
    layers = high - low
    least, most = math.inf, -math.inf
    for q in range(low, high):
        c = contacts[islands.contact_item[q]]
        height[q], rows.face[q - low] = c.y, 1
        if q > low and rows.face[q - 1 - low] == 1:
            if shares_face(contacts[islands.contact_item[q - 1]], c):
                height[q] = height[q - 1]
                rows.face[q - 1 - low], rows.face[q - low] = 2, 0
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
    for q in range(low, high):  # in the order of the rows
        rows.visit[place[q]] = rows.face[q - low]
    for k in range(layers):
        rows.face[k] = rows.visit[k]


@inlined
def pack_rows(contacts: Contacts, islands: Islands, rows: Rows, island: int) -> int:
    """Write the contacts of an island as rows, lowest first; return their number."""
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    still = islands.block_start[island + 1] - islands.block_start[island]
    sort_by_height(contacts, islands, rows, low, high)
    for q in range(low, high):
        pack_row(contacts[islands.contact_item[q]], islands, rows, rows.place[q], still)
    return high - low
