"""The contact face of two convex polygons over a step, by separating axes with time of entry.

Of the axes that currently separate the polygons, the contact face is the one that stops separating
them last. If the separation along an axis exceeds the length of both paths in this step, there is
no contact. Therefore a fast block cannot pass through a thin wall, and a block that a third one
deflects within the step cannot be driven into a neighbour.

A face that touches the other polygon and is not approached by it separates them for the whole step.
A block that slides along it is therefore not stopped by the side of the next body whose face is
flush with it.
"""

from __future__ import annotations

from typing import NamedTuple

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.constants import SAME_FACE
from rigdda.dynamics.records import Corners
from rigdda.kernel import inlined, kernel, variable

TOUCH = 2e-3
"""Distance over the margin at which a face is entered in an impact [-]. It exceeds zero so that a
more oblique face is entered earlier, and an edge is hit rather than the corner at its end."""

SQUARE = 0.2
"""Ratio of the approach normal to a face to the total relative displacement, above which the face
is hit rather than grazed [-]."""

NEVER = 1e3
"""Time of entry, over the step, assigned to a face that is approached too slowly to be entered
[-]."""


class Approach(NamedTuple):
    """Relative motion of two bodies over the step, if nothing deflects them."""

    dx: float  # displacement of one body relative to the other [m]
    dy: float
    px: float  # rotation adds (px - turn y, py + turn x) to it at (x, y) [m]
    py: float
    turn: float  # [rad]
    spread: float  # bound on the approach of any of their points, even if deflected [m]
    margin: float  # distance of contact candidates [m]


@kernel
def reverse(approach: Approach) -> Approach:
    """Return the relative motion with the bodies exchanged."""
    dx, dy, px, py, turn, spread, margin = approach
    return Approach(-dx, -dy, -px, -py, -turn, spread, margin)


@kernel
def following(corner: int, corners: int) -> int:
    """Return the next corner, anticlockwise."""
    return corner + 1 if corner + 1 < corners else 0


@kernel
def axis_gap(
    nx: float, ny: float, x0: float, y0: float, corners: Corners, j: int, n: int
) -> tuple[float, int]:
    """Return the least gap of the n corners of polygon j above a line [m], and its corner."""
    least, corner = 1e300, 0
    for k in range(n):
        own = corners[j, k]
        gap = nx * (own.x - x0) + ny * (own.y - y0)
        if gap < least:
            least, corner = gap, k
    return least, corner


@kernel
def over_edge(outlines: Outlines, i: int, edge: int, j: int) -> float:
    """Return the gap of the mean corner of polygon j above an edge of polygon i [m]."""
    other, own = outlines.polygon[j], outlines.corner[i, edge]
    dx, dy = other.middle_x - own.x, other.middle_y - own.y
    return own.normal_x * dx + own.normal_y * dy


@kernel
def facing_edge(outlines: Outlines, i: int, edges: int, j: int) -> int:
    """Return the edge of polygon i above which the mean corner of polygon j is highest."""
    facing, most = 0, -1e300
    for edge in range(edges):
        gap = over_edge(outlines, i, edge, j)
        if gap > most:
            facing, most = edge, gap
    return facing


