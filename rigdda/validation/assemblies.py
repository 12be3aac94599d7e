"""Many blocks at rest: stacks of cubes, silos and a masonry arch.

- Stacks of cubes stay at rest.
- A deep pile of polygons between walls comes to rest with the correct load on its base.
- A semicircular arch stands under its own weight, or falls if it is too thin (Milankovitch 1907;
  Heyman 1969).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rigdda.geometry import polygon_properties
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, GRAVITY, box, rock

CUBE_OFFSET = 1e-4
"""Greatest random horizontal offset of a cube [m]."""

PYRAMID_SPACING = 1.1
"""Spacing of the cubes in a row of the pyramid [m], such that neighbours do not touch."""


def tower(rng: np.random.Generator, count: int) -> tuple[Block, ...]:
    """Return a tower of one-metre cubes, slightly out of line."""
    return tuple(
        box(x, 0.5 + i) for i, x in enumerate(rng.uniform(-CUBE_OFFSET, CUBE_OFFSET, count))
    )


def pyramid(rng: np.random.Generator, rows: int) -> tuple[Block, ...]:
    """Return rows of cubes, each with one cube less, placed on the gaps of the row below."""
    return tuple(
        box(PYRAMID_SPACING * (i + 0.5 * row) + rng.uniform(-CUBE_OFFSET, CUBE_OFFSET), 0.5 + row)
        for row in range(rows)
        for i in range(rows - row)
    )


def heavy_on_light(rng: np.random.Generator, ratio: float) -> tuple[Block, ...]:
    """Return a cube of 2.6 t on a cube whose mass is smaller by the factor `ratio`."""
    low, high = rng.uniform(-CUBE_OFFSET, CUBE_OFFSET, 2)
    return box(low, 0.5, density=2600.0 / ratio), box(high, 1.5)


def measure_stack(lab: Lab, blocks: Sequence[Block]) -> tuple[Measured, Measured, Measured]:
    """Simulate blocks at rest for 60 s without sleeping, and their speed over the last 10 s."""
    sim = lab.simulate(Scene(Terrain(FLAT), tuple(blocks), rock()), sleeping=False)
    start = sim.poses[:, :2]
    sim.step(lab.steps(50.0))
    speed = 0.0
    for _ in range(lab.steps(10.0) // 10):
        sim.step(10)
        speed = max(speed, float(np.hypot(*sim.velocities[:, :2].T).max()))
    moved = np.hypot(*(sim.poses[:, :2] - start).T)
    return Measured(moved), Measured(speed), Measured(sim.diagnostics.penetration)


def stack_case(
    name: str, make: Callable[[np.random.Generator], Sequence[Block]], deepest: float, slow: bool
) -> Case:
    """Return the case of blocks whose penetration must not exceed `deepest` [m]."""
    return Case(
        name,
        (
            Check("displacement", "none: it stands", "m", 0.02, "bound"),
            Check("speed at end", "none: it is at rest", "m/s", 1e-4, "bound"),
            Check("penetration", "none: rigid", "m", deepest, "bound"),
        ),
        lambda lab: measure_stack(lab, make(lab.random())),
        slow=slow,
    )


STACKS = (
    stack_case("stack-10", lambda rng: tower(rng, 10), 1e-3, False),
    stack_case("stack-25", lambda rng: tower(rng, 25), 1e-3, False),
    stack_case("stack-50", lambda rng: tower(rng, 50), 4e-4, False),
    stack_case("stack-100", lambda rng: tower(rng, 100), 1e-4, True),
    stack_case("pyramid-55", lambda rng: pyramid(rng, 10), 1e-3, False),
    stack_case("mass-1-100", lambda rng: heavy_on_light(rng, 100.0), 1e-3, False),
    stack_case("mass-1-1000", lambda rng: heavy_on_light(rng, 1000.0), 5e-3, False),
)


SILO_WIDTH, POLYGON_SIZE = 2.0, 0.3
"""Width of the silo and size of its polygons [m]."""

POLYGONS_PER_LAYER, LAYER_SPACING = 6, 1.25
"""Number of polygons in a layer, and height of a layer over polygon size [-]."""

FILLING_TIME = 20.0
"""Time in which a pile must come to rest [s]."""

DEPTHS = (20, 40, 60)
"""Numbers of layers."""

WALL_DEG, FILLINGS = 20.0, 5
"""Friction angle of rough walls [deg], and number of fillings that are averaged."""

SMOOTH_FILLINGS = 30
"""Number of fillings between smooth walls that are averaged."""

SILO_STEPS = (1e-3, 2.5e-3, 5e-3, 1e-2)
"""Steps for which the thrust is compared [s]; the longest permitted one is 13 ms."""

JAKY = 0.5
"""Ratio of horizontal to vertical pressure of rock of 30 deg at rest, 1 - sin phi [-]."""

SAMPLING_INTERVAL = 0.02
"""Interval at which the energy is sampled [s]."""

RISE_TOLERANCE = 2e-3
"""Tolerance of the rise of energy over the released energy [-]. Position correction removes
penetration from the impacts of layers and thereby lifts the layers above. The rise is smaller for
shorter steps and greater for deeper piles."""


def pebble(rng: np.random.Generator, x: float, y: float) -> Block:
    """Return a random polygon of four to seven corners, at most 1.15 `POLYGON_SIZE` wide."""
    n = int(rng.integers(4, 8))
    angle = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) * 2.0 * np.pi / n + rng.uniform(0.0, 6.28)
    angle = np.sort(np.mod(angle, 2.0 * np.pi))
    radius = 0.5 * POLYGON_SIZE * rng.uniform(0.85, 1.15, n)
    return Block(np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1))


def silo(rng: np.random.Generator, layers: int, friction_deg: float = 0.0) -> Scene:
    """Return loose layers of polygons above the base; walls and base have this friction angle."""
    height, column = LAYER_SPACING * POLYGON_SIZE, SILO_WIDTH / POLYGONS_PER_LAYER
    blocks = tuple(
        pebble(rng, (i + 0.5) * column, 0.2 + j * height)
        for j in range(layers)
        for i in range(POLYGONS_PER_LAYER)
    )
    top = layers * height + 5.0
    chain = [
        (-1.0, top),
        (0.0, top),
        (0.0, 0.0),
        (SILO_WIDTH, 0.0),
        (SILO_WIDTH, top),
        (SILO_WIDTH + 1.0, top),
    ]
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
    """Fill a silo, with the step of the lab or `dt`, and sample its energy."""
    sim = lab.simulate(scene, dt)
    stride = round(SAMPLING_INTERVAL / sim.settings.dt)
    energies = []
    for _ in range(round(FILLING_TIME / SAMPLING_INTERVAL)):
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
    depth = float(np.sort(sim.poses[:, 1])[-POLYGONS_PER_LAYER:].mean() + 0.5 * POLYGON_SIZE)
    walls = 0.5 * ground[np.abs(ground["nx"]) > 0.7]["normal_force"].sum()
    fluid = 0.5 * weight / SILO_WIDTH * depth
    return Filled(speed, float(base), float(walls / fluid), rise, depth)


def measure_silo(lab: Lab) -> tuple[Measured, ...]:
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
    for dt in SILO_STEPS:
        found = [fill(lab, silo(lab.random(20, k), 20), dt) for k in range(SMOOTH_FILLINGS)]
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
    w = 2.0 * JAKY * math.tan(math.radians(WALL_DEG)) * depth / SILO_WIDTH
    return (
        Measured([f.speed for f in found]),
        Measured(base, -math.expm1(-w) / w),
        Measured([f.rise for f in found]),
    )


SILO_CHECKS = (
    Check("speed after 20 s", "none: it is at rest", "m/s", 1e-2, "bound"),
    Check("load of the base over weight", "1: smooth walls", "-", 1e-2, "relative"),
    Check("rise of energy over release", "none: first law", "-", RISE_TOLERANCE, "bound"),
)

COARSE_CHECKS = (*SILO_CHECKS[:2], replace(SILO_CHECKS[2], bar=2.0 * RISE_TOLERANCE))

ROUGH_CHECKS = (
    SILO_CHECKS[0],
    Check("load of the base over weight", "Janssen 1895", "-", 0.4, "relative"),
    SILO_CHECKS[2],
)

THRUST_CHECKS = (
    Check("thrust over that of a fluid, 1-10 ms", "Jaky 1944", "-", 0.2, "relative"),
    Check("its difference between steps over the mean", "none", "-", 0.1, "bound"),
)

SILOS = (
    Case("silo", SILO_CHECKS, measure_silo),
    Case("silo-thrust", THRUST_CHECKS, measure_thrust, slow=True),
    Case("silo-10ms", COARSE_CHECKS, measure_silo, dt=0.01, slow=True),
    Case("silo-rough", ROUGH_CHECKS, measure_rough, slow=True),
    Case("silo-rough-10ms", ROUGH_CHECKS, measure_rough, dt=0.01, slow=True),
)


RADIUS, VOUSSOIRS = 10.0, 22
"""Mean radius [m] and number of blocks."""


def arch(ratio: float) -> tuple[Block, ...]:
    """Return blocks with radial joints and a thickness of `ratio` times the mean radius."""
    thickness = ratio * RADIUS
    inner, outer = RADIUS - 0.5 * thickness, RADIUS + 0.5 * thickness
    angle = np.linspace(0.0, math.pi, VOUSSOIRS + 1)
    joint = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    joint[-1, 1] = 0.0  # both springings exactly on the ground
    return tuple(Block([inner * p, outer * p, outer * q, inner * q]) for p, q in pairwise(joint))


def drop(lab: Lab, ratio: float, time: float) -> float:
    """Return the settlement of the crown after `time` [m]."""
    blocks = arch(ratio)
    sim = lab.simulate(Scene(Terrain(FLAT), blocks, rock(60.0)), sleeping=False)
    crown = VOUSSOIRS // 2
    start = sim.poses[crown, 1]
    sim.step(lab.steps(time))
    return float(start - sim.poses[crown, 1])


ARCHES = (
    Case(
        "arch-stands",
        (Check("sinks at 0.115 by", "none: limit 0.1068", "m", 0.05, "bound"),),
        lambda lab: (Measured(abs(drop(lab, 0.115, 30.0))),),
    ),
    Case(
        "arch-falls",
        # the crown of a collapsed arch lies below half its height
        (Check("falls at 0.095", "yes: limit 0.1068", "-", 0.0, "absolute"),),
        lambda lab: (Measured(float(drop(lab, 0.095, 30.0) > 0.5 * RADIUS), 1.0),),
    ),
)
