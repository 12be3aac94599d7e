"""What a simulation tells of its computation."""

from __future__ import annotations

import pytest

from physics.helpers import FLAT, box, rock
from rigdda import Scene, Settings, Simulation, Terrain

STACK = Scene(Terrain(FLAT), tuple(box(0.0, 0.5 + i) for i in range(5)), rock())


def test_the_processor_time_of_all_steps_is_told():
    sim = Simulation(STACK, Settings(sleeping=False))
    sim.step(200)
    some = sim.diagnostics.seconds
    sim.step(200)
    assert 0.0 < some < sim.diagnostics.seconds < 10.0


def test_compression_is_that_of_the_lowest_contact():
    """The stiffness of a contact is chosen for the wanted penetration under its load."""
    sim = Simulation(STACK, Settings(penetration=2e-4))
    sim.step(400)
    assert sim.diagnostics.compression == pytest.approx(2e-4, rel=0.05)


def test_what_leaves_the_site_takes_its_energy_along():
    scene = Scene(
        Terrain([(-5.0, 0.0), (1.0, 0.0)]), (box(0.0, 0.5, velocity=(8.0, 0.0, 0.0)),), rock()
    )
    sim = Simulation(scene)
    before = sim.energy()
    sim.step(800)
    after = sim.energy()
    assert after.kinetic == 0.0 and (sim.velocities == 0.0).all()
    assert sim.poses[0, 1] < -20.0
    work = after.friction + after.damping + after.impact + after.external
    gained = after.kinetic + after.potential - before.kinetic - before.potential
    assert gained == pytest.approx(work, rel=1e-6)
