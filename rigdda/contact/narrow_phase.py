"""Contacts between two convex polygons over a step.

Separating axes with time of entry: of the axes that separate the polygons now, the one that they
stop separating last is the face of contact. An axis that separates them over the whole step rules
the contact out, so a fast block cannot pass a thin wall.
"""

from __future__ import annotations

from rigdda.constants import AWAKE, SAME_FACE
from rigdda.kernel import kernel
from rigdda.records import Bodies, Contacts, Floats, Outlines, Parameters


@kernel
def axis_gap(
    nx: float, ny: float, x0: float, y0: float, corner_x: Floats, corner_y: Floats, j: int, n: int
) -> tuple[float, int]:
    """Return the least gap of the n corners of body j above a line, and the corner."""
    least, corner = 1e300, 0
    for k in range(n):
        gap = nx * (corner_x[j, k] - x0) + ny * (corner_y[j, k] - y0)
        if gap < least:
            least, corner = gap, k
    return least, corner


@kernel
def face_of_contact(
    outlines: Outlines, i: int, edges: int, j: int, corners: int, dx: float, dy: float,
    spread: float, slack: float,
) -> tuple[bool, float, float, int]:  # fmt: skip
    """Return whether the edges of i leave a contact with j possible, and the best edge.

    (dx, dy) is the displacement of j relative to i over the step, `spread` what rotation adds.
    The best edge comes with its rank: time of entry, and its gap for the shallow ones.
    """
    time, depth, best, nearest = -1.0, -1e300, -1, -1
    corner_x, corner_y = outlines.world_x, outlines.world_y
    for edge in range(edges):
        nx, ny = outlines.normal_x[i, edge], outlines.normal_y[i, edge]
        gap, corner = axis_gap(
            nx, ny, corner_x[i, edge], corner_y[i, edge], corner_x, corner_y, j, corners
        )
        approach = -(nx * dx + ny * dy)
        if gap > max(approach, 0.0) + spread:
            return False, time, depth, edge
        entry = 0.0
        if gap > slack:
            entry = 2.0 if approach <= 0.0 else min(gap / approach, 2.0)
        if entry > time or (entry == time and gap > depth):
            time, depth, best, nearest = entry, gap, edge, corner
    return True, time, depth, edge_over_corner(outlines, i, best, edges, j, nearest)


@kernel
def edge_over_corner(outlines: Outlines, i: int, edge: int, edges: int, j: int, corner: int) -> int:
    """Return the edge of i, nearly in line with `edge`, that lies over a corner of j.

    Of edges in one line rounding alone decides which is the best face.
    """
    nx, ny = outlines.normal_x[i, edge], outlines.normal_y[i, edge]
    x, y = outlines.world_x[j, corner], outlines.world_y[j, corner]
    for _ in range(edges):
        end = edge + 1 if edge + 1 < edges else 0
        beyond_end = ny * (outlines.world_x[i, end] - x) > nx * (outlines.world_y[i, end] - y)
        before_start = ny * (outlines.world_x[i, edge] - x) < nx * (outlines.world_y[i, edge] - y)
        step = (1 if beyond_end else 0) - (1 if before_start else 0)
        near = (edge + step) % edges
        dot = nx * outlines.normal_x[i, near] + ny * outlines.normal_y[i, near]
        if step == 0 or dot < SAME_FACE:
            break
        edge = near
    return edge


@kernel
def incident_edge(outlines: Outlines, i: int, edge: int, j: int, n: int) -> int:
    """Return the edge of j at its nearest corner that faces edge `edge` of i most squarely."""
    nx, ny = outlines.normal_x[i, edge], outlines.normal_y[i, edge]
    _, corner = axis_gap(nx, ny, 0.0, 0.0, outlines.world_x, outlines.world_y, j, n)
    before = corner - 1 if corner > 0 else n - 1
    dot_at = nx * outlines.normal_x[j, corner] + ny * outlines.normal_y[j, corner]
    dot_before = nx * outlines.normal_x[j, before] + ny * outlines.normal_y[j, before]
    return corner if dot_at < dot_before else before


@kernel
def add_contact(
    c: Contacts, k: int, a: int, b: int, key: int, owner: int, other: int,
    x: float, y: float, nx: float, ny: float, gap: float,
) -> None:  # fmt: skip
    """Write the geometry of contact k."""
    c[k].a, c[k].b, c[k].key, c[k].owner, c[k].other = a, b, key, owner, other
    c[k].x, c[k].y, c[k].nx, c[k].ny, c[k].gap = x, y, nx, ny, gap


