"""Narrow phase: contacts between two polygons over a step, by pairs of convex parts.

The contact face is found by `separating_axes`; the incident edge is clipped to it.

If the last separating edge of two parts, or the incident edge, lies inside its body, bodies can
meet there only through a neighbouring part, which has the contact instead.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.constants import AWAKE, SAME_FACE
from rigdda.dynamics.contact.separating_axes import (
    SQUARE,
    TOUCH,
    Approach,
    axis_gap,
    face_of_contact,
    following,
    incident_edge,
    reverse,
    touch_time,
)
from rigdda.dynamics.records import Bodies, Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


class EdgePair(NamedTuple):
    """The edges at which two bodies meet."""

    a: int  # bodies; the normal of a contact points to a
    b: int
    i: int  # polygon of the contact face, and its edge
    edge: int
    j: int  # the other polygon, and its incident edge
    other: int


class Window(NamedTuple):
    """Limits within which corners of the incident edge form contacts with the face."""

    shift_x: float  # moves polygon j to its position at the time of entry, without rotation [m]
    shift_y: float
    reach: float  # greatest gap [m]
    margin: float  # how far beyond an end of the face in a notch a corner may lie [m]
    beside: float  # the same for any end: rotation may move a corner over the face [m]


@kernel
def write_parties(c: Contact, a: int, b: int, key: int, owner: int, other: int) -> None:
    """Write the bodies of a contact, its vertex and the surface of b."""
    c.a, c.b, c.key, c.owner, c.other = a, b, key, owner, other


@inlined
def write_geometry(
    c: Contact, x: float, y: float, nx: float, ny: float, gap: float, face_x: float
) -> None:
    """Write the vertex, the normal, the gap and the place of the face of a contact."""
    c.x, c.y, c.nx, c.ny, c.gap, c.face_x = x, y, nx, ny, gap, face_x


@kernel
def copy_geometry(c: Contact, was: Contact) -> None:
    """Copy what contact detection writes from one contact to another."""
    write_parties(c, was.a, was.b, was.key, was.owner, was.other)
    write_geometry(c, was.x, was.y, was.nx, was.ny, was.gap, was.face_x)


@inlined
def clip_contacts(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, pair: EdgePair, window: Window
) -> int:
    """Add up to two contacts of two bodies where the incident edge lies over the face.

    Returns the new number of contacts.
    """
    i, edge, j, other = pair.i, pair.edge, pair.j, pair.other
    face = outlines.corner[i, edge]
    nx, ny, x0, y0 = face.normal_x, face.normal_y, face.x, face.y
    tx, ty = -ny, nx
    end = following(edge, outlines.polygon[i].count)
    next_corner = outlines.corner[i, end]
    length = tx * (next_corner.x - x0) + ty * (next_corner.y - y0)
    other_end = following(other, outlines.polygon[j].count)
    # along the face, the incident edge runs from its end (s1) to its start (s2)
    one, two = outlines.corner[j, other_end], outlines.corner[j, other]
    s1 = tx * (one.x + window.shift_x - x0) + ty * (one.y + window.shift_y - y0)
    s2 = tx * (two.x + window.shift_x - x0) + ty * (two.y + window.shift_y - y0)
    g1 = nx * (one.x - x0) + ny * (one.y - y0)
    g2 = nx * (two.x - x0) + ny * (two.y - y0)
    # a corner of j that also touches the adjacent edge of a notch may lie slightly beyond the face
    start = -window.margin if face.reentrant else -window.beside
    stop = length + window.margin if next_corner.reentrant else length + window.beside
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
        if gap > window.reach:
            continue
        if which == 0:
            own_corner = s1 < start
            corner, other_corner = edge, other_end
        else:
            own_corner = s2 > stop
            corner, other_corner = end, other
        if own_corner:  # a corner of i meets the incident edge
            k = add_corner(bodies, outlines, contacts, k, pair, i, corner, gap)
        else:
            k = add_corner(bodies, outlines, contacts, k, pair, j, other_corner, gap)
    return k


@kernel
def edges_in_line(outlines: Outlines, i: int, edge: int, way: int) -> int:
    """Return the number of edges of polygon i that continue `edge` in a straight line.

    They follow the edge if `way` is 1 and precede it if `way` is -1. A side with corners within it
    consists of several such edges.
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
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, pair: EdgePair, window: Window
) -> int:
    """Add the contacts of all edges collinear with the face and with the incident edge.

    Each edge collinear with the face is clipped against each edge collinear with the incident edge,
    so that two bodies are in contact along their whole common length. Returns the new number of
    contacts, or -1 if they do not fit.
    """
    a, b, i, edge, j, other = pair
    first, n, m = k, outlines.polygon[i].count, outlines.polygon[j].count
    face_low, face_high = edges_in_line(outlines, i, edge, -1), edges_in_line(outlines, i, edge, 1)
    low, high = edges_in_line(outlines, j, other, -1), edges_in_line(outlines, j, other, 1)
    alone = face_low + face_high + low + high == 0
    for at in range(edge - face_low, edge + face_high + 1):
        for against in range(other - low, other + high + 1):
            if k + 2 > len(contacts):
                return -1
            edges = EdgePair(a, b, i, (at + n) % n, j, (against + m) % m)
            found = clip_contacts(bodies, outlines, contacts, k, edges, window)
            if alone:
                return found
            for new in range(k, found):
                k = keep_nearest(contacts, first, k, new)
    return k


