"""Lumped-mass model: a block is a point that bounces, slides and stops on the ground.

This is the model of the first rockfall programs (the paper's introduction; Ritchie 1963; Stevens
1998): parabolic flight, normal and tangential coefficients of restitution at impacts, and friction
where the point no longer bounces. Blocks have neither shape nor rotation and do not interact.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.kernel import entry_kernel, kernel

STILL = 0.05
"""Normal speed after an impact below which a point slides instead of bouncing [m/s]. It corresponds
to a bounce of 0.1 mm."""

MOST_MOVES = 100_000
"""Maximum number of flights and slides of a trajectory."""

NEAR = 1e-9
"""Length below which distances are rounding errors [m]."""

X, Y, VX, VY = 0, 1, 2, 3
"""Columns of a start [m, m/s]."""
NORMAL, TANGENTIAL, FRICTION = 0, 1, 2
"""Columns of a segment's coefficients [-]; friction is the tangent of the angle."""
RUN_OUT, SPEED, HEIGHT = 0, 1, 2
"""Columns of the results: stopping place [m], and speed [m/s] and height above the ground [m] at
the first passage of a line, NaN without a passage."""

Floats = NDArray


@kernel
def axes(ground: Floats, s: int) -> tuple[float, float, float]:
    """Return the direction of a segment of the ground and its length [m]."""
    dx, dy = ground[s + 1, 0] - ground[s, 0], ground[s + 1, 1] - ground[s, 1]
    length = math.hypot(dx, dy)
    return dx / length, dy / length, length


@kernel
def segment_at(ground: Floats, x: float, uphill: bool) -> int:
    """Return the segment at a chainage; at a corner, the one uphill or downhill of it."""
    s = 0
    while s < len(ground) - 2 and (ground[s + 1, 0] < x or (not uphill and ground[s + 1, 0] <= x)):
        s += 1
    return s


@kernel
def time_to_line(height: float, rise: float, pull: float) -> float:
    """Return when height + rise t - pull t^2 / 2 falls to 0, inf if it does not; pull > 0.

    This is the later root, because a point may be below the line of a segment that it has not
    reached yet. On the line, with height 0 to rounding, a rising point returns to it and a falling
    point is already there.
    """
    if abs(height) <= NEAR:
        return max(2.0 * rise / pull, 0.0)
    square = rise * rise + 2.0 * pull * height
    time = (rise + math.sqrt(square)) / pull if square >= 0.0 else -1.0
    return time if time >= 0.0 else math.inf


@kernel
def fly(ground: Floats, p: Floats, s: int, g: float) -> tuple[float, int]:
    """Return the flight time of a point and the segment that it meets, -1 beyond the ends."""
    step = 1 if p[VX] >= 0.0 else -1
    while 0 <= s < len(ground) - 1:
        tx, ty, _ = axes(ground, s)
        height = -ty * (p[X] - ground[s, 0]) + tx * (p[Y] - ground[s, 1])
        time = time_to_line(height, -ty * p[VX] + tx * p[VY], tx * g)
        x = p[X] + p[VX] * time
        low, high = ground[s, 0] - NEAR, ground[s + 1, 0] + NEAR
        if time < math.inf and low <= x <= high:
            return time, s
        s += step
    return math.inf, -1


@kernel
def record_passage(
    ground: Floats, p: Floats, time: float, ax: float, ay: float, line: float, found: Floats
) -> None:
    """Record speed and height where a point first passes a chainage within a time."""
    if not math.isnan(found[SPEED]) or p[X] >= line:
        return
    x = p[X] + p[VX] * time + 0.5 * ax * time * time if time < math.inf else math.inf
    if x < line:
        return
    t = (line - p[X]) / p[VX]
    if ax != 0.0:
        square = p[VX] * p[VX] + 2.0 * ax * (line - p[X])
        t = (math.sqrt(max(square, 0.0)) - p[VX]) / ax
    s = segment_at(ground, line, True)
    tx, ty, _ = axes(ground, s)
    level = ground[s, 1] + (line - ground[s, 0]) * ty / tx
    found[SPEED] = math.hypot(p[VX] + ax * t, p[VY] + ay * t)
    found[HEIGHT] = max(p[Y] + p[VY] * t + 0.5 * ay * t * t - level, 0.0)


