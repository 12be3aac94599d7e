"""Piles that fall into a hopper do not sink into one another."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.hard_cases.ground import rubble
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.validation.scenes import rock

COUNT, WIDE = 300, 15
"""Number of blocks of about 1 m, and how many fall side by side."""


@pytest.mark.parametrize("seed", range(3))
def test_a_pile_that_collapses_sinks_little(seed):
    """Mean over 5 s of the deepest contact, below 1/1000 of a block.

    If closing velocities below the tolerance of the sweeps were impacts, it would be 1.5 mm.
    """
    rng = np.random.default_rng(seed)
    chain = [(-30.0, 90.0), (-30.0, 30.0), (-3.0, 0.0), (3.0, 0.0), (30.0, 30.0), (30.0, 90.0)]
    blocks = tuple(
        Block(rubble(rng) + np.array([2.2 * (i % WIDE) - 15.4, 22.0 + 2.2 * (i // WIDE)]))
        for i in range(COUNT)
    )
    sim = Simulation(Scene(Terrain(chain), blocks, rock(28.0, 0.2)), Settings(dt=5e-3))
    depths = []
    for _ in range(50):
        sim.step(20)
        depths.append(float(sim.contacts()["penetration"].max(initial=0.0)))
    assert np.mean(depths) < 1e-3, depths