@inlined
def add_corner(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, pair: EdgePair, owner: int,
    corner: int, gap: float,
) -> int:  # fmt: skip
    """Add the contact of a corner of polygon `owner` with the contact face.

    Its key is that of the corner of the body, so that parts share accumulated forces. A flush
    corner has no contact.
    """
    if outlines.corner[owner, corner].flush:
        return k
    a, b, i, edge = pair.a, pair.b, pair.i, pair.edge
    sign = 1.0 if outlines.polygon[i].body == b else -1.0  # the normal points to a
    body = outlines.polygon[owner].body
    own, face = outlines.corner[owner, corner], outlines.corner[i, edge]
    key = body * outlines.corner.shape[1] + own.number
    c = contacts[k]
    write_parties(c, a, b, key, 1 if body == a else 0, bodies[b].surface)
    write_geometry(c, own.x, own.y, sign * face.normal_x, sign * face.normal_y, gap, own.x)
    return k + 1


@inlined
def approach_of(bodies: Bodies, a: int, b: int, p: Parameters) -> Approach:
    """Return the motion of body b relative to body a over the step."""
    dt = p.dt
    one, two = bodies[a], bodies[b]
    dx, dy = -one.vx * dt, -one.vy * dt
    path, fall = one.path, p.gravity * dt * dt
    if two.status == AWAKE:
        dx += two.vx * dt
        dy += two.vy * dt
        path += two.path
        fall = 0.0
    # both bodies rotate about their centroids
    other = two.omega if two.status == AWAKE else 0.0
    return Approach(
        dx, dy, (other * two.y - one.omega * one.y) * dt, (one.omega * one.x - other * two.x) * dt,
        (other - one.omega) * dt, path + fall + p.margin, p.margin,
    )  # fmt: skip


@inlined
def collide_pair(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int, p: Parameters
) -> int:
    """Add the contacts of bodies a and b from entry k on; return the new number, or -1."""
    one, two = bodies[a], bodies[b]
    approach = approach_of(bodies, a, b, p)
    beside = 0.5 * p.dt * (abs(one.omega) * one.radius + abs(two.omega) * two.radius)
    if one.parts == 1 and two.parts == 1:
        return collide_parts(
            bodies, outlines, contacts, k, one.part, two.part, approach, 0.0, beside
        )
    first = k
    k = collide_all_parts(bodies, outlines, contacts, k, a, b, approach, 0.0, beside)
    if k == first:  # the parts overlap beyond an inner edge: search among real edges
        still = Approach(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, p.margin)
        k = collide_all_parts(bodies, outlines, contacts, k, a, b, still, 1e300, 0.0)
    return k


@kernel
def collide_all_parts(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, a: int, b: int,
    approach: Approach, sunk: float, beside: float,
) -> int:  # fmt: skip
    """Add the contacts of all pairs of convex parts of a and b; -1 if they do not fit."""
    first, one, two = k, bodies[a], bodies[b]
    for i in range(one.part, one.part + one.parts):
        for j in range(two.part, two.part + two.parts):
            if k + 2 > len(contacts):
                return -1
            found = collide_parts(bodies, outlines, contacts, k, i, j, approach, sunk, beside)
            if found < 0:
                return -1
            for new in range(k, found):
                k = keep_nearest(contacts, first, k, new)
    return k


