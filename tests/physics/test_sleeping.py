"""A block that sleeps on a slope stays where it settled."""

from __future__ import annotations

import numpy as np
import pytest

from physics.helpers import FLAT, box, incline, rock
from rigdda import Scene, Settings, Simulation, Terrain


@pytest.mark.parametrize("friction", [30.5, 35.0])
def test_hold(friction):
    scene, _ = incline(30.0, friction)
    sim = Simulation(scene)
    start = sim.poses[0, :2]
    sim.step(200)
    settled = sim.poses[0, :2]
    sim.step(1800)
    assert np.linalg.norm(sim.poses[0, :2] - start) < 1e-4
    assert np.linalg.norm(sim.poses[0, :2] - settled) < 5e-9


def test_a_block_that_drifts_slowly_without_gravity_goes_on():
    speed = 0.01
    block = box(0.0, 10.0, 1.0, 1.0, velocity=(speed, 0.0, 0.0))
    scene = Scene(Terrain(FLAT), (block,), rock(), gravity=0.0)
    sim = Simulation(scene, Settings(dt=1e-2))
    start = sim.poses[0, 0]
    sim.step(300)
    assert sim.poses[0, 0] - start == pytest.approx(3.0 * speed, rel=1e-9)
