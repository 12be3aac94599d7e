"""Islands whose corners would move too far in a step take shorter ones; the others do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, box, rock
from rigdda import BadInput, Block, Fence, Scene, Settings, Simulation, Terrain
from rigdda.scene import Surface
from rigdda.supports import Bolt, FixedPoint
from rigdda.validation import walls
from rigdda.validation.case import Lab
from rigdda.validation.scenes import polygon

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


def tipping(dt: float) -> Simulation:
    """Return a square that was let go beyond its balance and fell on its side."""
    sim = Simulation(Scene(Terrain(FLAT), (box(0.0, 0.7, angle=1.0),), rock(60.0)), Settings(dt=dt))
    sim.step(round(3.0 / dt))
    return sim


@pytest.mark.parametrize("dt", [0.025, 0.05, LONG])
def test_what_turns_does_not_sink_in_at_coarse_steps(dt):
    sim = tipping(dt)
    assert sim.diagnostics.cut_backs <= 2
    assert sim.diagnostics.penetration < 0.001
    turned = (sim.poses[0, 2] + 1.0) / (0.5 * math.pi)
    assert turned == pytest.approx(round(turned), abs=1e-4)


@pytest.mark.parametrize(("dt", "bar"), [(0.02, 2e-5), (0.05, 2e-4), (LONG, 1e-3)])
def test_a_block_that_rocks_neither_lifts_nor_sinks_its_corner(dt, bar):
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 4.0), (0.0, 4.0)]
    block = Block(polygon(corners, angle=0.12))
    sim = Simulation(Scene(Terrain(FLAT), (block,), rock(60.0)), Settings(dt=dt))
    for _ in range(round(0.6 / dt)):
        sim.step()
        assert abs(sim.vertices(0)[0, 1]) < bar
    assert sim.poses[0, 2] < -0.07
    assert sim.diagnostics.cut_backs == 0


def test_a_slow_blow_stops_a_corner_at_once():
    """Too slow for an impact beside g dt, too fast to sink in: the corner ends where it hits."""
    block = box(0.0, 0.5, velocity=(0.0, -0.3, 0.0))
    sim = Simulation(Scene(Terrain(FLAT), (block,), rock()), Settings(dt=0.05))
    sim.step()
    assert sim.vertices(0)[:, 1].min() == pytest.approx(0.0, abs=1e-3)
    assert sim.diagnostics.cut_backs == 0


@pytest.mark.parametrize("barriers", [(), (Fence(1.0, 2.0, 1e6),)])
@pytest.mark.parametrize("bolt", [False, True])
def test_a_slow_blow_beside_a_fence_or_on_a_bolt_stops_a_corner_at_once(barriers, bolt):
    block = box(0.4, 0.505, velocity=(-1.0 if bolt else 0.02, -0.3, 0.0))
    anchors = Bolt(0, (0.4, 0.505), None, (-5.0, 0.505), stiffness=1.0)
    scene = Scene(
        Terrain(FLAT), (block,), rock(), barriers=barriers, supports=(anchors,) if bolt else ()
    )
    sim = Simulation(scene, Settings(dt=0.05))
    sim.step()
    assert sim.vertices(0)[:, 1].min() == pytest.approx(0.0, abs=1e-3)
    assert sim.diagnostics.cut_backs == 0


@pytest.mark.parametrize("dt", [0.005, 0.02, 0.05])
def test_a_block_that_slides_on_a_plank_that_turns_away_stays_on_it(dt):
    plank = Block([(-4.0, -0.5), (4.0, -0.5), (4.0, 0.0), (-4.0, 0.0)], velocity=(0.0, 0.0, -1.5))
    corners = [(0.1, 0.0), (0.9, 0.0), (0.9, 0.4), (0.1, 0.4)]
    along, up = np.array([0.5, 0.45]), -1.5
    slides = Block(corners, velocity=(2.0 - up * along[1], up * along[0], up))
    pin = FixedPoint(1, (0.0, -0.25))
    surface = {"rock": Surface(friction_deg=0.0, restitution=0.0)}
    scene = Scene(None, (slides, plank), surface, supports=(pin,))
    sim = Simulation(scene, Settings(dt=dt))
    for _ in range(round(0.2 / dt)):
        sim.step()
        x, y, angle = sim.poses[1]
        normal = np.array([-math.sin(angle), math.cos(angle)])
        gaps = (sim.vertices(0) - (x, y)) @ normal - 0.25
        assert gaps.min() > -2e-4
    assert sim.diagnostics.cut_backs == 0


def test_steps_that_are_fine_for_the_blocks_are_not_watched_for_sinking():
    assert tipping(0.01).diagnostics.cut_backs == 0


def test_a_step_is_refused_in_which_the_smallest_block_falls_by_a_quarter_of_its_size():
    blocks = box(0.0, 0.5), box(5.0, 0.1, 0.2, 0.2)
    scene = Scene(Terrain(FLAT), blocks, rock())
    most = math.sqrt(0.25 * 0.2 / 9.81)
    Simulation(scene, Settings(dt=0.99 * most))
    with pytest.raises(BadInput, match="block 1 is small"):
        Simulation(scene, Settings(dt=1.01 * most))


def test_energy_closes_over_cut_backs():
    rng = np.random.default_rng(0)
    for _ in range(20):
        sim = Simulation(walls.shot(rng), Settings(dt=0.08))
        before = sim.energy()
        sim.step(8)
        after = sim.energy()
        work = after.friction + after.impact + after.damping
        gain = after.kinetic + after.potential - before.kinetic - before.potential
        assert gain == pytest.approx(work, abs=1e-6 * before.kinetic)


@pytest.mark.parametrize("dt", [0.05, 0.08])
def test_nothing_passes_a_thin_wall_at_the_longest_steps(dt):
    _, passed, deepest = walls.measure(Lab(dt))
    assert passed.computed == 0
    assert max(deepest.computed) < walls.WALL.thickness
