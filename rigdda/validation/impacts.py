"""Impacts on the ground: prescribed restitution, and energy that never increases."""

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
    polygon,
    rock,
    rough,
)

DROP = 5.0
"""Height of the drops [m]."""

RESTITUTIONS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9)
HITS = 1_000
PHASES = (0.0, 0.2, 0.4, 0.6, 0.8)
STEPS = (1e-4, 3e-4, 1e-3, 3e-3, 5e-3, 1e-2)
DENSITIES = (1.0, 1e2, 1e4, 1e6)
"""Densities of blocks of 1 m2 [kg/m3], equal to their masses [kg/m]."""


def rebound(lab: Lab, restitution: float, dt: float, phase: float, density: float) -> float:
    """Return the restitution from the apex after a flat drop: sqrt(apex / drop).

    `phase` changes the height of the drop, which shifts the impact within its step.
    """
    drop = DROP + phase * dt * math.sqrt(2.0 * GRAVITY * DROP)
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
        for dt in STEPS
        for phase in PHASES
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
    gains = [greatest_gain(lab, oblique_hit(lab.random(hit)), 0.5) for hit in range(HITS)]
    return (Measured(gains),)


def restitution_case(e: float) -> Case:
    """Return the case of one coefficient."""
    check = Check("e from the apex", "e = sqrt(apex / drop)", "-", 0.02, "absolute")
    return Case(f"restitution-{e:g}", (check,), lambda lab: measure_restitution(lab, e))


CASES = (
    *(restitution_case(e) for e in RESTITUTIONS),
    Case(
        "eccentric-hits",
        # rounding errors of a sum of two squares over 100 steps
        (Check("gain of energy", "none: passive contact", "-", 1e-9, "bound"),),
        measure_hits,
    ),
)
