"""The thrust of a pile on smooth walls does not depend on the step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import GRAVITY, masses, rock
from rigdda import Block, Scene, Settings, Simulation, Surface, Terrain
from rigdda.validation.assemblies import POLYGONS_PER_LAYER, SILO_WIDTH, silo

LAYERS, FILLINGS, TOP = 11, 24, 8.0
"""Layers of blocks of 0.3 m, number of fillings that are averaged, and height of the walls [m]."""


def between_fixed_blocks(seed: int) -> Scene:
    """Return loose layers of blocks over rough ground, between smooth walls that are fixed."""
    loose = silo(np.random.default_rng(seed), LAYERS).blocks
    walls = [
        Block(
            [(x, 0.0), (x + 1.0, 0.0), (x + 1.0, TOP), (x, TOP)],
            fixed=True,
            surface="wall",
        )
        for x in (-1.0, SILO_WIDTH)
    ]
    smooth = Surface(0.0)
    return Scene(
        Terrain([(-5.0, 0.0), (8.0, 0.0)]),
        (*loose, *walls),
        rock() | {"wall": smooth},
        interfaces={("rock", "wall"): smooth},
    )


def thrust(dt: float, seed: int) -> float:
    """Return the mean thrust on a wall in the sixth second over that of a fluid [-]."""
    scene, count = between_fixed_blocks(seed), LAYERS * POLYGONS_PER_LAYER
    sim = Simulation(scene, Settings(dt=dt, sleeping=False))
    sim.step(round(5.0 / dt))
    forces = []
    for _ in range(20):
        sim.step(round(0.05 / dt))
        found = sim.contacts()
        fixed = (found["block_a"] >= count) | (found["block_b"] >= count)
        forces.append(0.5 * found["normal_force"][fixed].sum())
    depth = max(sim.vertices(i)[:, 1].max() for i in range(count))
    weight = GRAVITY * masses(scene)[0][:count].sum()
    return float(np.mean(forces) * 2.0 * SILO_WIDTH / (weight * depth))


@pytest.mark.slow
def test_the_thrust_of_a_pile_is_the_same_at_2_5_and_12_ms():
    """Within 15 % and what chance allows: single fillings scatter by 0.1."""
    found = [np.array([thrust(dt, k) for k in range(FILLINGS)]) for dt in (2e-3, 5e-3, 1.2e-2)]
    means = np.array([one.mean() for one in found])
    chance = 2.0 * max(one.std(ddof=1) for one in found) * math.sqrt(2.0 / FILLINGS)
    assert np.ptp(means) < 0.15 * means.mean() + chance, (means, chance)