@kernel
def advance(p: Floats, time: float, ax: float, ay: float) -> None:
    """Move a point for a time under a constant acceleration."""
    p[X] += (p[VX] + 0.5 * ax * time) * time
    p[Y] += (p[VY] + 0.5 * ay * time) * time
    p[VX] += ax * time
    p[VY] += ay * time


@kernel
def rebound(ground: Floats, laws: Floats, p: Floats, s: int) -> bool:
    """Apply restitution at a segment; return whether the point slides from there."""
    tx, ty, _ = axes(ground, s)
    normal = -laws[s, NORMAL] * (-ty * p[VX] + tx * p[VY])
    along = laws[s, TANGENTIAL] * (tx * p[VX] + ty * p[VY])
    slides = normal < STILL
    normal = 0.0 if slides else normal
    p[VX], p[VY] = tx * along - ty * normal, ty * along + tx * normal
    return slides


@kernel
def slide(
    ground: Floats, laws: Floats, p: Floats, s: int, g: float, line: float, found: Floats
) -> tuple[bool, int]:
    """Slide a point to the end of its segment; return whether it stopped, and its segment."""
    tx, ty, length = axes(ground, s)
    here = tx * (p[X] - ground[s, 0]) + ty * (p[Y] - ground[s, 1])
    speed, pull, drag = tx * p[VX] + ty * p[VY], -g * ty, laws[s, FRICTION] * g * tx
    if speed == 0.0 and abs(pull) <= drag:
        return True, s
    way = math.copysign(1.0, speed) if speed != 0.0 else math.copysign(1.0, pull)
    gain = way * pull - drag  # acceleration along the way
    rest, v = (length - here if way > 0.0 else here), abs(speed)
    if v * v + 2.0 * gain * rest <= 0.0:
        time = -v / gain  # it comes to rest and may slide back
        record_passage(ground, p, time, way * gain * tx, way * gain * ty, line, found)
        advance(p, time, way * gain * tx, way * gain * ty)
        p[VX] = p[VY] = 0.0
        return abs(pull) <= drag, s
    after = math.sqrt(v * v + 2.0 * gain * rest)
    time = 2.0 * rest / (v + after) if rest > 0.0 else 0.0
    record_passage(ground, p, time, way * gain * tx, way * gain * ty, line, found)
    corner = s + 1 if way > 0.0 else s
    p[X], p[Y] = ground[corner, 0], ground[corner, 1]
    p[VX], p[VY] = way * after * tx, way * after * ty
    return False, s + int(way)


@kernel
def follow(ground: Floats, laws: Floats, p: Floats, g: float, line: float, found: Floats) -> None:
    """Follow a point until it stops or leaves the ground at one of its ends."""
    s, slides = segment_at(ground, p[X], p[VX] < 0.0), False
    for _ in range(MOST_MOVES):
        if slides:
            stopped, after = slide(ground, laws, p, s, g, line, found)
            if stopped or not 0 <= after < len(ground) - 1:
                break
            if after != s:  # it flies off a convex corner and hits the ground at a concave one
                tx, ty, _ = axes(ground, after)
                away = -ty * p[VX] + tx * p[VY]
                slides = away <= NEAR and (away > -NEAR or rebound(ground, laws, p, after))
            s = after
        else:
            time, met = fly(ground, p, s, g)
            record_passage(ground, p, time, 0.0, -g, line, found)
            if met < 0:
                p[X] = ground[0, 0] if p[VX] < 0.0 else ground[len(ground) - 1, 0]
                break
            advance(p, time, 0.0, -g)
            s, slides = met, rebound(ground, laws, p, met)
    found[RUN_OUT] = p[X]


@entry_kernel
def trajectories(
    ground: Floats, laws: Floats, starts: Floats, g: float, line: float, found: Floats
) -> None:
    """Follow points from their starts; `starts` is overwritten with the final states.

    Parameters
    ----------
    ground : (m, 2) array
        Corners, x ascending [m].
    laws : (n, m - 1, 3) array
        Coefficients of each segment, for each point.
    starts : (n, 4) array
        Position [m] and velocity [m/s].
    g : float
        Gravity [m/s2].
    line : float
        Chainage at which speed and height are recorded [m].
    found : (n, 3) array
        Filled with the results.
    """
    for i in range(len(starts)):
        found[i, SPEED] = found[i, HEIGHT] = math.nan
        follow(ground, laws[i], starts[i], g, line, found[i])
