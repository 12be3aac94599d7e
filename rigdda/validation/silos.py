"""A deep pile of polygons between walls: it comes to rest with the correct load on its base."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigdda.geometry import polygon_properties
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY

WIDTH, SIZE = 2.0, 0.3
"""Width of the silo and size of its polygons [m]."""

COLUMNS, SPACING = 6, 1.25
"""Number of polygons in a layer, and height of a layer over polygon size [-]."""

TIME = 20.0
"""Time in which a pile must come to rest [s]."""

DEPTHS = (20, 40, 60)
"""Numbers of layers."""

WALL_DEG, FILLINGS = 20.0, 5
"""Friction angle of rough walls [deg], and number of fillings that are averaged."""

PILES = 30
"""Number of fillings between smooth walls that are averaged."""

STEPS = (1e-3, 2.5e-3, 5e-3, 1e-2)
"""Steps for which the thrust is compared [s]; the longest permitted one is 13 ms."""

JAKY = 0.5
"""Ratio of horizontal to vertical pressure of rock of 30 deg at rest, 1 - sin phi [-]."""

LOOK = 0.02
"""Interval at which the energy is sampled [s]."""

RISE = 2e-3
"""Tolerance of the rise of energy over the released energy [-]. Position correction removes
penetration from the impacts of layers and thereby lifts the layers above. The rise is smaller for
shorter steps and greater for deeper piles."""


def pebble(rng: np.random.Generator, x: float, y: float) -> Block:
    """Return a random polygon of four to seven corners, at most 1.15 times as wide as `SIZE`."""
    n = int(rng.integers(4, 8))
    angle = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) * 2.0 * np.pi / n + rng.uniform(0.0, 6.28)
    angle = np.sort(np.mod(angle, 2.0 * np.pi))
    radius = 0.5 * SIZE * rng.uniform(0.85, 1.15, n)
    return Block(np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1))


def silo(rng: np.random.Generator, layers: int, friction_deg: float = 0.0) -> Scene:
    """Return loose layers of polygons above the base; walls and base have this friction angle."""
    height, column = SPACING * SIZE, WIDTH / COLUMNS
    blocks = tuple(
        pebble(rng, (i + 0.5) * column, 0.2 + j * height)
        for j in range(layers)
        for i in range(COLUMNS)
    )
    top = layers * height + 5.0
    chain = [(-1.0, top), (0.0, top), (0.0, 0.0), (WIDTH, 0.0), (WIDTH, top), (WIDTH + 1.0, top)]
    wall = Surface(friction_deg)
    return Scene(
        Terrain(chain, ["wall"] * 5),
        blocks,
        {"rock": Surface(friction_deg=30.0), "wall": wall},
        interfaces={("rock", "wall"): wall},
    )


class Filled(NamedTuple):
    """Results of filling a silo.

    Greatest final speed [m/s], load on the base over the weight [-], mean thrust on a wall over
    that of a fluid of the same weight [-], greatest rise of kinetic and potential energy over the
    released energy [-], and depth of the fill [m].
    """

    speed: float
    base: float
    thrust: float
    rise: float
    depth: float


def fill(lab: Lab, scene: Scene, dt: float | None = None) -> Filled:
    """Fill a silo and sample its energy every `LOOK` seconds, with the step of the lab or `dt`."""
    sim = lab.simulate(scene, dt)
    stride = round(LOOK / sim.settings.dt)
    energies = []
    for _ in range(round(TIME / LOOK)):
        energy = sim.energy()
        energies.append(energy.kinetic + energy.potential)
        sim.step(stride)
    speed = float(np.hypot(*sim.velocities[:, :2].T).max())
    energy = sim.energy()
    path = np.array([*energies, energy.kinetic + energy.potential])
    rise = float((path - np.minimum.accumulate(path)).max() / (path[0] - path[-1]))
    contacts = sim.contacts()
    ground = contacts[contacts["block_b"] == -1]
    areas = [polygon_properties(block.vertices)[0] for block in scene.blocks]
    weight = GRAVITY * sum(a * b.density for a, b in zip(areas, scene.blocks, strict=True))
    base = ground[ground["ny"] > 0.7]["normal_force"].sum() / weight
    depth = float(np.sort(sim.poses[:, 1])[-COLUMNS:].mean() + 0.5 * SIZE)
    walls = 0.5 * ground[np.abs(ground["nx"]) > 0.7]["normal_force"].sum()
    fluid = 0.5 * weight / WIDTH * depth
    return Filled(speed, float(base), float(walls / fluid), rise, depth)


def measure(lab: Lab) -> tuple[Measured, ...]:
    """Fill silos of several depths between smooth walls."""
    found = [fill(lab, silo(lab.random(layers), layers)) for layers in DEPTHS]
    speeds, loads, _, rises, _ = zip(*found, strict=True)
    return Measured(speeds), Measured(loads, 1.0), Measured(rises)


def measure_thrust(lab: Lab) -> tuple[Measured, ...]:
    """Fill silos with smooth walls and compare the mean thrust on a wall for several steps.

    The thrust should be that of rock at rest, Jaky's K times that of a fluid. Single fillings
    scatter by 0.1, because a pile of polygons is supported at few points.
    """
    means = []
    for dt in STEPS:
        found = [fill(lab, silo(lab.random(20, k), 20), dt) for k in range(PILES)]
        means.append(float(np.mean([f.thrust for f in found])))
    return Measured(means, JAKY), Measured(float(np.ptp(means) / np.mean(means)))


def measure_rough(lab: Lab) -> tuple[Measured, ...]:
    """Fill silos with rough walls and compare the mean load on the base.

    Wall friction carries part of the fill. Janssen (1895) gives the load on the base over the
    weight, (1 - exp(-w)) / w with w = 2 K tan(phi) depth / width and Jaky's K = 1 - sin 30 deg, for
    a fill that slides down the walls everywhere. A fill that falls all at once does so only in
    part.
    """
    rng = [lab.random(20, k) for k in range(FILLINGS)]
    found = [fill(lab, silo(each, 20, WALL_DEG)) for each in rng]
    base, depth = np.mean([f.base for f in found]), np.mean([f.depth for f in found])
    w = 2.0 * JAKY * math.tan(math.radians(WALL_DEG)) * depth / WIDTH
    return (
        Measured([f.speed for f in found]),
        Measured(base, -math.expm1(-w) / w),
        Measured([f.rise for f in found]),
    )


CHECKS = (
    Check("speed after 20 s", "none: it is at rest", "m/s", 1e-2, "bound"),
    Check("load of the base over weight", "1: smooth walls", "-", 1e-2, "relative"),
    Check("rise of energy over release", "none: first law", "-", RISE, "bound"),
)

COARSE = (*CHECKS[:2], replace(CHECKS[2], bar=2.0 * RISE))

ROUGH = (
    CHECKS[0],
    Check("load of the base over weight", "Janssen 1895", "-", 0.4, "relative"),
    CHECKS[2],
)

THRUST = (
    Check("thrust over that of a fluid, 1-10 ms", "Jaky 1944", "-", 0.2, "relative"),
    Check("its difference between steps over the mean", "none", "-", 0.1, "bound"),
)

CASES = (
    Case("silo", CHECKS, measure),
    Case("silo-thrust", THRUST, measure_thrust, slow=True),
    Case("silo-10ms", COARSE, measure, dt=0.01, slow=True),
    Case("silo-rough", ROUGH, measure_rough, slow=True),
    Case("silo-rough-10ms", ROUGH, measure_rough, dt=0.01, slow=True),
)
