"""A thin wall stops every fast block: nothing tunnels."""

from __future__ import annotations

import numpy as np
import pytest

from physics.helpers import FLAT, polygon, rock, rough
from rigdda import Block, Scene, Settings, Simulation, Terrain, Wall

WALL = Wall(x=10.0, height=20.0, thickness=0.3)


def shot(seed: int) -> Scene:
    """Return a random convex block that flies at a thin wall at 50 m/s."""
    rng = np.random.default_rng(seed)
    corners = rough(rng, int(rng.integers(3, 9)), rng.uniform(0.3, 1.5))
    turn = rng.uniform(0.0, 2.0 * np.pi)
    start = (rng.uniform(0.0, 6.0), rng.uniform(8.0, 12.0))
    climb = np.radians(rng.uniform(-30.0, 30.0))
    velocity = (50.0 * np.cos(climb), 50.0 * np.sin(climb), rng.uniform(-20.0, 20.0))
    block = Block(polygon(corners, start, turn), velocity=velocity)
    return Scene(Terrain(FLAT), (block,), rock(30.0, rng.uniform(0.0, 0.6)), barriers=(WALL,))


@pytest.mark.parametrize("batch", range(4))
def test_thin_wall_stops_fast_blocks(batch):
    for seed in range(10 * batch, 10 * batch + 10):
        sim = Simulation(shot(seed), Settings(dt=5e-3))
        for _ in range(100):
            sim.step()
            assert sim.poses[0, 0] < WALL.x, (seed, sim.time)
            assert sim.vertices(0)[:, 0].max() < WALL.x + DEEPEST, (seed, sim.time)
        run = sim.run(0.01)
        assert len(run.hits(0)) > 0, seed


DEEPEST = 0.15
"""Deepest that a vertex may be inside the wall at the end of a step [m], half its thickness."""
