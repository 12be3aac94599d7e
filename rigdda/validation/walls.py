"""A thin wall stops fast blocks; no block tunnels through it."""

from __future__ import annotations

import numpy as np

from rigdda.model.scene import Block, Scene, Terrain, Wall
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, polygon, rock, rough

WALL = Wall(x=10.0, height=100.0, thickness=0.2)
"""The wall, too high for any of the blocks to fly over it."""

SHOTS = 200
FLIGHT = 0.3
"""Longest flight time to the wall [s]."""


def shot(rng: np.random.Generator) -> Scene:
    """Return a random convex block that flies at the wall at 5 to 100 m/s."""
    radius = rng.uniform(0.3, 1.5)
    corners = rough(rng, int(rng.integers(3, 9)), radius)
    speed, climb = rng.uniform(5.0, 100.0), np.radians(rng.uniform(-45.0, 45.0))
    velocity = (speed * np.cos(climb), speed * np.sin(climb), rng.uniform(-20.0, 20.0))
    away = 1.5 * radius + rng.uniform(0.05, FLIGHT) * velocity[0]
    corners = polygon(corners, (WALL.x - away, 50.0), rng.uniform(0.0, 2.0 * np.pi))
    surfaces = rock(30.0, rng.uniform(0.0, 0.9))
    return Scene(Terrain(FLAT), (Block(corners, velocity=velocity),), surfaces, barriers=(WALL,))


def fly(lab: Lab, scene: Scene) -> tuple[bool, bool, float]:
    """Return whether a block arrives, whether its centroid passes, and its corner depth [m]."""
    sim = lab.simulate(scene)
    deepest, centre = 0.0, 0.0
    for _ in range(lab.steps(FLIGHT + 0.5)):
        sim.step()
        deepest = max(deepest, float(sim.vertices(0)[:, 0].max()) - WALL.x)
        centre = max(centre, float(sim.poses[0, 0]))
    energy = sim.energy()
    arrived = energy.impact + energy.friction < 0.0  # an impact on the wall takes energy
    return arrived, centre > WALL.x, deepest


def measure(lab: Lab) -> tuple[Measured, Measured, Measured]:
    """Simulate all shots."""
    arrived, passed, deepest = zip(
        *(fly(lab, shot(lab.random(i))) for i in range(SHOTS)), strict=True
    )
    return Measured(sum(arrived), SHOTS), Measured(sum(passed)), Measured(deepest)


CHECKS = (
    Check("arrive", "all", "-", 0.0, "absolute"),
    Check("centroids pass", "none: rigid", "-", 0.0, "bound"),
    # a greater depth would put a corner on the far side
    Check("corner depth", "none: rigid", "m", WALL.thickness, "bound"),
)

CASES = (
    Case("thin-wall", CHECKS, measure),
    Case("thin-wall-10ms", CHECKS, measure, dt=0.01),
)