@inlined
def face_of_contact(
    outlines: Outlines, i: int, j: int, approach: Approach, sunk: float, square: float
) -> tuple[bool, float, float, float, int]:
    """Return whether the edges of i permit a contact with j, and the best edge.

    The result is (possible, time, gap, apart, edge): the time of entry of the best edge over the
    step, its current gap, and the greatest gap of any edge that was examined [m]. If `possible` is
    False, the other values are meaningless.

    `approach` is the motion of j relative to i. Edges inside the body count as deeper by `sunk`
    [m], so that a real edge wins a tie.

    A face is hit if it is approached by more than `square` [m]; it is entered when the nearest
    corner meets it. A face that is touching or grazed is entered when the corner is deeper than the
    margin; of two such faces, the one approached more slowly is the best. The approach of a
    touching face is that of the corner that touches it, because the centre of a rolling block
    descends while its point of contact does not.

    The edge above which the mean corner of j is highest is examined first, because it usually is
    the best one or rules out a contact. Another edge is examined only if the inscribed circle of j
    permits that it is better.
    """
    dx, dy, px, py, turn, spread, margin = approach
    edges, corners = outlines.polygon[i].count, outlines.polygon[j].count
    time, depth, best, nearest, apart = -1.0, -1e300, variable(-1), variable(-1), -1e300
    facing = facing_edge(outlines, i, edges, j)
    for visit in range(-1, edges):
        edge = facing if visit < 0 else visit
        own = outlines.corner[i, edge]
        nx, ny = own.normal_x, own.normal_y
        if visit >= 0:
            most = over_edge(outlines, i, edge, j) - outlines.polygon[j].inside
            if edge == facing or (most < -margin and (time > 0.0 or most < depth)):
                continue
        gap, corner = axis_gap(nx, ny, own.x, own.y, outlines.corner, j, corners)
        if gap > spread:
            return False, time, depth, apart, edge
        if sunk > 0.0 and own.inner:
            gap -= sunk
        apart = max(apart, gap)
        entry = 0.0
        if gap >= -margin:
            ux, uy = dx, dy
            if gap <= margin:
                ux -= turn * outlines.corner[j, corner].y - px
                uy += turn * outlines.corner[j, corner].x + py
            closing = -(nx * ux + ny * uy)
            late = gap + margin >= NEVER * closing
            struck = gap > 2.0 * TOUCH * margin and closing > square
            entry = NEVER if late else (gap + (-TOUCH if struck else 1.0) * margin) / closing
        later = entry > time or (entry == time and gap > depth)
        if later or (entry == time and gap == depth and edge < best):
            time, depth, best, nearest = entry, gap, edge, corner
    over = outlines.corner[j, nearest]
    return True, time, depth, apart, edge_over_point(outlines, i, best, edges, over.x, over.y)


@kernel
def touch_time(gap: float, time: float, square: float, margin: float) -> float:
    """Return the time, over the step, at which a face entered at `time` is touched; 0 if now."""
    near = TOUCH * margin
    if gap <= 2.0 * near or time <= 0.0:
        return 0.0
    if gap - near > square * time:  # the face is hit
        return time * gap / (gap - near)
    return time * gap / (gap + margin) if gap > margin else 0.0


@kernel
def edge_over_point(outlines: Outlines, i: int, edge: int, edges: int, x: float, y: float) -> int:
    """Return the edge of i, nearly collinear with `edge`, that lies over a point.

    Among collinear edges, rounding alone decides which one is the best face.
    """
    nx, ny = outlines.corner[i, edge].normal_x, outlines.corner[i, edge].normal_y
    for _ in range(edges):
        start, end = outlines.corner[i, edge], outlines.corner[i, following(edge, edges)]
        beyond_end = ny * (end.x - x) > nx * (end.y - y)
        before_start = ny * (start.x - x) < nx * (start.y - y)
        step = (1 if beyond_end else 0) - (1 if before_start else 0)
        near = (edge + step) % edges
        other = outlines.corner[i, near]
        dot = nx * other.normal_x + ny * other.normal_y
        if step == 0 or dot < SAME_FACE or other.inner:
            break
        edge = near
    return edge


@kernel
def incident_edge(outlines: Outlines, i: int, edge: int, j: int, n: int) -> int:
    """Return the edge at the nearest corner of j that faces edge `edge` of i most squarely."""
    face = outlines.corner[i, edge]
    nx, ny = face.normal_x, face.normal_y
    _, corner = axis_gap(nx, ny, 0.0, 0.0, outlines.corner, j, n)
    before = corner - 1 if corner > 0 else n - 1
    after, ahead = outlines.corner[j, corner], outlines.corner[j, before]
    dot_after = nx * after.normal_x + ny * after.normal_y
    dot_ahead = nx * ahead.normal_x + ny * ahead.normal_y
    return corner if dot_after < dot_ahead else before