@kernel
def clip_contacts(
    bodies: Bodies, outlines: Outlines, c: Contacts, k: int, a: int, b: int, swapped: bool,
    edge: int, shift_x: float, shift_y: float, reach: float,
) -> int:  # fmt: skip
    """Add up to two contacts where the incident edge lies over the face of contact.

    The face belongs to body a, or to b if `swapped`. (shift_x, shift_y) moves the other body to
    where it is at the time of entry. Returns the new number of contacts.
    """
    i, j = (b, a) if swapped else (a, b)
    other = incident_edge(outlines, i, edge, j, bodies[j].count)
    nx, ny = outlines.normal_x[i, edge], outlines.normal_y[i, edge]
    tx, ty = -ny, nx
    x0, y0 = outlines.world_x[i, edge], outlines.world_y[i, edge]
    end = edge + 1 if edge + 1 < bodies[i].count else 0
    length = tx * (outlines.world_x[i, end] - x0) + ty * (outlines.world_y[i, end] - y0)
    other_end = other + 1 if other + 1 < bodies[j].count else 0
    # along the face, the incident edge runs from its end (s1) to its start (s2)
    x1, y1 = outlines.world_x[j, other_end], outlines.world_y[j, other_end]
    x2, y2 = outlines.world_x[j, other], outlines.world_y[j, other]
    s1 = tx * (x1 + shift_x - x0) + ty * (y1 + shift_y - y0)
    s2 = tx * (x2 + shift_x - x0) + ty * (y2 + shift_y - y0)
    g1, g2 = nx * (x1 - x0) + ny * (y1 - y0), nx * (x2 - x0) + ny * (y2 - y0)
    low, high = max(s1, 0.0), min(s2, length)
    if high < low:
        return k
    sign = 1.0 if swapped else -1.0  # the normal points to a
    size = outlines.world_x.shape[1]
    slope = (g2 - g1) / (s2 - s1) if s2 > s1 else 0.0
    for which in range(2):
        s = low if which == 0 else high
        if which == 1 and high - low < 1e-9 * length:
            break
        gap = g1 + slope * (s - s1)
        if gap > reach:
            continue
        if which == 0:
            own_corner = s1 < 0.0
            corner, other_corner = edge, other_end
        else:
            own_corner = s2 > length
            corner, other_corner = end, other
        if own_corner:  # a corner of i on the incident edge
            owner_body, vertex = i, corner
        else:
            owner_body, vertex = j, other_corner
        key = owner_body * size + vertex
        add_contact(
            c, k, a, b, key, 1 if owner_body == a else 0, bodies[b].surface,
            outlines.world_x[owner_body, vertex], outlines.world_y[owner_body, vertex],
            sign * nx, sign * ny, gap,
        )  # fmt: skip
        k += 1
    return k


@kernel
def collide_pair(
    bodies: Bodies, outlines: Outlines, c: Contacts, k: int, a: int, b: int, p: Parameters
) -> int:
    """Add the contacts of bodies a and b to `c` from entry k; returns the new number."""
    dt = p.dt
    ax, ay, aw = bodies[a].vx, bodies[a].vy, abs(bodies[a].omega) * bodies[a].radius
    dx, dy, spin = -ax * dt, -ay * dt, aw * dt
    fall = p.gravity * dt * dt
    if bodies[b].status == AWAKE:
        dx += bodies[b].vx * dt
        dy += bodies[b].vy * dt
        spin += abs(bodies[b].omega) * bodies[b].radius * dt
        fall = 0.0
    spread = spin + fall + p.slack
    na, nb = bodies[a].count, bodies[b].count
    possible, time_a, gap_a, edge_a = face_of_contact(
        outlines, a, na, b, nb, dx, dy, spread, p.slack
    )
    if not possible:
        return k
    possible, time_b, gap_b, edge_b = face_of_contact(
        outlines, b, nb, a, na, -dx, -dy, spread, p.slack
    )
    if not possible:
        return k
    # near a tie keep the face of a, so that parallel faces do not alternate
    swapped = time_b > time_a or (time_b == time_a and gap_b > gap_a + 0.02 * p.slack)
    reach = (dx * dx + dy * dy) ** 0.5 + spread
    # corner beside corner, the better face may miss the other body where the second one does not
    for face in range(2):
        of_b = swapped if face == 0 else not swapped
        edge, time = (edge_b, time_b) if of_b else (edge_a, time_a)
        shift = min(time, 1.0) if not of_b else -min(time, 1.0)
        found = clip_contacts(
            bodies, outlines, c, k, a, b, of_b, edge, dx * shift, dy * shift, reach
        )
        if found > k or max(gap_a, gap_b) > p.slack:
            return found
    return deepest_corner(bodies, outlines, c, k, a, b, swapped, edge_b if swapped else edge_a)


@kernel
def deepest_corner(
    bodies: Bodies, outlines: Outlines, c: Contacts, k: int, a: int, b: int, swapped: bool,
    edge: int,
) -> int:  # fmt: skip
    """Add the contact of the nearest corner of one body with the line of a face of the other.

    For bodies that touch although the face does not reach over the corner: nearly parallel edges
    in a row, where rounding decides which of them is the face.
    """
    i, j = (b, a) if swapped else (a, b)
    nx, ny = outlines.normal_x[i, edge], outlines.normal_y[i, edge]
    x0, y0 = outlines.world_x[i, edge], outlines.world_y[i, edge]
    gap, corner = axis_gap(nx, ny, x0, y0, outlines.world_x, outlines.world_y, j, bodies[j].count)
    sign = 1.0 if swapped else -1.0
    add_contact(
        c, k, a, b, j * outlines.world_x.shape[1] + corner, 1 if j == a else 0, bodies[b].surface,
        outlines.world_x[j, corner], outlines.world_y[j, corner], sign * nx, sign * ny, gap,
    )  # fmt: skip
    return k + 1
