"""A block rebounds the same from terrain, from one fixed block and from two, side by side."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, ngon, rock
from rigdda import Block, Scene, Settings, Simulation, Terrain


def fixed(left: float, right: float) -> Block:
    corners = [(left, -1.0), (right, -1.0), (right, 0.0), (left, 0.0)]
    return Block(corners, fixed=True)


GROUNDS = {"one": (fixed(-5.0, 5.0),), "two": (fixed(-5.0, 0.0), fixed(0.0, 5.0))}


def rebound(ground: str, seed: int, beside: float, dt: float) -> np.ndarray:
    """Return the velocity three steps after a polygon has struck the ground with a corner.

    `beside` is where, to the right of the seam [m].
    """
    rng = np.random.default_rng(seed)
    corners = ngon(4 + seed % 5, 0.7, angle=rng.uniform(0.0, 2.0 * math.pi))
    corners -= corners[corners[:, 1].argmin()]
    corners += (beside, rng.uniform(0.8, 0.85))
    blocks = (Block(corners, velocity=(0.0, -3.0, 0.0)), *GROUNDS.get(ground, ()))
    terrain = Terrain(FLAT) if ground == "terrain" else None
    sim = Simulation(Scene(terrain, blocks, rock(30.0, 0.5)), Settings(dt=dt, sleeping=False))
    before = -3.0
    while sim.velocities[0, 1] <= before and sim.time < 1.0:  # it falls until it strikes
        before = sim.velocities[0, 1]
        sim.step()
    sim.step(3)
    return sim.velocities[0]


@pytest.mark.parametrize("dt", [1e-3, 5e-3, 1e-2])
def test_terrain_and_a_fixed_block(dt):
    for seed in range(40):
        off = rebound("terrain", seed, 0.0, dt) - rebound("one", seed, 0.0, dt)
        assert np.abs(off).max() < 1e-3, seed


@pytest.mark.parametrize("dt", [5e-3, 1e-2])
@pytest.mark.parametrize("beside", [0.0, 1e-6, 1e-5, 1e-4])
def test_the_seam_of_two_fixed_blocks(beside, dt):
    off = [rebound("one", k, beside, dt) - rebound("two", k, beside, dt) for k in range(40)]
    apart = np.abs(off).max(axis=1)
    # a corner of a block may touch the slanting edge beside the corner that lands, a moment before
    assert (apart > 0.1).sum() <= 1 and apart.max() < 0.3
