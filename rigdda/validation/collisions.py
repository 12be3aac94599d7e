"""Blocks that spin and collide in free space conserve momentum, in pairs and in larger groups."""

from __future__ import annotations

import numpy as np

from rigdda.model.scene import Block, Scene
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import masses, momentum, polygon, rock, rough

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


def measure(lab: Lab) -> list[Measured]:
    """Simulate the collisions of all pairs."""
    columns = zip(*(drift(lab, pair(lab.random(i))) for i in range(PAIRS)), strict=True)
    return [Measured(column) for column in columns]


def measure_rings(lab: Lab) -> list[Measured]:
    """Simulate the collisions of rings of three and six blocks."""
    rings = [ring(lab.random(count, i), count) for count in (3, 6) for i in range(RINGS)]
    linear, angular, gain = zip(*(drift(lab, scene) for scene in rings), strict=True)
    return [Measured(linear), Measured(angular), Measured(gain)]


CASES = (
    Case(
        "collisions",
        (
            Check("momentum", "none: Newton III", "-", 1e-10, "bound"),
            Check("angular momentum", "none: Newton III", "-", 1e-6, "bound"),
            Check("gain of energy", "none: passive contact", "-", 1e-9, "bound"),
        ),
        measure,
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
