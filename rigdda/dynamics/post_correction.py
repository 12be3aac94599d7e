"""Post-correction of rotation: positions of corners and edges from the exact displacement.

This is equation 1 of the paper.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.contact.separating_axes import following, over_edge
from rigdda.dynamics.records import Bodies, Body
from rigdda.kernel import inlined, kernel


@inlined
def place_corners(bodies: Bodies, outlines: Outlines, i: int) -> None:
    """Set the corners and edge normals of body i and of its parts from its centroid and angle.

    This is the exact displacement function (equation 1), the post-correction of the linear one in
    the solve. The corners follow from the angle and the body coordinates, so the area is conserved
    exactly.
    """
    body = bodies[i]
    cos, sin = math.cos(body.theta), math.sin(body.theta)
    for place in range(polygons(body)):
        row = polygon_row(body, i, place)
        for k in range(outlines.polygon[row].count):
            own, local = outlines.corner[row, k], outlines.local[row, k]
            own.x = body.x + cos * local.x - sin * local.y
            own.y = body.y + sin * local.x + cos * local.y
            own.normal_x = cos * local.normal_x - sin * local.normal_y
            own.normal_y = sin * local.normal_x + cos * local.normal_y
        set_extent(outlines, row)


@kernel
def set_body_coordinates(bodies: Bodies, outlines: Outlines, i: int) -> None:
    """Set the edge normals of body i in body coordinates from its corners, then its current state.

    The radius of the inscribed circle of each polygon is set as well.
    """
    body = bodies[i]
    for place in range(polygons(body)):
        row = polygon_row(body, i, place)
        n = outlines.polygon[row].count
        for k in range(n):
            own, end = outlines.local[row, k], outlines.local[row, following(k, n)]
            own.normal_x, own.normal_y = normal_of(end.x - own.x, end.y - own.y)
    place_corners(bodies, outlines, i)
    for place in range(polygons(body)):
        set_inside(outlines, polygon_row(body, i, place))


@kernel
def polygons(body: Body) -> int:
    """Return the number of polygons of a body: its outline, and its parts if it has several."""
    return 1 + body.parts if body.parts > 1 else 1


@kernel
def polygon_row(body: Body, i: int, place: int) -> int:
    """Return the row in the outlines of a polygon of body i."""
    return i if place == 0 else body.part + place - 1


@kernel
def normal_of(ex: float, ey: float) -> tuple[float, float]:
    """Return the outward unit normal of an edge of an anticlockwise outline."""
    length = math.sqrt(ex * ex + ey * ey)
    return ey / length, -ex / length


@inlined
def set_extent(outlines: Outlines, row: int) -> None:
    """Set the mean corner and the extent of a polygon from its corners."""
    polygon, n, sum_x, sum_y = outlines.polygon[row], outlines.polygon[row].count, 0.0, 0.0
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    for k in range(n):
        own = outlines.corner[row, k]
        sum_x += own.x
        sum_y += own.y
        low_x, high_x = min(low_x, own.x), max(high_x, own.x)
        low_y, high_y = min(low_y, own.y), max(high_y, own.y)
    polygon.middle_x, polygon.middle_y = sum_x / n, sum_y / n
    polygon.low_x, polygon.high_x, polygon.low_y, polygon.high_y = low_x, high_x, low_y, high_y


@kernel
def set_inside(outlines: Outlines, row: int) -> None:
    """Set the radius of the circle about the mean corner that touches the nearest edge."""
    inside = math.inf
    for k in range(outlines.polygon[row].count):
        inside = min(inside, -over_edge(outlines, row, k, row))
    outlines.polygon[row].inside = (1.0 - 1e-9) * inside  # rounding must not exclude a face


@kernel
def place_edges(outlines: Outlines, row: int) -> None:
    """Set all properties that depend on the corners of a polygon whose shape has changed."""
    n = outlines.polygon[row].count
    for k in range(n):
        own, end = outlines.corner[row, k], outlines.corner[row, following(k, n)]
        own.normal_x, own.normal_y = normal_of(end.x - own.x, end.y - own.y)
    set_extent(outlines, row)
    set_inside(outlines, row)


@kernel
def move_corners(
    bodies: Bodies, outlines: Outlines, i: int, before: tuple[float, float, float]
) -> None:
    """Move the corners of body i by the linear displacement function (equation 2) alone.

    This is the alternative to post-correction: body i expands as it rotates. `before` holds the
    previous angle, x and y of the body.
    """
    body = bodies[i]
    u, v, r = body.x - before[1], body.y - before[2], body.theta - before[0]
    body.radius = 0.0
    for place in range(polygons(body)):
        row = polygon_row(body, i, place)
        for k in range(outlines.polygon[row].count):
            own = outlines.corner[row, k]
            x, y = own.x - before[1], own.y - before[2]
            own.x += u - y * r
            own.y += v + x * r
            body.radius = max(body.radius, math.hypot(x - y * r, y + x * r))
        place_edges(outlines, row)
