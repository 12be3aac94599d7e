"""A block that sleeps on a slope stays where it settled."""

from __future__ import annotations

import numpy as np
import pytest

from physics.helpers import incline
from rigdda import Simulation


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
