"""What must not matter does not: where the origin is, the order of blocks, left and right."""

from __future__ import annotations

import numpy as np
import pytest

from physics.helpers import polygon, rock, rough
from rigdda import Block, Scene, Simulation, Terrain

SLOPE = np.array([(-40.0, 30.0), (-10.0, 8.0), (0.0, 5.0), (30.0, -10.0), (80.0, -12.0)])
STEPS = 120
"""The blocks bounce on the terrain, spin and slide, and have not met yet."""


def parts() -> list[tuple[np.ndarray, tuple[float, float, float]]]:
    """Return corners and velocities of four blocks that are well apart."""
    rng = np.random.default_rng(5)
    places = [(-30.0, 24.2), (-12.0, 11.5), (5.0, 4.5), (22.0, -4.0)]
    return [
        (polygon(rough(rng, n), p), (2.0, -1.0, w))
        for n, p, w in zip((4, 5, 6, 7), places, (0.5, -0.5, 1.0, 0.0), strict=True)
    ]


def flight(change=lambda p: p, mirror=False, order=range(4), offset=0.0) -> np.ndarray:
    """Return poses after the flight of the changed scene, in the order of `parts`."""
    sign = -1.0 if mirror else 1.0
    blocks = []
    for i in order:
        corners, (vx, vy, omega) = parts()[i]
        blocks.append(Block(change(corners), velocity=(sign * vx, vy, sign * omega)))
    chain = change(SLOPE)
    terrain = Terrain(chain[::-1] if mirror else chain)
    sim = Simulation(Scene(terrain, blocks, rock(30.0, 0.3), damping=0.2))
    for _ in range(STEPS):
        sim.step()
        assert (sim.contacts()["block_b"] == -1).all()
    poses = np.empty((4, 3))
    poses[list(order)] = sim.poses
    return poses


@pytest.fixture(scope="module")
def plain():
    return flight()


def test_blocks_did_meet_the_ground(plain):
    fall = plain[:, 1] - np.array([p[0][:, 1].mean() for p in parts()])
    assert (fall > -0.5 * 9.81 * (STEPS * 5e-3) ** 2 - 2.0).all()
    assert np.ptp(plain[:, 2]) > 0.1


@pytest.mark.parametrize("shift", [(1000.0, 0.0), (0.0, -3000.0), (5000.0, 2000.0)])
def test_shift(plain, shift):
    moved = flight(lambda p: p + shift) - [*shift, 0.0]
    assert np.abs(moved - plain).max() < 1e-6


def test_order(plain):
    assert np.abs(flight(order=(2, 0, 3, 1)) - plain).max() < 1e-12


def test_mirror(plain):
    mirrored = flight(lambda p: p * [-1.0, 1.0], mirror=True) * [-1.0, 1.0, -1.0]
    assert np.abs(mirrored - plain).max() < 1e-6
