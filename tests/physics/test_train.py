"""A train of blocks that runs into a wall: its blow stops all of them, whatever the step."""

from __future__ import annotations

import numpy as np
import pytest

from rigdda import Scene, Settings, Simulation
from rigdda.validation.scenes import box, rock

SPEED, BLOCKS, CLEARANCE = 10.0, 10, 0.02
V = SPEED, 0.0, 0.0


def train() -> Scene:
    """Return blocks that touch in a row, without weight, and a fixed one that they run into."""
    row = [box(1.0 * i, 0.0, height=1.0 + 0.2 * (i % 2), velocity=V) for i in range(BLOCKS)]
    wall = box(BLOCKS + CLEARANCE, 0.0, height=4.0, fixed=True)
    return Scene(None, (*row, wall), rock(), gravity=0.0)


@pytest.mark.parametrize("dt", [1e-3, 2.5e-3, 5e-3, 1e-2, 2e-2])
def test_a_plastic_train_is_stopped_by_its_blow(dt):
    sim = Simulation(train(), Settings(dt=dt))
    # a blow at the end of a step is felt by the last block in the next one
    sim.step(int(CLEARANCE / SPEED / dt) + 2)
    # sweeps go up and down, which does not help in a level row: a sixth is left, as rebound
    assert np.abs(sim.velocities[:BLOCKS]).max() < 0.17 * SPEED
    assert sim.diagnostics.penetration < 1.2e-3
