"""A single block in the arrays of another one: written into them at the start, read at the end."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.constants import MARGIN_RATIO, PENETRATION_RATIO
from rigdda.dynamics.pack.bodies import write_bodies
from rigdda.dynamics.records import Bodies, Interfaces
from rigdda.geometry import is_sound
from rigdda.kernel import Direct, kernel, short_kernel
from rigdda.model.apart import surely_on_ground

MOST_CORNERS = 12
"""Most corners of such a block: blocks of a band have no more."""


def with_room(outlines: Outlines) -> Outlines:
    """Return outlines, the first one of a single block, with room for one of `MOST_CORNERS`."""
    corner, local = outlines.corner, outlines.local
    more = max(0, MOST_CORNERS - corner.shape[1])
    wide = np.pad(corner.view(np.ndarray), ((0, 0), (0, more)))
    wide["number"][0] = np.arange(wide.shape[1])
    wide_local = np.pad(local.view(np.ndarray), ((0, 0), (0, more)))
    return Outlines(outlines.polygon, wide.view(np.recarray), wide_local.view(np.recarray))


@short_kernel
def start_single(
    corners: NDArray, traits: NDArray, chain: NDArray, boxes: NDArray, friction_deg: NDArray,
    restitution: NDArray, damping: NDArray, stations: NDArray, gravity: float, bodies: Bodies,
    outlines: Outlines, interfaces: Interfaces, rock: NDArray, parameters: NDArray,
) -> tuple[bool, float]:  # fmt: skip
    """Write a block and how surfaces meet into arrays that are otherwise as at the start.

    Parameters
    ----------
    corners : (n, 2) array
        Corners of the block [m].
    traits : (1, 6) array
        Its other properties, see `pack.bodies.Trait`.
    chain : (m, 2) array
        Corners of the ground [m].
    boxes : (K, 4) array
        Least x and y, greatest x and y of each barrier that is a body [m].
    friction_deg, restitution, damping : arrays
        How each two surfaces meet, see `Meetings` [deg, -, 1/s].
    stations : (K,) array
        Chainages that are watched [m].
    gravity : float
        Acceleration that gives the block its weight [m/s2].
    bodies, outlines, interfaces, rock, parameters : arrays
        What is written.

    Returns
    -------
    clear : bool
        Whether the block is surely convex and clear of the ground and of barriers.
    start : float
        Chainage of its centroid [m].
    """
    if not is_sound(corners) or not surely_on_ground(chain, corners) or _near(corners, boxes):
        return False, 0.0
    bodies[0].count = outlines.polygon[0].count = len(corners)
    write_bodies(corners, traits, bodies, outlines)
    body, watched = bodies[0], rock[0]
    watched.low, watched.high = body.x - body.radius, body.x + body.radius
    passed = 0
    while passed < len(stations) and stations[passed] <= body.x:
        passed += 1
    watched.next = passed
    _set_interfaces(friction_deg, restitution, damping, interfaces)
    size = math.sqrt(body.mass / traits[0, 0])
    for k in range(len(parameters)):
        p = parameters[k]
        p.block_weight = body.mass * gravity
        p.penetration, p.margin = PENETRATION_RATIO * size, MARGIN_RATIO * size
    return True, body.x


start_single_directly = Direct(start_single)


@kernel
def _near(corners: NDArray, boxes: NDArray) -> bool:
    """Return whether the bounding box of a block meets that of a barrier."""
    left, right, low, high = math.inf, -math.inf, math.inf, -math.inf
    for k in range(len(corners)):
        left, right = min(left, corners[k, 0]), max(right, corners[k, 0])
        low, high = min(low, corners[k, 1]), max(high, corners[k, 1])
    for i in range(len(boxes)):
        beside = left > boxes[i, 2] or right < boxes[i, 0]
        if not beside and low <= boxes[i, 3] and high >= boxes[i, 1]:
            return True
    return False


@kernel
def _set_interfaces(
    friction_deg: NDArray, restitution: NDArray, damping: NDArray, interfaces: Interfaces
) -> None:
    """Write how surfaces meet, but what no release draws; fences come last, without friction."""
    for i in range(len(interfaces)):
        for j in range(len(interfaces)):
            interface = interfaces[i, j]
            interface.damping = damping[i, j]
            if i < len(restitution) and j < len(restitution):
                interface.friction = math.tan(math.radians(friction_deg[i, j]))
                interface.restitution = restitution[i, j]


@short_kernel
def read_single(
    bodies: Bodies, rock: NDArray
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float], float]:
    """Return place [m], velocity [m/s], extent [m] and energy [J] of a block, see `Descent`."""
    body, watched = bodies[0], rock[0]
    extent = watched.low, watched.high
    return (body.x, body.y), (body.vx, body.vy), extent, watched.energy


read_single_directly = Direct(read_single)
