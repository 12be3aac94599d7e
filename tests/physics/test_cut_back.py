"""Islands whose corners would move too far in a step take shorter ones; the others do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, box, rock
from rigdda import Scene, Settings, Simulation, Terrain
from rigdda.validation import walls
from rigdda.validation.case import Lab

LONG = 0.1


def test_only_the_island_that_goes_too_far_is_cut_back():
    still = tuple(box(-10.0, 0.5 + i) for i in range(3))
    thrown = box(5.0, 3.0, velocity=(30.0, -20.0, 3.0))
    sim = Simulation(Scene(Terrain(FLAT), (*still, thrown), rock()), Settings(dt=LONG))
    alone = Simulation(Scene(Terrain(FLAT), still, rock()), Settings(dt=LONG))
    sim.step(10)
    alone.step(10)
    assert sim.diagnostics.cut_backs > 0
    assert alone.diagnostics.cut_backs == 0
    np.testing.assert_allclose(sim.poses[:3], alone.poses, atol=1e-12)
    assert sim.time == alone.time == pytest.approx(1.0)
    assert len(sim.contacts()) >= len(alone.contacts())


def test_a_slide_at_a_long_step_stays_exact():
    thrown = box(0.0, 0.5, velocity=(12.0, 0.0, 0.0))
    sim = Simulation(Scene(Terrain(FLAT), (thrown,), rock(30.0)), Settings(dt=LONG))
    sim.step(10)
    way = 12.0 - 0.5 * 9.81 * math.tan(math.radians(30.0))
    assert sim.poses[0, 0] == pytest.approx(way, rel=1e-5)


def test_energy_closes_over_cut_backs():
    rng = np.random.default_rng(0)
    for _ in range(20):
        sim = Simulation(walls.shot(rng), Settings(dt=LONG))
        before = sim.energy()
        sim.step(8)
        after = sim.energy()
        work = after.friction + after.impact + after.damping
        gain = after.kinetic + after.potential - before.kinetic - before.potential
        assert gain == pytest.approx(work, abs=1e-6 * before.kinetic)


@pytest.mark.parametrize("dt", [0.05, LONG])
def test_nothing_passes_a_thin_wall_at_the_longest_steps(dt):
    _, passed, deepest = walls.measure(Lab(dt))
    assert passed.computed == 0
    assert max(deepest.computed) < walls.WALL.thickness
