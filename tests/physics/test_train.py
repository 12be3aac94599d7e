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
def test_a_plastic_train_is_stopped_in_the_step_of_its_blow(dt):
    sim = Simulation(train(), Settings(dt=dt))
    sim.step(int(CLEARANCE / SPEED / dt) + 1)
    # sweeps go up and down, which does not help in a level row: a tenth is left
    assert np.abs(sim.velocities[:BLOCKS]).max() < 0.12 * SPEED
