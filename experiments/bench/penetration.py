"""Penetration depth of bodies from their poses, computed in the same way for all engines."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from rigdda import Scene
from rigdda.geometry import polygon_properties

Floats = NDArray[np.float64]


class Shapes(NamedTuple):
    """The convex blocks of a scene about their centroids, and the chain of its terrain.

    Corners (N, C, 2) anticlockwise, number of sides (N,), radius about the centroid (N,), and
    corners of the terrain (M, 2) with the ground on the right [m].
    """

    corners: Floats
    sides: NDArray[np.int64]
    radius: Floats
    terrain: Floats


def centroids(scene: Scene) -> Floats:
    """Return the centroids of the blocks, (N, 2) [m]."""
    return np.array([polygon_properties(b.vertices)[1] for b in scene.blocks])


def shapes(scene: Scene) -> Shapes:
    """Return the shapes of a scene."""
    outlines = [b.vertices - c for b, c in zip(scene.blocks, centroids(scene), strict=True)]
    corners = np.zeros((len(outlines), max(map(len, outlines)), 2))
    for row, outline in zip(corners, outlines, strict=True):
        row[: len(outline)] = outline
    return Shapes(
        corners,
        np.array([len(o) for o in outlines]),
        np.array([np.hypot(*o.T).max() for o in outlines]),
        np.zeros((0, 2)) if scene.terrain is None else np.array(scene.terrain.points),
    )


@numba.njit(cache=True)
def _place(world: Floats, corners: Floats, sides: int, pose: Floats) -> None:
    """Write the corners of a block at its pose (x, y, theta) into `world`."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for k in range(sides):
        x, y = corners[k, 0], corners[k, 1]
        world[k, 0] = pose[0] + cos * x - sin * y
        world[k, 1] = pose[1] + sin * x + cos * y


@numba.njit(cache=True)
def _overlap(a: Floats, na: int, b: Floats, nb: int) -> float:
    """Return the least overlap of two convex polygons along the normals of `a`, < 0 if apart."""
    least = math.inf
    for i in range(na):
        j = (i + 1) % na
        ex, ey = a[j, 0] - a[i, 0], a[j, 1] - a[i, 1]
        length = math.hypot(ex, ey)
        deepest = -math.inf
        for k in range(nb):
            inside = (ex * (b[k, 1] - a[i, 1]) - ey * (b[k, 0] - a[i, 0])) / length
            deepest = max(deepest, inside)
        least = min(least, deepest)
    return least


@numba.njit(cache=True)
def _depth_in_ground(x: float, y: float, terrain: Floats) -> float:
    """Return the distance of a point to the terrain if it is in the ground, else 0 [m]."""
    nearest, side = math.inf, 0.0
    for i in range(len(terrain) - 1):
        px, py = terrain[i]
        ex, ey = terrain[i + 1, 0] - px, terrain[i + 1, 1] - py
        t = min(max(((x - px) * ex + (y - py) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        away = math.hypot(x - px - t * ex, y - py - t * ey)
        left = (ex * (y - py) - ey * (x - px)) / math.hypot(ex, ey)
        # if two segments share the nearest corner, use the one whose line is farther away
        if away < nearest - 1e-12 or (away < nearest + 1e-12 and abs(left) > abs(side)):
            nearest, side = away, left
    return nearest if side < 0.0 else 0.0


@numba.njit(cache=True)
def _depth_of_terrain(a: Floats, na: int, terrain: Floats) -> float:
    """Return the depth of the deepest corner of the terrain inside a block [m]."""
    deepest = 0.0
    for k in range(len(terrain)):
        deepest = max(deepest, _overlap(a, na, terrain[k : k + 1], 1))
    return deepest


@numba.njit(cache=True)
def _deepest(
    poses: Floats, corners: Floats, sides: NDArray[np.int64], radius: Floats, terrain: Floats
) -> Floats:
    """Return the greatest depth of each frame, (T,) [m]."""
    frames, blocks = poses.shape[:2]
    out = np.zeros(frames)
    world = np.empty_like(corners)
    for t in range(frames):
        pose = poses[t]
        for i in range(blocks):
            _place(world[i], corners[i], sides[i], pose[i])
            for k in range(sides[i]):
                out[t] = max(out[t], _depth_in_ground(world[i, k, 0], world[i, k, 1], terrain))
            out[t] = max(out[t], _depth_of_terrain(world[i], sides[i], terrain))
            for j in range(i):
                reach = radius[i] + radius[j]
                dx, dy = pose[i, 0] - pose[j, 0], pose[i, 1] - pose[j, 1]
                if dx * dx + dy * dy < reach * reach:
                    one = _overlap(world[i], sides[i], world[j], sides[j])
                    if one > out[t]:
                        other = _overlap(world[j], sides[j], world[i], sides[i])
                        out[t] = max(out[t], min(one, other))
    return out


def penetration(scene: Scene, poses: Floats) -> Floats:
    """Return the greatest penetration in each frame, (T,) [m].

    For two blocks, it is the least translation that separates them (over the edge normals of both;
    at least the depth of the deepest vertex). For a block and the terrain, it is the depth of the
    deepest vertex of either one inside the other.

    Parameters
    ----------
    scene : Scene
        Convex blocks, with or without terrain.
    poses : (T, N, 3) array
        x, y of the centroids [m] and rotation since the start [rad].
    """
    return _deepest(np.ascontiguousarray(poses), *shapes(scene))
