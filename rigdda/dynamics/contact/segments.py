"""Points over, along and under segments of the terrain."""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Ground
from rigdda.kernel import kernel


@kernel
def below_segment(ground: Ground, s: int, x: float, y: float) -> float:
    """Return the gap of a point over the line of segment s [m]: < 0 in the ground."""
    one = ground.segment[s]
    return one.normal_x * (x - one.x) + one.normal_y * (y - one.y)


@kernel
def along_segment(ground: Ground, s: int, x: float, y: float) -> float:
    """Return how far along segment s a point lies [m]."""
    one = ground.segment[s]
    return one.normal_y * (x - one.x) - one.normal_x * (y - one.y)


@kernel
def over_segment(ground: Ground, s: int, x: float, y: float, depth: float) -> bool:
    """Return whether a point lies over segment s, lengthened by what `depth` needs at its ends."""
    along, one = along_segment(ground, s, x, y), ground.segment[s]
    turn_end = ground.segment[s + 1].turn
    # beyond a concave corner, as far as what is so deep is nearer to this segment than to the next
    if along < 0.0 and one.turn > 0.0:
        return -along <= depth * math.tan(0.5 * one.turn)
    if along > one.length and turn_end > 0.0:
        return along - one.length <= depth * math.tan(0.5 * turn_end)
    return -1e-9 <= along <= one.length + 1e-9


@kernel
def shadowed(ground: Ground, s: int, x: float, y: float, gap: float) -> bool:
    """Return whether a point under segment s is less deep under a convex neighbour."""
    if gap >= 0.0:
        return False
    if ground.segment[s].turn < 0.0 and below_segment(ground, s - 1, x, y) > gap:
        return True
    return ground.segment[s + 1].turn < 0.0 and below_segment(ground, s + 1, x, y) > gap


@kernel
def crosses_segment(ground: Ground, s: int, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Return whether the line from (x0, y0) to (x1, y1) crosses segment s."""
    g0, g1 = below_segment(ground, s, x0, y0), below_segment(ground, s, x1, y1)
    if g0 * g1 >= 0.0:
        return False
    x, y = x0 + g0 / (g0 - g1) * (x1 - x0), y0 + g0 / (g0 - g1) * (y1 - y0)
    return 0.0 < along_segment(ground, s, x, y) < ground.segment[s].length


@kernel
def along_neighbour(
    ground: Ground, s: int, x: float, y: float, dx: float, dy: float
) -> tuple[float, float]:
    """Return the displacement of a point less what would take it into segment s, if it is over it.

    It slides along that segment.
    """
    one, gap = ground.segment[s], below_segment(ground, s, x, y)
    sunk = min(gap, 0.0) - gap - (one.normal_x * dx + one.normal_y * dy)
    if sunk <= 0.0 or not over_segment(ground, s, x, y, max(-gap, 0.0)):
        return dx, dy
    return dx + sunk * one.normal_x, dy + sunk * one.normal_y
