"""Impacts: prescribed restitution, energy that never increases, and conserved momentum."""

from __future__ import annotations

import math

import numpy as np

from rigdda.model.scene import Block, Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import (
    FLAT,
    GRAVITY,
    box,
    kinetic_energy,
    masses,
    momentum,
    polygon,
    rock,
    rough,
)

DROP_HEIGHT = 5.0
"""Height of the drops [m]."""

RESTITUTIONS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9)
OBLIQUE_HITS = 1_000
IMPACT_PHASES = (0.0, 0.2, 0.4, 0.6, 0.8)
IMPACT_STEPS = (1e-4, 3e-4, 1e-3, 3e-3, 5e-3, 1e-2)
DENSITIES = (1.0, 1e2, 1e4, 1e6)
"""Densities of blocks of 1 m2 [kg/m3], equal to their masses [kg/m]."""


def rebound(lab: Lab, restitution: float, dt: float, phase: float, density: float) -> float:
    """Return the restitution from the apex after a flat drop: sqrt(apex / drop).

    `phase` changes the height of the drop, which shifts the impact within its step.
    """
    drop = DROP_HEIGHT + phase * dt * math.sqrt(2.0 * GRAVITY * DROP_HEIGHT)
    block = box(0.0, 0.5 + drop, density=density)
    sim = lab.simulate(Scene(Terrain(FLAT), (block,), rock(30.0, restitution)), dt)
    sim.step(math.floor(math.sqrt(2.0 * drop / GRAVITY) / dt) + 2)
    sim.step(max(0, math.floor(sim.velocities[0, 1] / (GRAVITY * dt)) - 1))
    before, apex = -math.inf, float(sim.poses[0, 1])
    while apex > before:
        sim.step()
        before, apex = apex, max(apex, float(sim.poses[0, 1]))
    return math.sqrt(max(apex - 0.5, 0.0) / drop)


def measure_restitution(lab: Lab, restitution: float) -> tuple[Measured]:
    """Drop a square flat, with all steps, phases and masses."""
    found = [
        rebound(lab, restitution, dt, phase, density)
        for dt in IMPACT_STEPS
        for phase in IMPACT_PHASES
        for density in DENSITIES
    ]
    return (Measured(found, restitution),)


def oblique_hit(rng: np.random.Generator) -> Scene:
    """Return a random block that hits flat ground obliquely, without gravity."""
    corners = polygon(rough(rng, int(rng.integers(3, 9))), (0.0, 1.5))
    restitution, friction = rng.uniform(0.0, 0.9), rng.uniform(0.0, 60.0)
    velocity = (rng.uniform(-15.0, 15.0), rng.uniform(-15.0, -1.0), rng.uniform(-10.0, 10.0))
    block = Block(corners, velocity=velocity)
    return Scene(Terrain(FLAT), (block,), rock(friction, restitution), gravity=0.0)


def greatest_gain(lab: Lab, scene: Scene, time: float) -> float:
    """Return the greatest rise of kinetic energy above its lowest so far, over the initial one."""
    sim = lab.simulate(scene, sleeping=False)
    mass, inertia = masses(scene)
    least = start = kinetic_energy(sim.velocities, mass, inertia)
    gain = 0.0
    for _ in range(lab.steps(time)):
        sim.step()
        now = kinetic_energy(sim.velocities, mass, inertia)
        gain, least = max(gain, now - least), min(least, now)
    return gain / start


def measure_hits(lab: Lab) -> tuple[Measured]:
    """Simulate impacts of random blocks on the ground."""
    gains = [greatest_gain(lab, oblique_hit(lab.random(hit)), 0.5) for hit in range(OBLIQUE_HITS)]
    return (Measured(gains),)


def restitution_case(e: float) -> Case:
    """Return the case of one coefficient."""
    check = Check("e from the apex", "e = sqrt(apex / drop)", "-", 0.02, "absolute")
    return Case(f"restitution-{e:g}", (check,), lambda lab: measure_restitution(lab, e))


IMPACTS = (
    *(restitution_case(e) for e in RESTITUTIONS),
    Case(
        "eccentric-hits",
        # rounding errors of a sum of two squares over 100 steps
        (Check("gain of energy", "none: passive contact", "-", 1e-9, "bound"),),
        measure_hits,
    ),
)


