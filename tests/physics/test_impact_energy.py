"""Blocks that meet in free space do not gain energy, whatever restitution and friction."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import momentum, polygon, rock, rough
from rigdda import Block, Scene, Settings, Simulation

RESTITUTIONS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9)


def crowd(seed: int, count: int, restitution: float | None = None) -> Scene:
    """Return random blocks on a ring that fly at one another, in free space."""
    rng = np.random.default_rng(seed)
    e, friction = rng.choice(RESTITUTIONS), rng.uniform(0.0, 60.0)
    ring = 1.3 if count == 2 else 1.3 * count / math.pi
    blocks = []
    for i in range(count):
        turn = 2.0 * math.pi * i / count
        outward = np.array([math.cos(turn), math.sin(turn)])
        corners = polygon(rough(rng, rng.integers(3, 9)), ring * rng.uniform(1.0, 1.3) * outward)
        velocity = -5.0 * rng.uniform(0.3, 1.0) * outward + rng.normal(size=2)
        spin = rng.uniform(-5.0, 5.0)
        blocks.append(Block(corners, 10.0 ** rng.uniform(2.0, 4.0), velocity=(*velocity, spin)))
    surfaces = rock(friction, e if restitution is None else restitution)
    return Scene(None, blocks, surfaces, gravity=0.0)


def greatest_gain(scene: Scene, steps: int = 300) -> float:
    """Return the greatest growth of kinetic energy in a step, over the energy at the start."""
    sim = Simulation(scene, Settings(sleeping=False))
    start = before = momentum(sim)[2]
    gain = -math.inf
    for _ in range(steps):
        sim.step()
        now = momentum(sim)[2]
        gain = max(gain, now - before)
        before = now
    return gain / start


@pytest.mark.parametrize("count", [2, 3, 6])
@pytest.mark.parametrize("restitution", [0.0, None])
def test_blocks_in_free_space(count, restitution):
    gains = {seed: greatest_gain(crowd(seed, count, restitution)) for seed in range(1000, 1060)}
    # contacts that rested give back their elastic energy, 4e-9; several blocks at once are relaxed,
    # not solved: present bound; the aim is that of two blocks
    bound = 1e-8 if count == 2 else 5e-3
    assert max(gains.values()) < bound, max(gains, key=gains.get)
