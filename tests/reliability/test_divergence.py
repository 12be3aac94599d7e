"""A simulation whose numbers go bad stops, and keeps what was sound."""

from __future__ import annotations

import numpy as np
import pytest
from physics.helpers import FLAT, box, rock

from rigdda import Diverged, Error, Scene, Settings, Simulation, SoftContacts, Terrain
from rigdda.dynamics.constants import SPEED_LIMIT

FAST = (1e6, 0.0, 0.0)


def test_run_keeps_its_frames():
    sim = Simulation(Scene(Terrain(FLAT), (box(0.0, 5.0, velocity=FAST),), rock()))
    with pytest.raises(Diverged, match=r"block 0 .*use a smaller dt") as caught:
        sim.run(1.0)
    assert isinstance(caught.value, Error)
    run = caught.value.run
    assert len(run.times) == len(run.poses) == len(run.velocities) == 1
    assert np.isfinite(run.poses).all()
    assert run.velocities[0, 0, 0] == 1e6


def test_frames_before_it_goes_bad():
    fast = box(velocity=(0.0, 10.0 - SPEED_LIMIT, 0.0))
    scene = Scene(None, (fast, box(5.0)), rock())
    with pytest.raises(Diverged) as caught:
        Simulation(scene).run(2.0)
    run = caught.value.run
    assert run.times[-1] > 0.5
    assert np.isfinite(run.poses).all()
    assert np.isfinite(run.velocities).all()


def test_step():
    with pytest.raises(Diverged):
        Simulation(Scene(None, (box(velocity=FAST),), rock())).step(10)


def test_the_error_names_the_contact_that_did_it():
    scene = Scene(None, (box(), box(2.0, velocity=(-2e4, 0.0, 0.0))), rock(), gravity=0.0)
    with pytest.raises(Diverged, match=r"pressed with .* N at .* by block [01]; use"):
        Simulation(scene).run(1.0)


def test_what_is_not_a_number_asks_for_no_smaller_step():
    sim = Simulation(Scene(Terrain(FLAT), (box(0.0, 0.5),), rock()))
    sim.step()
    sim.loop.arrays.bodies["vx"][0] = np.nan
    with pytest.raises(Diverged, match="another solver"):
        sim.step()


def test_contacts_too_soft_for_their_load_are_told():
    scene = Scene(Terrain(FLAT), tuple(box(0.0, 0.5 + i) for i in range(5)), rock())
    with pytest.warns(SoftContacts, match="smaller penetration"):
        Simulation(scene, Settings(penetration=0.02)).run(2.0)
    Simulation(scene).run(2.0)  # no warning by default
