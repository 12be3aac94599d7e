"""Sleeping: islands at rest are not computed until a moving body comes near."""

from __future__ import annotations

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.constants import ASLEEP, AWAKE, GROWN, SLEEP_SPEED, SLEEP_TIME
from rigdda.dynamics.motion import top_speed
from rigdda.dynamics.records import Bodies, Ints, Parameters
from rigdda.kernel import kernel


@kernel
def wake_island(bodies: Bodies, island: int, blocks: int) -> int:
    """Wake the bodies that fell asleep in an island; return their number."""
    woken = 0
    for k in range(blocks):
        body = bodies[k]
        if body.status == ASLEEP and body.island == island:
            body.status = AWAKE
            body.quiet = 0.0
            woken += 1
    return woken


@kernel
def wake_neighbours(bodies: Bodies, pairs: Ints, count: int, blocks: int) -> int:
    """Wake the islands of sleeping bodies paired with a moving one; return the number of bodies.

    A quiet awake body next to a sleeping fence wakes it as well, because the body may be struck and
    push the fence.
    """
    woken = 0
    for q in range(count):
        i, j = pairs[2 * q], pairs[2 * q + 1]
        if bodies[j].status != ASLEEP:
            continue
        if top_speed(bodies[i]) < SLEEP_SPEED and bodies[j].brake == 0.0:
            continue
        woken += wake_island(bodies, bodies[j].island, blocks)
    return woken


@kernel
def update_quiet_time(bodies: Bodies, islands: Islands, count: int, p: Parameters) -> None:
    """Update how long blocks have been quiet, and put islands to sleep in which all blocks are.

    A block that accelerates is not quiet, because it has begun to slide or fall.
    """
    for s in range(count):
        least = 1e300
        for place in range(islands.block_start[s], islands.block_start[s + 1]):
            body = bodies[islands.block_item[place]]
            speed = top_speed(body)
            body.slowest = min(body.slowest, speed) if body.quiet > 0.0 else speed
            growing = speed > body.slowest + GROWN * SLEEP_SPEED
            rests = body.touching or body.brake > 0.0
            quiet = rests and speed < SLEEP_SPEED and not growing
            body.quiet = body.quiet + p.dt if quiet else 0.0
            least = min(least, body.quiet)
        if least < SLEEP_TIME:
            continue
        for place in range(islands.block_start[s], islands.block_start[s + 1]):
            body = bodies[islands.block_item[place]]
            body.status = ASLEEP
            body.island = islands.block_item[islands.block_start[s]]
            body.vx = body.vy = body.omega = 0.0
