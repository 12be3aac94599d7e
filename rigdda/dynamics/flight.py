"""Free flight of a single moving body: steps without contact detection.

In most steps of its fall, a block is too far from the ground and from other bodies to touch
anything. These distances give the number of steps for which detection, corner positions and islands
can be skipped. The motion is computed by the same operations as in a full step, so that results are
bit-identical wherever a flight is interrupted.
"""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from rigdda.dynamics.arrays import GroundArrays, Islands, Monitors, Outlines
from rigdda.dynamics.constants import ASLEEP, AWAKE, RETIRED
from rigdda.dynamics.island_step import check_body, fall
from rigdda.dynamics.monitors import barrier_contact
from rigdda.dynamics.motion import top_speed
from rigdda.dynamics.post_correction import place_corners
from rigdda.dynamics.records import Bodies, Body, Contacts, Ints, Parameters, Polygons
from rigdda.kernel import kernel


@kernel
def lone_flyer(bodies: Bodies, begin: Ints, p: Parameters) -> int:
    """Return the only awake body if it has no contacts and no loads, else -1."""
    alone = -1
    for i in range(p.blocks):
        if bodies[i].status != AWAKE:
            continue
        if alone >= 0:
            return -1
        alone = i
    if alone < 0 or begin[alone + 1] > begin[alone]:
        return -1
    body = bodies[alone]
    if body.force_x != 0.0 or body.force_y != 0.0:
        return -1
    return alone if body.moment_cos == 0.0 and body.moment_sin == 0.0 else -1


@kernel
def time_to_fall(gap: float, speed: float, gravity: float) -> float:
    """Return the least time in which a gap closes from a closing speed under gravity [s]."""
    if gap <= 0.0:
        return 0.0
    root = math.sqrt(speed * speed + 2.0 * gravity * gap)
    return 2.0 * gap / (speed + root) if speed + root > 0.0 else math.inf


@kernel
def time_to_segment(
    body: Body, i: int, outlines: Outlines, one: Any, reach: float, most: float, p: Parameters
) -> float:  # fmt: skip
    """Return a lower bound on the time until the body may touch segment `one` [s], at most `most`.

    It is the largest of three bounds: from the corners above the line of the segment, from the
    circumscribed circle above that line, and from the distance of the circle to the segment. For
    `reach`, see `steps_of_flight`.
    """
    x, y, r, later = body.x, body.y, body.radius, 2.0 * p.gravity * p.dt
    nx, ny = one.normal_x, one.normal_y
    closing = max(-(nx * body.vx + ny * body.vy), 0.0) + later
    over = nx * (x - one.x) + ny * (y - one.y)
    time = time_to_fall(over - r - reach, closing, p.gravity)
    if time < most:
        lowest = math.inf
        for k in range(body.count):
            corner = outlines.corner[i, k]
            lowest = min(lowest, nx * (corner.x - one.x) + ny * (corner.y - one.y))
        spin = closing + abs(body.omega) * r
        time = max(time, time_to_fall(lowest - reach, spin, p.gravity))
    if time < most:
        along = min(max(ny * (x - one.x) - nx * (y - one.y), 0.0), one.length)
        away = math.hypot(x - one.x - along * ny, y - one.y + along * nx)
        speed = top_speed(body) + later
        time = max(time, time_to_fall(away - r - reach, speed, p.gravity))
    return min(most, time)


@kernel
def time_to_ground(
    body: Body, i: int, outlines: Outlines, ground: GroundArrays, reach: float, most: float,
    p: Parameters,
) -> float:  # fmt: skip
    """Return a lower bound on the time until the body may touch the ground [s], at most `most`.

    The segments below the centroid come first, since their bound excludes most of the others.
    """
    x, y, speed = body.x, body.y, top_speed(body) + 2.0 * p.gravity * p.dt
    for others in range(2):
        for s in range(len(ground.segment) - 1):
            one = ground.segment[s]
            if (one.left <= x and x <= one.right) == (others == 1):
                continue
            around = body.radius + reach + (speed + 0.5 * p.gravity * most) * most
            if one.left > x + around or one.right < x - around:
                continue
            if one.bottom > y + around or one.top < y - around:
                continue
            most = time_to_segment(body, i, outlines, one, reach, most, p)
    return most


