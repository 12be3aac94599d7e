"""Contacts of a block with the terrain over a step.

Corners of the block are tested against segments, and convex corners of the terrain against edges of
the convex parts of the block. At concave corners, segments are extended into the ground; otherwise
blocks would fall through there.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import GroundArrays, Outlines
from rigdda.dynamics.constants import SAME_FACE, TERRAIN
from rigdda.dynamics.contact.narrow_phase import (
    keep_nearest,
    write_geometry,
    write_parties,
)
from rigdda.dynamics.contact.separating_axes import edge_over_point, following
from rigdda.dynamics.motion import impact_speed
from rigdda.dynamics.records import Bodies, Box, Contacts, Parameters
from rigdda.kernel import inlined, kernel, variable


@kernel
def below_segment(ground: GroundArrays, s: int, x: float, y: float) -> float:
    """Return the gap of a point above the line of segment s [m], negative in the ground."""
    one = ground.segment[s]
    return one.normal_x * (x - one.x) + one.normal_y * (y - one.y)


@kernel
def along_segment(ground: GroundArrays, s: int, x: float, y: float) -> float:
    """Return the distance of a point along segment s [m]."""
    one = ground.segment[s]
    return one.normal_y * (x - one.x) - one.normal_x * (y - one.y)


@kernel
def over_segment(ground: GroundArrays, s: int, x: float, y: float, depth: float) -> bool:
    """Return whether a point lies over segment s, extended at its ends as `depth` requires."""
    along, one = along_segment(ground, s, x, y), ground.segment[s]
    turn_end = ground.segment[s + 1].turn
    # beyond a concave corner, count a point at this depth if this segment is nearer than the next
    if along < 0.0 and one.turn > 0.0:
        return -along <= depth * math.tan(0.5 * one.turn)
    if along > one.length and turn_end > 0.0:
        return along - one.length <= depth * math.tan(0.5 * turn_end)
    return -1e-9 <= along <= one.length + 1e-9


@kernel
def shadowed(ground: GroundArrays, s: int, x: float, y: float, gap: float) -> bool:
    """Return whether a point under segment s is less deep under a convex neighbour."""
    if gap >= 0.0:
        return False
    if ground.segment[s].turn < 0.0 and below_segment(ground, s - 1, x, y) > gap:
        return True
    return ground.segment[s + 1].turn < 0.0 and below_segment(ground, s + 1, x, y) > gap


@kernel
def crosses_segment(
    ground: GroundArrays, s: int, x0: float, y0: float, x1: float, y1: float
) -> bool:
    """Return whether the line from (x0, y0) to (x1, y1) crosses segment s."""
    g0, g1 = below_segment(ground, s, x0, y0), below_segment(ground, s, x1, y1)
    if g0 * g1 >= 0.0:
        return False
    x, y = x0 + g0 / (g0 - g1) * (x1 - x0), y0 + g0 / (g0 - g1) * (y1 - y0)
    return 0.0 < along_segment(ground, s, x, y) < ground.segment[s].length


@kernel
def along_neighbour(
    ground: GroundArrays, s: int, x: float, y: float, dx: float, dy: float
) -> tuple[float, float]:
    """Return the displacement of a point without the part that would take it into segment s.

    The point slides along the segment if it is over it.
    """
    one, gap = ground.segment[s], below_segment(ground, s, x, y)
    sunk = min(gap, 0.0) - gap - (one.normal_x * dx + one.normal_y * dy)
    if sunk <= 0.0 or not over_segment(ground, s, x, y, max(-gap, 0.0)):
        return dx, dy
    return dx + sunk * one.normal_x, dy + sunk * one.normal_y


SHARP = 1e-9
"""Negative cosine of the angle between two normals beyond which a ridge counts as turning by more
than 90 degrees [-]."""

NEVER = 2.0
"""Time of entry, over the step, assigned to edges that are not approached or only slowly [-]."""


@kernel
def beneath_roof(
    bodies: Bodies,
    outlines: Outlines,
    ground: GroundArrays,
    a: int,
    vertex: int,
    s: int,
    gap: float,
) -> bool:
    """Return whether a corner of block a under segment s lies in the air beneath an overhang.

    In this case another segment lies between the corner and segment s. A corner that was pushed
    right through a thin piece of ground does not count, because the block still extends through
    segment s.
    """
    x, y = outlines.corner[a, vertex].x, outlines.corner[a, vertex].y
    foot_x, foot_y = x - gap * ground.segment[s].normal_x, y - gap * ground.segment[s].normal_y
    between = False
    for other in range(len(ground.segment) - 1):
        if other != s:
            between = between or crosses_segment(ground, other, x, y, foot_x, foot_y)
    if not between:
        return False
    for part in range(bodies[a].part, bodies[a].part + bodies[a].parts):
        n, mean_x, mean_y, its = outlines.polygon[part].count, 0.0, 0.0, False
        for k in range(n):
            its = its or outlines.corner[part, k].number == vertex
            mean_x += outlines.corner[part, k].x / n
            mean_y += outlines.corner[part, k].y / n
        if its and not crosses_segment(ground, s, mean_x, mean_y, x, y):
            return True
    return False


@kernel
def place_of_hit(
    bodies: Bodies,
    ground: GroundArrays,
    s: int,
    a: int,
    x: float,
    y: float,
    gap: float,
    p: Parameters,
) -> tuple[float, float]:
    """Return the position at which a corner of block a meets the line of segment s in the step.

    This is (x, y) if the corner does not meet it, is already in the ground, or touches it without
    an impact. Before that, the corner may slide along a neighbouring segment into a concave corner.
    """
    if gap <= 0.0:
        return x, y
    one, block = ground.segment[s], bodies[a]
    dx = (block.vx - block.omega * (y - block.y)) * p.dt
    dy = (block.vy + block.omega * (x - block.x)) * p.dt
    closes = -(one.normal_x * dx + one.normal_y * dy)
    if gap <= p.penetration and closes <= p.dt * impact_speed(p):
        return x, y
    if one.turn > 0.0:
        dx, dy = along_neighbour(ground, s - 1, x, y, dx, dy)
    if ground.segment[s + 1].turn > 0.0:
        dx, dy = along_neighbour(ground, s + 1, x, y, dx, dy)
    approach = -(one.normal_x * dx + one.normal_y * dy)
    time = min(gap / approach, 1.0) if approach > 0.0 else 0.0
    return x + time * dx, y + time * dy


@kernel
def leaves_over_end(
    ground: GroundArrays, s: int, x: float, y: float, hit_x: float, hit_y: float, gap: float,
    margin: float,
) -> bool:  # fmt: skip
    """Return whether a corner at (x, y) slides off a convex end of segment s.

    The corner meets the line of the segment at (hit_x, hit_y), within `margin` [m] of that end or
    beyond it. Then an edge of the block rests on the end and slides over it, so that the corner
    moves towards the end, and rounding alone would decide whether it hits the segment that it
    leaves. A corner that descends more than it moves along the segment hits it instead.
    """
    along, hit = along_segment(ground, s, x, y), along_segment(ground, s, hit_x, hit_y)
    one = ground.segment[s]
    if abs(hit - along) <= max(gap, 0.0):
        return False
    over_start = one.turn < 0.0 and hit < along and hit < margin
    over_end = ground.segment[s + 1].turn < 0.0 and hit > along and hit > one.length - margin
    return over_start or over_end


@kernel
def meets_segment(
    ground: GroundArrays, s: int, x: float, y: float, hit_x: float, hit_y: float, gap: float,
    reach: float, margin: float,
) -> bool:  # fmt: skip
    """Return whether a corner at (x, y), which meets its line at (hit_x, hit_y), meets segment s.

    `gap` is the current gap of the corner, and `reach` the greatest distance that it may travel in
    the step [m].
    """
    if not over_segment(ground, s, hit_x, hit_y, max(-gap, 0.0) + reach):
        return False
    if shadowed(ground, s, hit_x, hit_y, gap):
        return False
    return not leaves_over_end(ground, s, x, y, hit_x, hit_y, gap, margin)


@inlined
def corners_on_segment(
    bodies: Bodies, outlines: Outlines, ground: GroundArrays, contacts: Contacts, k: int,
    first: int, a: int, s: int, p: Parameters,
) -> int:  # fmt: skip
    """Add contacts of the corners of block a with segment s; return the new number."""
    one, block = ground.segment[s], bodies[a]
    nx, ny, surface = one.normal_x, one.normal_y, one.surface
    reach = block.path + p.gravity * p.dt * p.dt + p.margin
    concave, middle = block.parts > 1, 0.5 * (one.left + one.right)
    lowest = below_segment(ground, s, block.x, block.y) - block.radius
    if lowest > reach:
        return k
    for vertex in range(block.count):
        key = a * outlines.corner.shape[1] + vertex
        corner = outlines.corner[a, vertex]
        x, y = corner.x, corner.y
        gap = below_segment(ground, s, x, y)
        if gap > reach or gap < -block.radius:
            continue
        if concave and corner.reentrant:
            continue
        hit_x, hit_y = place_of_hit(bodies, ground, s, a, x, y, gap, p)
        if not meets_segment(ground, s, x, y, hit_x, hit_y, gap, reach, p.margin):
            continue
        if gap < -p.margin and beneath_roof(bodies, outlines, ground, a, vertex, s, gap):
            continue
        again = False
        for m in range(first, k):  # the same face, divided into two segments
            c = contacts[m]
            if c.owner == 1 and c.key == key and c.nx * nx + c.ny * ny > SAME_FACE:
                again = True
                if gap < c.gap:
                    write_parties(c, a, TERRAIN, key, 1, surface)
                    write_geometry(c, x, y, nx, ny, gap, middle)
        if not again:
            write_parties(contacts[k], a, TERRAIN, key, 1, surface)
            write_geometry(contacts[k], x, y, nx, ny, gap, middle)
            k += 1
    return k


@kernel
def bridges(
    outlines: Outlines, ground: GroundArrays, part: int, edge: int, corner: int, least: float
) -> bool:
    """Return whether an edge spans a ridge, with gaps of its ends of at least `least` [m].

    Its start is on the left and its end on the right, because outlines are anticlockwise.
    """
    start = outlines.corner[part, edge]
    end = outlines.corner[part, following(edge, outlines.polygon[part].count)]
    left = below_segment(ground, corner - 1, start.x, start.y)
    return left >= least and below_segment(ground, corner, end.x, end.y) >= least


@inlined
def fitting_edge(
    outlines: Outlines, ground: GroundArrays, a: int, part: int, corner: int, dx: float, dy: float,
    lean: float, reach: float, p: Parameters,
) -> tuple[int, float]:  # fmt: skip
    """Return the edge of a part of block a that meets a convex terrain corner, or -1.

    The edge must be the last one to separate the corner from the part, or about as deep. Its normal
    must lie approximately between those of the two segments, otherwise a corner of the block is in
    contact instead.

    Parameters
    ----------
    dx, dy : float
        Motion of the corner relative to the block in the step [m].
    lean : float
        Tolerance of the directions of normals [-].
    reach : float
        Greatest gap of an edge [m].

    Returns
    -------
    edge : int
        Its number, or -1.
    time : float
        Time at which it touches the corner, in steps; NEVER if it does not.
    """
    left, right = ground.segment[corner - 1], ground.segment[corner]
    x, y = right.x, right.y
    # on a ridge that turns by more than 90 deg, a normal between both may oppose the left one
    out_x, out_y = left.normal_x, left.normal_y
    if left.normal_x * right.normal_x + left.normal_y * right.normal_y < -SHARP:
        out_x, out_y = out_x + right.normal_x, out_y + right.normal_y
    best, best_time, best_gap = variable(-1), -1.0, -1e300
    last, depth = -1.0, -1e300  # of all edges, whether they fit or not
    for edge in range(outlines.polygon[part].count):
        own = outlines.corner[part, edge]
        nx, ny = own.normal_x, own.normal_y
        gap = nx * (x - own.x) + ny * (y - own.y)
        approach = -(nx * dx + ny * dy)
        if gap > reach:
            return -1, 0.0
        inner = part != a and own.inner
        if inner and gap <= 0.0:
            continue  # push the corner out of the block, not into the next part
        time = 0.0
        if gap > p.margin:
            time = NEVER if approach <= 0.0 else min(gap / approach, NEVER)
        # the normal out of the ground is opposite to that of the edge
        after_left = left.normal_x * -ny - left.normal_y * -nx <= lean
        before_right = -nx * right.normal_y + ny * right.normal_x <= lean
        outward = nx * out_x + ny * out_y < 0.0
        fits = after_left and before_right and outward and not inner
        if fits and (time > best_time or (time == best_time and gap > best_gap)):
            best, best_time, best_gap = edge, time, gap
        if time > last or (time == last and gap > depth):
            last, depth = time, gap
    if best < 0 or best_time < last:
        return -1, 0.0
    # when a corner of the block slides over the ridge, another edge soon becomes the nearest one:
    # keep the fitting edge while the depths are similar or while it bridges the ridge
    alike = best_gap >= 2.0 * min(depth, 0.0) - p.margin
    if not alike and not bridges(outlines, ground, part, best, corner, 0.5 * best_gap):
        return -1, 0.0
    return best, best_time


@inlined
def edge_on_ridge(
    bodies: Bodies, outlines: Outlines, ground: GroundArrays, box: Box, contacts: Contacts, k: int,
    a: int, part: int, corner: int, p: Parameters,
) -> int:  # fmt: skip
    """Add the contact of a convex terrain corner with an edge of a part of block a, if any.

    Returns the new number of contacts; `fitting_edge` chooses the edge.
    """
    right, block = ground.segment[corner], bodies[a]
    x, y = right.x, right.y
    dt, n = p.dt, outlines.polygon[part].count
    dx = -(block.vx - block.omega * (y - block.y)) * dt
    dy = -(block.vy + block.omega * (x - block.x)) * dt
    if not (box.low_x <= x <= box.high_x and box.low_y <= y <= box.high_y):
        return k
    lean = abs(block.omega) * dt
    reach = block.path + p.gravity * dt * dt + p.margin
    best, best_time = fitting_edge(outlines, ground, a, part, corner, dx, dy, lean, reach, p)
    if best < 0:
        return k
    time = min(best_time, 1.0) if 0.0 < best_time < NEVER else 0.0
    hit_x, hit_y = x + time * dx, y + time * dy
    best = edge_over_point(outlines, part, best, n, hit_x, hit_y)
    start, end = outlines.corner[part, best], outlines.corner[part, following(best, n)]
    nx, ny = start.normal_x, start.normal_y
    gap = nx * (x - start.x) + ny * (y - start.y)
    ex, ey = end.x - start.x, end.y - start.y
    along = (hit_x - start.x) * ex + (hit_y - start.y) * ey
    # beyond the ends of the edge, the corner is outside the block unless it is deep
    if gap > -p.penetration and (along < 0.0 or along > ex * ex + ey * ey):
        return k
    key = len(bodies) * outlines.corner.shape[1] + corner
    write_parties(contacts[k], a, TERRAIN, key, 0, right.surface)
    write_geometry(contacts[k], x, y, -nx, -ny, gap, x)
    return k + 1


@inlined
def collide_terrain(
    bodies: Bodies, outlines: Outlines, ground: GroundArrays, box: Box, contacts: Contacts, k: int,
    a: int, p: Parameters,
) -> int:  # fmt: skip
    """Add the contacts of block a with the terrain from entry k; return the new number.

    `box` is the swept box of the block.
    """
    bins = len(ground.bin_start) - 1
    if bins == 0:
        return k
    first, block = k, bodies[a]
    low = int((box.low_x - ground.bin_origin) / ground.bin_width)
    high = int((box.high_x - ground.bin_origin) / ground.bin_width)
    low, high = min(max(low, 0), bins - 1), min(max(high, 0), bins - 1)
    for cell in range(low, high + 1):
        for item in range(ground.bin_start[cell], ground.bin_start[cell + 1]):
            s = ground.bin_item[item]
            one = ground.segment[s]
            if cell != max(one.bin, low):
                continue  # already examined in an earlier cell
            if one.left > box.high_x or one.right < box.low_x:
                continue
            if one.bottom > box.high_y or one.top < box.low_y:
                continue
            if k + outlines.corner.shape[1] + block.parts + 2 > len(contacts):
                return -1
            k = corners_on_segment(bodies, outlines, ground, contacts, k, first, a, s, p)
            if one.turn < 0.0:
                for part in range(block.part, block.part + block.parts):
                    found = edge_on_ridge(bodies, outlines, ground, box, contacts, k, a, part, s, p)
                    k = keep_nearest(contacts, first, k, k) if found > k and part != a else found
    return k
