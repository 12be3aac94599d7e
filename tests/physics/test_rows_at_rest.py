"""Rows of blocks whose forces balance to nothing: no solver divides zero by zero."""

from __future__ import annotations

import numpy as np
import pytest

from physics.helpers import FLAT, box, rock
from rigdda import Block, Scene, Settings, Simulation, Terrain

SOLVERS = ("pcg", "block-pcg", "sor", "direct")


def row(velocity: float = 0.0) -> tuple[Block, ...]:
    return tuple(box(float(i), 0.5, velocity=(velocity, 0.0, 0.0)) for i in range(5))


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_row_without_friction_that_is_struck(solver):
    """It moves on; the direct solution gives 0.37 m/s, the speed of a plastic blow is 0.33 m/s."""
    striking = box(-3.0, 0.5, velocity=(2.0, 0.0, 0.0))
    scene = Scene(Terrain(FLAT), (striking, *row()), rock(0.0))
    sim = Simulation(scene, Settings(solver=solver))
    sim.run(3.0)
    assert abs(sim.velocities[:, 0].mean() - 1.0 / 3.0) < 1e-6
    assert np.abs(sim.velocities[:, 1:]).max() < 1e-6


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_row_whose_motion_dies_away(solver):
    """Damped in free space for so long that the squares of its velocities underflow."""
    scene = Scene(None, row(1.0), rock(), gravity=0.0, damping=10.0)
    sim = Simulation(scene, Settings(solver=solver))
    sim.run(60.0, 1.0)
    assert np.abs(sim.velocities).max() < 1e-200