@kernel
def time_to_bodies(
    bodies: Bodies, i: int, polygon: Polygons, reach: float, most: float, p: Parameters
) -> float:
    """Return a lower bound on the time until body i may touch another body [s], at most `most`.

    For `reach`, see `steps_of_flight`.
    """
    x, y = bodies[i].x, bodies[i].y
    speed = top_speed(bodies[i]) + 2.0 * p.gravity * p.dt
    for j in range(len(bodies)):
        if j == i or bodies[j].status == RETIRED:
            continue
        box = polygon[j]
        dx = max(box.low_x - x, x - box.high_x, 0.0)
        dy = max(box.low_y - y, y - box.high_y, 0.0)
        away = math.sqrt(dx * dx + dy * dy) - bodies[i].radius - reach
        most = min(most, time_to_fall(away, speed, p.gravity))
    return most


@kernel
def steps_of_flight(
    bodies: Bodies, i: int, outlines: Outlines, ground: GroundArrays, p: Parameters, steps: int
) -> int:
    """Return the number of steps, at most `steps`, for which body i cannot touch anything.

    Detection searches within the distance that a corner can travel in a step; twice that distance
    is used here. After a time t, it is 2 (v + g t) dt for a speed v at the start: a distance
    `reach` at the start, which grows by 2 g dt per time as if bodies approached faster by that.
    """
    reach = 2.0 * (top_speed(bodies[i]) * p.dt + p.gravity * p.dt * p.dt + p.margin)
    time = time_to_bodies(bodies, i, outlines.polygon, reach, steps * p.dt, p)
    if time >= p.dt:
        time = time_to_ground(bodies[i], i, outlines, ground, reach, time, p)
    return int(max(time, 0.0) / p.dt)


@kernel
def take_off(
    bodies: Bodies, outlines: Outlines, ground: GroundArrays, islands: Islands, begin: Ints,
    p: Parameters, steps: int,
) -> tuple[int, int]:  # fmt: skip
    """Return the flying body and its number of steps, at most `steps`; set it up as island 0.

    The number is 0 if no body flies.
    """
    i = lone_flyer(bodies, begin, p)
    steps = steps_of_flight(bodies, i, outlines, ground, p, steps) if i >= 0 else 0
    if steps > 0:
        islands.block_start[0], islands.block_start[1], islands.block_item[0] = 0, 1, i
        islands.contact_start[0] = islands.contact_start[1] = 0
        islands.slot[i] = 0
    return i, steps


@kernel
def keep_touch(
    bodies: Bodies, contacts: Contacts, count: int, monitors: Monitors, time: float
) -> None:
    """Record that blocks asleep against barriers still touch them."""
    for k in range(count):
        if bodies[contacts[k].a].status == ASLEEP:
            block, barrier = barrier_contact(monitors, contacts[k].a, contacts[k].b)
            if barrier >= 0:
                monitors.last_touch[block, barrier] = time


@kernel
def fly(bodies: Bodies, i: int, p: Parameters, ledger: NDArray) -> int:
    """Advance body i, which touches nothing, by one step; return i if it diverged, else -1.

    Its corners are not updated until `land`.
    """
    fall(bodies[i], p, ledger)
    bodies[i].quiet = 0.0
    return check_body(bodies, i, p, ledger)


@kernel
def land(bodies: Bodies, outlines: Outlines, i: int, flown: int) -> None:
    """Update the corners of body i after `flown` steps of flight."""
    if flown > 0:
        place_corners(bodies, outlines, i)
