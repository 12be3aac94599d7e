"""MuJoCo: soft contacts by convex optimisation, in 3D with extruded blocks on planar joints."""

from __future__ import annotations

import math
from itertools import pairwise

import mujoco
import numpy as np

from experiments.bench.penetration import centroids
from rigdda import Block, Scene
from rigdda.geometry import polygon_properties

NAME = "mujoco"

OPTIONS = (
    {"softness": 2.0, "impedance": 0.99, "integrator": "EULER"},
    {"softness": 2.0, "impedance": 0.95, "integrator": "EULER"},
    {"softness": 4.0, "impedance": 0.95, "integrator": "EULER"},
    {"softness": 2.0, "impedance": 0.99, "integrator": "RK4"},
)
"""Options tried with each step."""

FRICTION_STIFFNESS = 10.0
"""Stiffness of friction over that of the normal contact, `impratio` [-], which reduces creep."""

GROUND = 10.0
"""Thickness of the boxes that form the terrain [m]."""

WIDTH = 1.0
"""Width of the blocks normal to the plane [m]; the terrain is wider."""


class Engine:
    """A scene in MuJoCo, which has no restitution.

    Parameters
    ----------
    scene : Scene
        The scene; the friction of a pair is the greater of both.
    dt : float
        Step [s].
    sleeping : bool
        Whether blocks at rest may sleep.
    softness : float
        Time constant of contacts over the step, at least 2 [-].
    impedance : float
        Share of a contact's acceleration prescribed by its constraint, `solimp` [-].
    integrator : {"EULER", "RK4"}
        Time integrator.
    """

    def __init__(
        self,
        scene: Scene,
        dt: float,
        sleeping: bool,
        softness: float,
        impedance: float,
        integrator: str,
    ):
        spec = mujoco.MjSpec()
        spec.option.timestep = dt
        spec.option.gravity = [scene.gravity_vector[0], 0.0, scene.gravity_vector[1]]
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = FRICTION_STIFFNESS
        if sleeping:
            spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
        mu = math.tan(math.radians(scene.surfaces["rock"].friction_deg))
        self._contact = {
            "friction": [mu, 0.0, 0.0],
            "condim": 3,
            "solref": [softness * dt, 1.0],
            "solimp": [impedance, impedance, 1e-3, 0.5, 2.0],
        }
        if scene.terrain is not None:
            self._add_terrain(spec, np.array(scene.terrain.points))
        for i, (block, centre) in enumerate(zip(scene.blocks, centroids(scene), strict=True)):
            self._add_block(spec, i, block, centre, scene.damping)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._data.qvel[:] = np.ravel([block.velocity for block in scene.blocks])
        mujoco.mj_forward(self._model, self._data)
        self._start = centroids(scene)

    def _add_terrain(self, spec: mujoco.MjSpec, points: np.ndarray) -> None:
        """Add a plane for a terrain of one segment, or else a box below each segment."""
        for a, b in pairwise(points):
            along = b - a
            length = math.hypot(*along)
            down = np.array([along[1], -along[0]]) / length
            if len(points) == 2:
                kind, (x, z) = mujoco.mjtGeom.mjGEOM_PLANE, 0.5 * (a + b)
            else:
                kind, (x, z) = mujoco.mjtGeom.mjGEOM_BOX, 0.5 * (a + b) + 0.5 * GROUND * down
            spec.worldbody.add_geom(
                type=kind,
                size=[0.5 * length, WIDTH, 0.5 * GROUND],
                pos=[x, 0.0, z],
                quat=_about_y(math.atan2(along[1], along[0])),
                **self._contact,
            )

    def _add_block(
        self, spec: mujoco.MjSpec, i: int, block: Block, centre: np.ndarray, damping: float
    ) -> None:
        """Add an extruded polygon that translates in x and z and rotates about -y."""
        outline = block.vertices - centre
        area, _, second = polygon_properties(block.vertices)
        mass, inertia = block.density * area, block.density * second
        body = spec.worldbody.add_body(
            pos=[centre[0], 0.0, centre[1]],
            mass=mass,
            inertia=[inertia, inertia, inertia],
            ipos=[0.0, 0.0, 0.0],
            explicitinertial=True,
        )
        for kind, axis, c in (
            ("SLIDE", [1, 0, 0], mass),
            ("SLIDE", [0, 0, 1], mass),
            ("HINGE", [0, -1, 0], inertia),
        ):
            joint = getattr(mujoco.mjtJoint, f"mjJNT_{kind}")
            body.add_joint(type=joint, axis=axis, damping=[damping * c, 0.0, 0.0])
        if _is_rectangle(outline):
            (dx, dz), (ex, ez) = outline[1] - outline[0], outline[2] - outline[1]
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=[0.5 * math.hypot(dx, dz), 0.5 * WIDTH, 0.5 * math.hypot(ex, ez)],
                quat=_about_y(math.atan2(dz, dx)),
                **self._contact,
            )
            return
        sides = [np.insert(outline, 1, y, axis=1) for y in (-0.5 * WIDTH, 0.5 * WIDTH)]
        spec.add_mesh(name=f"block{i}", uservert=np.concatenate(sides).ravel())
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"block{i}", **self._contact)

    def advance(self, steps: int) -> None:
        """Take steps."""
        mujoco.mj_step(self._model, self._data, nstep=steps)

    def poses(self) -> np.ndarray:
        """Return x, y of the centroids [m] and rotation since the start [rad], (N, 3)."""
        poses = self._data.qpos.reshape(-1, 3).copy()
        poses[:, :2] += self._start
        return poses

    def velocities(self) -> np.ndarray:
        """Return velocities of the centroids [m/s] and rates of rotation [rad/s], (N, 3)."""
        return self._data.qvel.reshape(-1, 3).copy()


def _is_rectangle(outline: np.ndarray) -> bool:
    """Return whether (n, 2) corners about the centroid are those of a rectangle."""
    radius = np.hypot(*outline.T)
    return len(outline) == 4 and bool(np.ptp(radius) < 1e-9 * radius.max())


def _about_y(angle: float) -> list[float]:
    """Return the quaternion of a rotation [rad], anticlockwise in x and z."""
    return [math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0]
