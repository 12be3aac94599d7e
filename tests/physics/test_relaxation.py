"""The forces of islands in motion: how closely they are settled, and that they obey their law."""

from __future__ import annotations

import numpy as np
import pytest

from rigdda import Settings, Simulation, Site
from rigdda.constants import MOVING, OPEN, RELAXATION_SPEED
from rigdda.records import CONTACTS

FALL = 3.0
"""Simulated time in which the rock of `quick` falls [s]."""


def falling(dt: float, tolerance: float | None) -> Simulation:
    """Return the rock of `quick` in its fall."""
    scene = Site.load("quick").realise(seed=3)
    sim = Simulation(scene, Settings(dt=dt, sweep_tolerance=tolerance))
    sim.step(round(FALL / dt))
    assert sim.diagnostics.sweeps > 0
    return sim


@pytest.mark.parametrize(("dt", "tolerance"), [(5e-3, RELAXATION_SPEED), (0.02, 0.5 * 9.81 * 0.02)])
def test_the_usual_tolerance_is_that_of_the_step(dt: float, tolerance: float) -> None:
    usual, given = falling(dt, None), falling(dt, tolerance)
    assert usual.scene.gravity_vector == pytest.approx((0.0, -9.81))
    np.testing.assert_array_equal(usual.poses, given.poses)
    assert usual.diagnostics.sweeps == given.diagnostics.sweeps
    closer = falling(dt, 1e-3)
    assert closer.diagnostics.sweeps > given.diagnostics.sweeps


@pytest.mark.parametrize("dt", [5e-3, 0.02])
def test_forces_of_an_avalanche_press_and_stay_within_friction(dt: float) -> None:
    sim = Simulation(Site.load("quick").realise(seed=3), Settings(dt=dt))
    tried = 0
    for _ in range(round(FALL / dt)):
        sim.step()
        c = sim._now[: sim._counters[CONTACTS]]
        c = c[(c["kind"] == MOVING) & (c["state"] != OPEN)]
        limit = c["friction"] * c["normal"] + c["cohesion"]
        assert (c["normal"] >= 0.0).all()
        assert (np.abs(c["shear"]) <= limit * (1.0 + 1e-12)).all()
        tried += len(c)
    assert tried > 100
