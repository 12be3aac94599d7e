"""Damping does not change the forces of what is at rest."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, GRAVITY, box, incline, masses, rock
from physics.steps import STEPS, each
from rigdda import Scene, Settings, Simulation, Terrain

STACK = tuple(box(0.0, 0.5 + i) for i in range(3))
SLOPE = incline(20.0, 30.0)[0]
SCENES = {
    "single": (Terrain(FLAT), STACK[:1], 1.0),
    "stack": (Terrain(FLAT), STACK, 1.0),
    "slope": (SLOPE.terrain, SLOPE.blocks, math.cos(math.radians(20.0))),
}
"""Ground, blocks and the share of their weight that presses on the ground."""


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("damping", [0.5, 5.0])
@pytest.mark.parametrize("name", SCENES)
def test_damping_does_not_change_forces_at_rest(name, damping, dt):
    """After the first step, after ten and after a second; also with the contacts between blocks."""
    terrain, blocks, share = SCENES[name]
    scene = Scene(terrain, blocks, rock(30.0), damping=damping)
    sim = Simulation(scene, Settings(dt=dt, sleeping=False))
    weight = GRAVITY * share * np.cumsum(masses(scene)[0][::-1])[::-1]
    for steps in (1, 9, round(1.0 / dt) - 10):
        sim.step(steps)
        found = sim.contacts()
        for i in range(len(blocks)):  # the force on block i from what is below it
            pair = {i, i - 1}
            below = [{int(c["block_a"]), int(c["block_b"])} == pair for c in found]
            assert found["normal_force"][below].sum() == pytest.approx(weight[i], rel=1e-5)
    if share < 1.0:
        along = abs(found["shear_force"].sum())
        assert along == pytest.approx(weight[0] * math.tan(math.radians(20.0)), rel=1e-5)