@kernel
def keep_nearest(contacts: Contacts, first: int, k: int, new: int) -> int:
    """Keep the nearer of contact `new` and an equal one among first:k; return the new number.

    Contacts are equal if they have the same corner and the same face. Parts that share a corner, or
    a face that ends at a cut, find such contacts. A contact without an equal one moves to entry k.
    """
    place, c = k, contacts[new]
    for m in range(first, k):
        other = contacts[m]
        same = other.key == c.key and other.owner == c.owner
        if same and other.nx * c.nx + other.ny * c.ny > SAME_FACE:
            if other.gap <= c.gap:
                return k
            place = m
    copy_geometry(contacts[place], c)
    return max(k, place + 1)


@inlined
def collide_parts(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, i: int, j: int,
    approach: Approach, sunk: float, beside: float,
) -> int:  # fmt: skip
    """Add the contacts of polygon i of one body with polygon j of another; return the new number.

    `approach` is the motion of the second body relative to the first, `sunk` is explained in
    `face_of_contact`, and `beside` is half of the distance by which both may rotate [m].
    """
    a, b = outlines.polygon[i].body, outlines.polygon[j].body
    dx, dy, margin = approach.dx, approach.dy, approach.margin
    # a moving body may be deflected by others before they meet
    square = math.inf if bodies[b].status == AWAKE else SQUARE * math.sqrt(dx * dx + dy * dy)
    possible, time_i, gap_i, apart_i, edge_i = face_of_contact(
        outlines, i, j, approach, sunk, square
    )
    if not possible:
        return k
    possible, time_j, gap_j, apart_j, edge_j = face_of_contact(
        outlines, j, i, reverse(approach), sunk, square
    )
    if not possible:
        return k
    # in a near tie keep the face of a, so that parallel faces do not alternate
    of_j = time_j > time_i or (time_j == time_i and gap_j > gap_i + TOUCH * margin)
    reach = (dx * dx + dy * dy) ** 0.5 + approach.spread
    touching = max(apart_i, apart_j) <= margin
    # use the time of touching instead of that of exceeding the margin
    time_i = touch_time(gap_i, time_i, square, margin)
    time_j = touch_time(gap_j, time_j, square, margin)
    beside = 0.0 if touching else beside
    # where two corners meet, the better face may miss the other body while the second one does
    # not; and a body that is beside the face at the time of entry may be over it now
    for _ in range(2):
        face, edge, other = (j, edge_j, i) if of_j else (i, edge_i, j)
        facing = incident_edge(outlines, face, edge, other, outlines.polygon[other].count)
        if outlines.corner[face, edge].inner or outlines.corner[other, facing].inner:
            return k
        shift = -min(time_j, 1.0) if of_j else min(time_i, 1.0)
        pair = EdgePair(a, b, face, edge, other, facing)
        window = Window(dx * shift, dy * shift, reach, margin, beside)
        found = clip_lines(bodies, outlines, contacts, k, pair, window)
        if found != k or (shift == 0.0 and not touching):
            return found
        if touching:
            of_j = not of_j
        else:
            time_i = time_j = 0.0
    face, edge, other = (j, edge_j, i) if of_j else (i, edge_i, j)
    return add_deepest(bodies, outlines, contacts, k, EdgePair(a, b, face, edge, other, 0))


@kernel
def add_deepest(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, k: int, pair: EdgePair
) -> int:
    """Add the contact of the nearest corner of the other polygon with the line of the face.

    This serves bodies that touch although the face does not extend over the corner: with nearly
    parallel successive edges, rounding decides which of them is the face.
    """
    face, n = outlines.corner[pair.i, pair.edge], outlines.polygon[pair.j].count
    gap, corner = axis_gap(face.normal_x, face.normal_y, face.x, face.y, outlines.corner, pair.j, n)
    return add_corner(bodies, outlines, contacts, k, pair, pair.j, corner, gap)
