"""Constructors and measures shared by the cases and the physics tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda.dynamics.simulation import Simulation
from rigdda.geometry import polygon_properties
from rigdda.model.scene import Block, Scene, Surface, Terrain

GRAVITY = 9.81
"""Default gravity of a scene [m/s2]."""

FLAT = ((-100.0, 0.0), (100.0, 0.0))
"""Corners of level ground [m]."""

Floats = NDArray[np.float64]


def polygon(corners: ArrayLike, centre: ArrayLike = (0.0, 0.0), angle: float = 0.0) -> Floats:
    """Return (n, 2) corners rotated by `angle` [rad] about the origin and moved to `centre` [m]."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.asarray(corners) @ np.array([[cos, sin], [-sin, cos]]) + np.asarray(centre)


def box(
    x: float = 0.0,
    y: float = 0.0,
    width: float = 1.0,
    height: float = 1.0,
    angle: float = 0.0,
    **block: Any,
) -> Block:
    """Return a rectangle with its centroid at (x, y) [m]."""
    corners = 0.5 * np.array([width, height]) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    return Block(polygon(corners, (x, y), angle), **block)


def ngon(n: int, radius: float = 1.0, centre: ArrayLike = (0.0, 0.0), angle: float = 0.0) -> Floats:
    """Return the (n, 2) corners of a regular polygon [m]."""
    turn = 2.0 * math.pi * np.arange(n) / n
    return polygon(radius * np.stack([np.cos(turn), np.sin(turn)], axis=1), centre, angle)


def rough(rng: np.random.Generator, n: int, radius: float = 1.0) -> Floats:
    """Return n random corners on an ellipse [m]: a convex block with its centroid at 0."""
    turn = np.sort(rng.uniform(0.0, 2.0 * math.pi, n))
    while np.diff(turn, append=turn[0] + 2.0 * math.pi).max() > 0.9 * math.pi or (
        np.diff(turn, append=turn[0] + 2.0 * math.pi).min() < 0.15
    ):
        turn = np.sort(rng.uniform(0.0, 2.0 * math.pi, n))
    corners = radius * np.stack([np.cos(turn), rng.uniform(0.6, 1.0) * np.sin(turn)], axis=1)
    centred: Floats = corners - polygon_properties(corners)[1]
    return centred


def rock(friction_deg: float = 30.0, restitution: float = 0.0) -> dict[str, Surface]:
    """Return the surfaces of a scene with a single surface."""
    return {"rock": Surface(friction_deg=friction_deg, restitution=restitution)}


def incline(
    slope_deg: float, friction_deg: float, width: float = 1.0, height: float = 1.0
) -> tuple[Scene, Floats]:
    """Return a scene with a block at rest on a slope down to +x, and the downslope direction."""
    slope = math.radians(slope_deg)
    down = np.array([math.cos(slope), -math.sin(slope)])
    out = np.array([math.sin(slope), math.cos(slope)])
    x, y = 0.5 * height * out
    block = box(x, y, width, height, -slope)
    terrain = Terrain([-5.0 * down, 400.0 * down])
    return Scene(terrain, (block,), rock(friction_deg)), down


def masses(scene: Scene) -> tuple[Floats, Floats]:
    """Return the masses [kg/m] and the moments of inertia [kg m] of the blocks, each (N,)."""
    area, _, second = zip(*(polygon_properties(b.vertices) for b in scene.blocks), strict=True)
    density = np.array([b.density for b in scene.blocks])
    return density * np.array(area), density * np.array(second)


def block_size(scene: Scene) -> float:
    """Return the mean block size, the square root of the mean area [m]."""
    return math.sqrt(float(np.mean([polygon_properties(b.vertices)[0] for b in scene.blocks])))


def kinetic_energy(velocity: Floats, mass: Floats, inertia: Floats) -> float:
    """Return the kinetic energy [J] of blocks with velocities (N, 3)."""
    speed = (velocity[:, :2] ** 2).sum(axis=1)
    return float(0.5 * (mass * speed + inertia * velocity[:, 2] ** 2).sum())


def momentum(sim: Simulation) -> tuple[Floats, float, float]:
    """Return linear momentum (2,), angular momentum about the origin and kinetic energy."""
    mass, inertia = masses(sim.scene)
    pose, velocity = sim.poses, sim.velocities
    linear: Floats = (mass[:, None] * velocity[:, :2]).sum(axis=0)
    moment = pose[:, 0] * velocity[:, 1] - pose[:, 1] * velocity[:, 0]
    spin = float((mass * moment + inertia * velocity[:, 2]).sum())
    return linear, spin, kinetic_energy(velocity, mass, inertia)


def shifts(before: Floats, after: Floats, along: Sequence[float] | Floats) -> float:
    """Return the displacement of the first block along a unit vector between two poses [m]."""
    return float((after[0, :2] - before[0, :2]) @ np.asarray(along))
