"""A deep pile of polygons between smooth walls: it comes to rest, and its base bears its weight."""

from __future__ import annotations

import numpy as np

from rigdda.geometry import polygon_properties
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY

WIDTH, SIZE = 2.0, 0.3
"""Width of the silo and of its polygons [m]."""

COLUMNS, SPACING = 6, 1.25
"""Polygons of a layer, and height of a layer over their size [-]."""

TIME = 20.0
"""Time in which a pile is to rest [s]."""

DEPTHS = (20, 40, 60)
"""Layers that are tried."""


def pebble(rng: np.random.Generator, x: float, y: float) -> Block:
    """Return a random polygon of four to seven corners, at most 1.15 times the size wide."""
    n = int(rng.integers(4, 8))
    angle = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) * 2.0 * np.pi / n + rng.uniform(0.0, 6.28)
    angle = np.sort(np.mod(angle, 2.0 * np.pi))
    radius = 0.5 * SIZE * rng.uniform(0.85, 1.15, n)
    return Block(np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1))


def silo(rng: np.random.Generator, layers: int) -> Scene:
    """Return loose layers of polygons above the base; walls and base are smooth."""
    height, column = SPACING * SIZE, WIDTH / COLUMNS
    blocks = tuple(
        pebble(rng, (i + 0.5) * column, 0.2 + j * height)
        for j in range(layers)
        for i in range(COLUMNS)
    )
    top = layers * height + 5.0
    chain = [(-1.0, top), (0.0, top), (0.0, 0.0), (WIDTH, 0.0), (WIDTH, top), (WIDTH + 1.0, top)]
    wall = Surface(friction_deg=0.0)
    return Scene(
        Terrain(chain, ["wall"] * 5),
        blocks,
        {"rock": Surface(friction_deg=30.0), "wall": wall},
        interfaces={("rock", "wall"): wall},
    )


def fill(lab: Lab, layers: int) -> tuple[float, float]:
    """Let a silo fill; return the greatest speed in the end [m/s] and what its base bears.

    The second is the load of the base over the weight [-].
    """
    scene = silo(lab.random(layers), layers)
    sim = lab.simulate(scene)
    sim.step(lab.steps(TIME))
    speed = float(np.hypot(*sim.velocities[:, :2].T).max())
    contacts = sim.contacts()
    base = contacts[(contacts["block_b"] == -1) & (contacts["ny"] > 0.7)]
    areas = [polygon_properties(block.vertices)[0] for block in scene.blocks]
    weight = GRAVITY * sum(a * b.density for a, b in zip(areas, scene.blocks, strict=True))
    return speed, float(base["normal_force"].sum() / weight)


def measure(lab: Lab) -> tuple[Measured, Measured]:
    """Fill silos of several depths."""
    speeds, loads = zip(*(fill(lab, layers) for layers in DEPTHS), strict=True)
    return Measured(speeds), Measured(loads, 1.0)


CHECKS = (
    Check("speed after 20 s", "none: it is at rest", "m/s", 1e-2, "bound"),
    Check("load of the base over weight", "1: smooth walls", "-", 1e-2, "relative"),
)

CASES = (
    Case("silo", CHECKS, measure),
    Case("silo-10ms", CHECKS, measure, dt=0.01, slow=True),
)