PAIRS = 300
"""Number of random pairs; blocks that separate in free space do not collide again."""

RINGS = 60
"""Number of random rings of each size."""


def pair(rng: np.random.Generator) -> Scene:
    """Return two random blocks that fly at each other."""
    blocks = []
    for side in (-1.0, 1.0):
        corners = polygon(rough(rng, int(rng.integers(3, 9))), (1.5 * side, rng.uniform(-0.5, 0.5)))
        velocity = (-side * rng.uniform(1.0, 10.0), *rng.uniform(-2.0, 2.0, 2))
        blocks.append(Block(corners, 10.0 ** rng.uniform(2.0, 4.0), velocity=velocity))
    surface = rock(rng.uniform(0.0, 60.0), rng.choice([0.0, 0.3, 0.6, 0.9]))
    return Scene(None, tuple(blocks), surface, gravity=0.0)


def ring(rng: np.random.Generator, count: int) -> Scene:
    """Return random blocks on a ring that fly inwards, so that several collide at once."""
    blocks = []
    for turn in 2.0 * np.pi * np.arange(count) / count:
        outward = np.array([np.cos(turn), np.sin(turn)])
        place = 1.3 * count / np.pi * rng.uniform(1.0, 1.3) * outward
        speed = -5.0 * rng.uniform(0.3, 1.0) * outward + rng.normal(size=2)
        velocity = (*speed, rng.uniform(-5.0, 5.0))
        corners = polygon(rough(rng, int(rng.integers(3, 9))), place)
        blocks.append(Block(corners, 10.0 ** rng.uniform(2.0, 4.0), velocity=velocity))
    surface = rock(rng.uniform(0.0, 60.0), rng.choice([0.0, 0.3, 0.6, 0.9]))
    return Scene(None, tuple(blocks), surface, gravity=0.0)


def drift(lab: Lab, scene: Scene) -> tuple[float, float, float]:
    """Return the greatest changes of linear and angular momentum and the growth of energy [-].

    Changes of momentum are relative to the sum of the magnitudes of momentum (with a lever arm of 1
    m). The growth of energy is above the lowest energy so far, so that small gains add up, relative
    to the initial energy.
    """
    sim = lab.simulate(scene, sleeping=False)
    linear, angular, start = momentum(sim)
    scale = float((masses(scene)[0] * np.hypot(*sim.velocities[:, :2].T)).sum())
    least, worst = start, np.zeros(3)
    for _ in range(lab.steps(1.5)):
        sim.step()
        now, spin, energy = momentum(sim)
        change = float(np.linalg.norm(now - linear)) / scale, abs(spin - angular) / scale
        worst = np.maximum(worst, (*change, (energy - least) / start))
        least = min(least, energy)
    return float(worst[0]), float(worst[1]), float(worst[2])


def measure_pairs(lab: Lab) -> list[Measured]:
    """Simulate the collisions of all pairs."""
    columns = zip(*(drift(lab, pair(lab.random(i))) for i in range(PAIRS)), strict=True)
    return [Measured(column) for column in columns]


def measure_rings(lab: Lab) -> list[Measured]:
    """Simulate the collisions of rings of three and six blocks."""
    rings = [ring(lab.random(count, i), count) for count in (3, 6) for i in range(RINGS)]
    linear, angular, gain = zip(*(drift(lab, scene) for scene in rings), strict=True)
    return [Measured(linear), Measured(angular), Measured(gain)]


COLLISIONS = (
    Case(
        "collisions",
        (
            Check("momentum", "none: Newton III", "-", 1e-10, "bound"),
            Check("angular momentum", "none: Newton III", "-", 1e-6, "bound"),
            Check("gain of energy", "none: passive contact", "-", 1e-9, "bound"),
        ),
        measure_pairs,
    ),
    Case(
        "collisions-many",
        (
            Check("momentum", "none: Newton III", "-", 1e-10, "bound"),
            Check("angular momentum", "none: Newton III", "-", 1e-4, "bound"),
            Check("gain of energy", "none: passive contact", "-", 1e-4, "bound"),
        ),
        measure_rings,
    ),
)
