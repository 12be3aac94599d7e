"""pymunk (Chipmunk2D): sequential impulses, one Python call per step, discrete collision."""

from __future__ import annotations

import math

import numpy as np
import pymunk

from experiments.bench.penetration import centroids
from rigdda import Block, Scene
from rigdda.geometry import polygon_properties

NAME = "pymunk"

OPTIONS = (
    {"iterations": 10, "slop": 1e-2},
    {"iterations": 10, "slop": 1e-3},
    {"iterations": 3, "slop": 1e-3},
    {"iterations": 30, "slop": 1e-4},
)
"""Options tried with each step; 10 iterations are the default."""

RADIUS = 0.1
"""Radius of the terrain's segments, which are sunk into the ground by it [m]. With 0.5 m, rounded
corners hold blocks on the benches that other engines release."""


class Engine:
    """A scene in pymunk.

    Parameters
    ----------
    scene : rigdda.Scene
        The scene; the friction of a pair is the product of both, so each has the square root.
    dt : float
        Step [s].
    sleeping : bool
        Whether blocks at rest may sleep.
    iterations : int
        Number of solver iterations.
    slop : float
        Permitted overlap [m].
    """

    def __init__(self, scene: Scene, dt: float, sleeping: bool, iterations: int, slop: float):
        self._dt = dt
        self._space = space = pymunk.Space()
        space.gravity = scene.gravity_vector
        space.damping = math.exp(-scene.damping)
        space.iterations = iterations
        space.collision_slop = slop
        if sleeping:
            space.sleep_time_threshold = 0.5
        surface = scene.surfaces["rock"]
        self._friction = math.sqrt(math.tan(math.radians(surface.friction_deg)))
        self._elasticity = math.sqrt(surface.restitution or 0.0)
        if scene.terrain is not None:
            self._add_terrain(np.array(scene.terrain.points))
        self._bodies = [
            self._add_block(b, c) for b, c in zip(scene.blocks, centroids(scene), strict=True)
        ]

    def _add_terrain(self, points: np.ndarray) -> None:
        along = np.diff(points, axis=0)
        down = np.stack([along[:, 1], -along[:, 0]], axis=1)
        down *= RADIUS / np.hypot(*along.T)[:, None]
        ends = np.stack([points[:-1] + down, points[1:] + down], axis=1)
        for i, (start, end) in enumerate(ends.tolist()):
            shape = pymunk.Segment(self._space.static_body, start, end, RADIUS)
            before, after = ends[max(i - 1, 0), 0], ends[min(i + 1, len(ends) - 1), 1]
            shape.set_neighbors(before.tolist(), after.tolist())
            self._space.add(self._with_surface(shape))

    def _add_block(self, block: Block, centre: np.ndarray) -> pymunk.Body:
        area, _, second = polygon_properties(block.vertices)
        body = pymunk.Body(block.density * area, block.density * second)
        body.position = tuple(centre)
        body.velocity, body.angular_velocity = block.velocity[:2], block.velocity[2]
        shape = pymunk.Poly(body, [tuple(v) for v in block.vertices - centre])
        self._space.add(body, self._with_surface(shape))
        return body

    def _with_surface(self, shape: pymunk.Shape) -> pymunk.Shape:
        shape.friction, shape.elasticity = self._friction, self._elasticity
        return shape

    def advance(self, steps: int) -> None:
        """Take steps."""
        step, dt = self._space.step, self._dt
        for _ in range(steps):
            step(dt)

    def poses(self) -> np.ndarray:
        """Return x, y of the centroids [m] and rotation since the start [rad], (N, 3)."""
        return np.array([(*b.position, b.angle) for b in self._bodies])

    def velocities(self) -> np.ndarray:
        """Return velocities of the centroids [m/s] and rates of rotation [rad/s], (N, 3)."""
        return np.array([(*b.velocity, b.angular_velocity) for b in self._bodies])
