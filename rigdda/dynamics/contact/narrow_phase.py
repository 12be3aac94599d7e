"""Contacts between two polygons over a step, one convex part against another.

The face of contact is found by `separating_axes`; the edge that meets it is clipped to it.

Where the last edge to separate two parts, or the one that faces it, is inside its body, the way in
leads through a neighbouring part, and that one has the contact.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.constants import AWAKE, SAME_FACE
from rigdda.dynamics.contact.separating_axes import (
    SQUARE,
    TOUCH,
    axis_gap,
    face_of_contact,
    following,
    incident_edge,
    touch_time,
)
from rigdda.dynamics.records import Bodies, Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


@kernel
def add_contact(
    c: Contact, a: int, b: int, key: int, owner: int, other: int,
    x: float, y: float, nx: float, ny: float, gap: float,
) -> None:  # fmt: skip
    """Write the geometry of a contact."""
    c.a, c.b, c.key, c.owner, c.other = a, b, key, owner, other
    c.x, c.y, c.nx, c.ny, c.gap = x, y, nx, ny, gap


@inlined
def clip_contacts(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, i: int,
    edge: int, j: int, other: int, shift_x: float, shift_y: float, reach: float, margin: float,
    beside: float,
) -> int:  # fmt: skip
    """Add up to two contacts of bodies a and b where the incident edge lies over the face.

    The face of contact is edge `edge` of polygon i, the incident edge is edge `other` of polygon j;
    (shift_x, shift_y) moves j to where it is at the time of entry, but for its turning: a corner
    within `beside` of the face may come over it. Returns the new number of contacts.
    """
    face = outlines.corner[i, edge]
    nx, ny, x0, y0 = face.normal_x, face.normal_y, face.x, face.y
    tx, ty = -ny, nx
    end = following(edge, outlines.polygon[i].count)
    next_corner = outlines.corner[i, end]
    length = tx * (next_corner.x - x0) + ty * (next_corner.y - y0)
    other_end = following(other, outlines.polygon[j].count)
    # along the face, the incident edge runs from its end (s1) to its start (s2)
    one, two = outlines.corner[j, other_end], outlines.corner[j, other]
    s1 = tx * (one.x + shift_x - x0) + ty * (one.y + shift_y - y0)
    s2 = tx * (two.x + shift_x - x0) + ty * (two.y + shift_y - y0)
    g1 = nx * (one.x - x0) + ny * (one.y - y0)
    g2 = nx * (two.x - x0) + ny * (two.y - y0)
    # a corner of j that touches the next edge of a notch, too, may be a little beyond the face
    start = -margin if face.reentrant else -beside
    stop = length + margin if next_corner.reentrant else length + beside
    low = s1 if s1 >= start else 0.0
    high = s2 if s2 <= stop else length
    if high < low:
        return k
    slope = (g2 - g1) / (s2 - s1) if s2 > s1 else 0.0
    for which in range(2):
        s = low if which == 0 else high
        if which == 1 and high - low < 1e-9 * length:
            break
        gap = g1 + slope * (s - s1)
        if gap > reach:
            continue
        if which == 0:
            own_corner = s1 < start
            corner, other_corner = edge, other_end
        else:
            own_corner = s2 > stop
            corner, other_corner = end, other
        if own_corner:  # a corner of i on the incident edge
            k = add_corner(bodies, outlines, contacts, k, a, b, i, corner, i, edge, gap)
        else:
            k = add_corner(bodies, outlines, contacts, k, a, b, j, other_corner, i, edge, gap)
    return k


@kernel
def edges_in_line(outlines: Outlines, i: int, edge: int, way: int) -> int:
    """Return how many edges of polygon i next to `edge` are in one line with it.

    Those after it where `way` is 1, those before it where `way` is -1. An edge with corners within
    it is a line of several edges.
    """
    n, own = outlines.polygon[i].count, outlines.corner[i, edge]
    for number in range(1, n):
        other = outlines.corner[i, (edge + way * number + n) % n]
        dot = own.normal_x * other.normal_x + own.normal_y * other.normal_y
        if other.inner or dot < SAME_FACE:
            return number - 1
    return 0


@inlined
def clip_lines(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, i: int,
    edge: int, j: int, other: int, shift_x: float, shift_y: float, reach: float, margin: float,
    beside: float,
) -> int:  # fmt: skip
    """Add the contacts of the line of the face of contact with that of the incident edge.

    Each edge in line with the face is clipped against each edge in line with the incident one, so
    that two bodies bear on each other over all of the length that they share. Takes and returns
    what `clip_contacts` does, but -1 if the contacts do not fit.
    """
    first, n, m = k, outlines.polygon[i].count, outlines.polygon[j].count
    face_low, face_high = edges_in_line(outlines, i, edge, -1), edges_in_line(outlines, i, edge, 1)
    low, high = edges_in_line(outlines, j, other, -1), edges_in_line(outlines, j, other, 1)
    alone = face_low + face_high + low + high == 0
    for at in range(edge - face_low, edge + face_high + 1):
        for against in range(other - low, other + high + 1):
            if k + 2 > len(contacts):
                return -1
            found = clip_contacts(
                bodies, outlines, contacts, k, a, b, i, (at + n) % n, j, (against + m) % m, shift_x,
                shift_y, reach, margin, beside,
            )  # fmt: skip
            if alone:
                return found
            for new in range(k, found):
                k = keep_nearest(contacts, first, k, new)
    return k


@inlined
def add_corner(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, owner: int,
    corner: int, i: int, edge: int, gap: float,
) -> int:  # fmt: skip
    """Add the contact of a corner of polygon `owner` with the face `edge` of polygon i.

    Its key is that of the corner of the body, so that parts share accumulated forces.
    """
    sign = 1.0 if outlines.polygon[i].body == b else -1.0  # the normal points to a
    body = outlines.polygon[owner].body
    own, face = outlines.corner[owner, corner], outlines.corner[i, edge]
    key = body * outlines.corner.shape[1] + own.number
    add_contact(
        contacts[k], a, b, key, 1 if body == a else 0, bodies[b].surface,
        own.x, own.y, sign * face.normal_x, sign * face.normal_y, gap,
    )  # fmt: skip
    return k + 1


@inlined
def collide_pair(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, p: Parameters
) -> int:  # fmt: skip
    """Add the contacts of bodies a and b from entry k on; returns the new number, or -1."""
    dt = p.dt
    one, two = bodies[a], bodies[b]
    dx, dy = -one.vx * dt, -one.vy * dt
    path, fall = one.path, p.gravity * dt * dt
    if two.status == AWAKE:
        dx += two.vx * dt
        dy += two.vy * dt
        path += two.path
        fall = 0.0
    spread = path + fall + p.margin
    beside = 0.5 * dt * (abs(one.omega) * one.radius + abs(two.omega) * two.radius)
    # both turn about their centroids
    other = two.omega if two.status == AWAKE else 0.0
    turn = (other - one.omega) * dt
    px = (other * two.y - one.omega * one.y) * dt
    py = (one.omega * one.x - other * two.x) * dt
    if one.parts == 1 and two.parts == 1:
        return collide_parts(
            bodies, outlines, contacts, k, a, b, a, b, dx, dy, px, py, turn, spread, p.margin, 0.0,
            beside,
        )  # fmt: skip
    first = k
    k = collide_all_parts(
        bodies, outlines, contacts, k, a, b, dx, dy, px, py, turn, spread, p.margin,
        0.0, beside,
    )  # fmt: skip
    if k == first:  # parts that overlap, deeper than to an edge inside a body: the way that is left
        k = collide_all_parts(
            bodies, outlines, contacts, k, a, b, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, p.margin, 1e300, 0.0
        )
    return k


@kernel
def collide_all_parts(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, dx: float,
    dy: float, px: float, py: float, turn: float, spread: float, margin: float, sunk: float,
    beside: float,
) -> int:  # fmt: skip
    """Add the contacts of every convex part of a with every one of b; -1 if they do not fit."""
    first, one, two = k, bodies[a], bodies[b]
    for i in range(one.part, one.part + one.parts):
        for j in range(two.part, two.part + two.parts):
            if k + 2 > len(contacts):
                return -1
            found = collide_parts(
                bodies, outlines, contacts, k, a, b, i, j, dx, dy, px, py, turn, spread, margin,
                sunk, beside,
            )  # fmt: skip
            if found < 0:
                return -1
            for new in range(k, found):
                k = keep_nearest(contacts, first, k, new)
    return k


@kernel
def keep_nearest(contacts: Contacts, first: int, k: int, new: int) -> int:
    """Move contact `new` to entry k, or over one of first:k of the same corner with the same face.

    Parts that share a corner, or a face that a cut ends at, find the same contact. Returns the new
    number.
    """
    place, c = k, contacts[new]
    for m in range(first, k):
        other = contacts[m]
        same = other.key == c.key and other.owner == c.owner
        if same and other.nx * c.nx + other.ny * c.ny > SAME_FACE:
            if other.gap <= c.gap:
                return k
            place = m
    add_contact(contacts[place], c.a, c.b, c.key, c.owner, c.other, c.x, c.y, c.nx, c.ny, c.gap)
    return max(k, place + 1)


@inlined
def collide_parts(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, i: int, j: int,
    dx: float, dy: float, px: float, py: float, turn: float, spread: float, margin: float,
    sunk: float, beside: float,
) -> int:  # fmt: skip
    """Add the contacts of polygon i of body a with polygon j of body b; returns the new number.

    (dx, dy) is the displacement of b relative to a over the step, (px - turn y, py + turn x) what
    turning adds to it at (x, y), see `face_of_contact`, and `beside` half of how far both may turn.
    """
    ni, nj = outlines.polygon[i].count, outlines.polygon[j].count
    # what moves may be deflected by others before they meet
    square = math.inf if bodies[b].status == AWAKE else SQUARE * math.sqrt(dx * dx + dy * dy)
    possible, time_i, gap_i, apart_i, edge_i = face_of_contact(
        outlines, i, ni, j, nj, dx, dy, px, py, turn, spread, margin, sunk, square
    )
    if not possible:
        return k
    possible, time_j, gap_j, apart_j, edge_j = face_of_contact(
        outlines, j, nj, i, ni, -dx, -dy, -px, -py, -turn, spread, margin, sunk, square
    )
    if not possible:
        return k
    # near a tie keep the face of a, so that parallel faces do not alternate
    of_j = time_j > time_i or (time_j == time_i and gap_j > gap_i + TOUCH * margin)
    reach = (dx * dx + dy * dy) ** 0.5 + spread
    touching = max(apart_i, apart_j) <= margin
    # where they touch, not where they are deeper than the margin
    time_i = touch_time(gap_i, time_i, square, margin)
    time_j = touch_time(gap_j, time_j, square, margin)
    beside = 0.0 if touching else beside
    # corner beside corner, the better face may miss the other body where the second one does not;
    # and what is beside it at the time of entry may be driven into it from where it is now
    for _ in range(2):
        face, edge, other = (j, edge_j, i) if of_j else (i, edge_i, j)
        facing = incident_edge(outlines, face, edge, other, outlines.polygon[other].count)
        if outlines.corner[face, edge].inner or outlines.corner[other, facing].inner:
            return k
        shift = -min(time_j, 1.0) if of_j else min(time_i, 1.0)
        found = clip_lines(
            bodies, outlines, contacts, k, a, b, face, edge, other, facing, dx * shift, dy * shift,
            reach, margin, beside,
        )  # fmt: skip
        if found != k or (shift == 0.0 and not touching):
            return found
        if touching:
            of_j = not of_j
        else:
            time_i = time_j = 0.0
    face, edge, other = (j, edge_j, i) if of_j else (i, edge_i, j)
    return deepest_corner(bodies, outlines, contacts, k, a, b, face, edge, other)


@kernel
def deepest_corner(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, i: int,
    edge: int, j: int,
) -> int:  # fmt: skip
    """Add the contact of the nearest corner of polygon j with the line of an edge of polygon i.

    For bodies that touch although the face does not reach over the corner: nearly parallel edges
    in a row, where rounding decides which of them is the face.
    """
    n = outlines.polygon[j].count
    face = outlines.corner[i, edge]
    nx, ny, x0, y0 = face.normal_x, face.normal_y, face.x, face.y
    gap, corner = axis_gap(nx, ny, x0, y0, outlines.corner, j, n)
    return add_corner(bodies, outlines, contacts, k, a, b, j, corner, i, edge, gap)
