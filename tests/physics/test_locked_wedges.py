"""Blocks that lock in a notch by friction: forces and energies stay bounded."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import masses, polygon, rough
from rigdda import Block, Fence, Scene, Settings, Simulation, Surface, Terrain, Wall

KINDS = {
    "fence": (Fence(-3.0, 3.0, 2.0e6, elongation=5.0), 60.0),
    "wall": (Wall(-3.0, 3.0, 0.3), 45.0),
}


def dropped(kind: str, seed: int, dt: float) -> tuple[float, float]:
    """Return the energy that a barrier absorbs over that of the fall, and its thrust over weight.

    A polygon falls into the notch between a slope and a barrier.
    """
    barrier, steep = KINDS[kind]
    rng, rise = np.random.default_rng(seed), math.tan(math.radians(steep))
    corners = rough(rng, int(rng.integers(4, 8)), 0.25)
    start = -3.45, 3.0 * rise + 2.2
    velocity = rng.uniform(0.0, 2.0), -2.0, rng.uniform(-5.0, 5.0)
    block = Block(polygon(corners, start, rng.uniform(0.0, 6.0)), velocity=velocity)
    ground = Terrain([(-20.0, 20.0 * rise), (0.0, 0.0), (30.0, 0.0)])
    surface = Surface(35.0, restitution=0.3, rolling=0.05)
    scene = Scene(ground, (block,), {"rock": surface}, barriers=(barrier,))
    mass = masses(scene)[0][0]
    run = Simulation(scene, Settings(dt=dt)).run(4.0)
    fall = 0.5 * mass * 8.0 + mass * 9.81 * 3.0
    return float(run.absorbed[0]) / fall, float(run.thrust[0]) / (mass * 9.81)


@pytest.mark.parametrize("dt", [0.02, 0.01, 0.0025])
@pytest.mark.parametrize("kind", KINDS)
def test_forces_and_energies_of_a_wedge_are_bounded(kind: str, dt: float) -> None:
    """The sweeps of a locked wedge do not converge, so that a few of its impulses are too large.

    Without a bound, they are 1e13 times the weight.
    """
    absorbed, thrust = np.array([dropped(kind, seed, dt) for seed in range(60)]).T
    assert np.median(absorbed) < 1.0 and (np.abs(absorbed) > 1.0).sum() <= 2
    assert np.median(thrust) < 2.0 and np.quantile(thrust, 0.95) < 50.0
    assert np.abs(absorbed).max() < 50.0 and thrust.max() < 5000.0
