"""Box2D v3 (pyb2d3): soft steps in single precision, one Python call per step."""

from __future__ import annotations

import math

import numpy as np
import pyb2d3

from experiments.bench.penetration import centroids
from rigdda import Block, Scene

NAME = "box2d"

OPTIONS = (
    {"substeps": 2, "hertz": 120.0},
    {"substeps": 4, "hertz": 120.0},
    {"substeps": 4, "hertz": 30.0},
    {"substeps": 1, "hertz": 120.0},
    {"substeps": 8, "hertz": 240.0},
)
"""Options tried with each step; 4 substeps and 30 Hz are the defaults. Rockfalls use the first
three: for 5 cm, one substep costs 1.2 to 1.4 times as much and eight substeps 1.3 to 1.8 times."""

FASTEST = 1000.0
"""Speed limit of Box2D [m/s], above that of any rockfall."""


class Engine:
    """A scene in Box2D v3.

    Parameters
    ----------
    scene : rigdda.Scene
        The scene; the friction of a pair is the geometric mean of both.
    dt : float
        Step [s].
    sleeping : bool
        Whether blocks at rest may sleep.
    substeps : int
        Number of substeps per step.
    hertz : float
        Stiffness of contacts [1/s]; Box2D limits it to a quarter of the substep rate.
    """

    def __init__(self, scene: Scene, dt: float, sleeping: bool, substeps: int, hertz: float):
        self._dt, self._substeps = dt, substeps
        self._world = pyb2d3.World(
            gravity=scene.gravity_vector, contact_hertz=hertz, maximum_linear_speed=FASTEST
        )
        self._world.sleeping_enabled = sleeping
        surface = scene.surfaces["rock"]
        self._material = pyb2d3.surface_material(
            friction=math.tan(math.radians(surface.friction_deg)),
            restitution=surface.restitution or 0.0,
        )
        if scene.terrain is not None:
            self._add_terrain(np.array(scene.terrain.points))
        self._bodies = [
            self._add_block(b, c, scene.damping)
            for b, c in zip(scene.blocks, centroids(scene), strict=True)
        ]

    def _add_terrain(self, points: np.ndarray) -> None:
        """Add a chain, which is solid on its left; its outermost corners only guide."""
        first, last = 2.0 * points[0] - points[1], 2.0 * points[-1] - points[-2]
        chain = np.concatenate([[first], points, [last]])[::-1]
        self._world.create_static_body().create_chain(
            pyb2d3.chain_def(chain, material=self._material)
        )

    def _add_block(self, block: Block, centre: np.ndarray, damping: float) -> pyb2d3.Body:
        body = self._world.create_dynamic_body(
            position=tuple(centre), linear_damping=damping, angular_damping=damping
        )
        body.linear_velocity, body.angular_velocity = block.velocity[:2], block.velocity[2]
        definition = pyb2d3.shape_def(density=block.density, material=self._material)
        body.create_shape(definition, pyb2d3.polygon(block.vertices - centre, radius=0.0))
        return body

    def advance(self, steps: int) -> None:
        """Take steps."""
        step, dt, substeps = self._world.step, self._dt, self._substeps
        for _ in range(steps):
            step(dt, substeps)

    def poses(self) -> np.ndarray:
        """Return x, y of the centroids [m] and rotation [rad], wrapped to half a turn, (N, 3)."""
        return np.array([(*b.position, b.angle) for b in self._bodies])

    def velocities(self) -> np.ndarray:
        """Return velocities of the centroids [m/s] and rates of rotation [rad/s], (N, 3)."""
        return np.array([(*b.linear_velocity, b.angular_velocity) for b in self._bodies])
