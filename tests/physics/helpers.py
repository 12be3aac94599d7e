"""Small constructors and measures that the physics tests share."""

from __future__ import annotations

import math

import numpy as np

import rigdda

GRAVITY = 9.81
FLAT = ((-100.0, 0.0), (100.0, 0.0))


def polygon(corners, centre=(0.0, 0.0), angle=0.0) -> np.ndarray:
    """Return corners turned by `angle` [rad] about the origin and moved to `centre`."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.asarray(corners) @ np.array([[cos, sin], [-sin, cos]]) + centre


def box(x=0.0, y=0.0, width=1.0, height=1.0, angle=0.0, **block) -> rigdda.Block:
    """Return a rectangle with its centroid at (x, y)."""
    corners = 0.5 * np.array([width, height]) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    return rigdda.Block(polygon(corners, (x, y), angle), **block)


def ngon(n, radius=1.0, centre=(0.0, 0.0), angle=0.0) -> np.ndarray:
    """Return the corners of a regular polygon."""
    turn = 2.0 * math.pi * np.arange(n) / n
    return polygon(radius * np.stack([np.cos(turn), np.sin(turn)], axis=1), centre, angle)


def rough(rng, n, radius=1.0) -> np.ndarray:
    """Return n corners at random places on an ellipse: a convex block, its centroid at 0."""
    turn = np.sort(rng.uniform(0.0, 2.0 * math.pi, n))
    while np.diff(turn, append=turn[0] + 2.0 * math.pi).max() > 0.9 * math.pi or (
        np.diff(turn, append=turn[0] + 2.0 * math.pi).min() < 0.15
    ):
        turn = np.sort(rng.uniform(0.0, 2.0 * math.pi, n))
    corners = radius * np.stack([np.cos(turn), rng.uniform(0.6, 1.0) * np.sin(turn)], axis=1)
    return corners - rigdda.geometry.polygon_properties(corners)[1]


def rock(friction_deg=30.0, restitution=0.0) -> dict[str, rigdda.Surface]:
    """Return the surfaces of a scene that has only one."""
    return {"rock": rigdda.Surface(friction_deg, restitution)}


def incline(slope_deg, friction_deg, width=1.0, height=1.0):
    """Return a scene with a block at rest on a slope that falls towards +x, and the unit fall."""
    slope = math.radians(slope_deg)
    down = np.array([math.cos(slope), -math.sin(slope)])
    out = np.array([math.sin(slope), math.cos(slope)])
    block = box(*(0.5 * height * out), width, height, -slope)
    terrain = rigdda.Terrain([-5.0 * down, 400.0 * down])
    return rigdda.Scene(terrain, (block,), rock(friction_deg)), down


def masses(scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the masses and the moments of inertia of the blocks."""
    area, _, second = zip(
        *(rigdda.geometry.polygon_properties(b.vertices) for b in scene.blocks), strict=True
    )
    density = np.array([b.density for b in scene.blocks])
    return density * area, density * second


def momentum(sim) -> tuple[np.ndarray, float, float]:
    """Return linear momentum, angular momentum about the origin and kinetic energy."""
    mass, inertia = masses(sim.scene)
    pose, velocity = sim.poses, sim.velocities
    linear = (mass[:, None] * velocity[:, :2]).sum(axis=0)
    moment = pose[:, 0] * velocity[:, 1] - pose[:, 1] * velocity[:, 0]
    spin = (mass * moment + inertia * velocity[:, 2]).sum()
    kinetic = 0.5 * (mass * (velocity[:, :2] ** 2).sum(axis=1) + inertia * velocity[:, 2] ** 2)
    return linear, float(spin), float(kinetic.sum())
