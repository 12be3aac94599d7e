"""The longest steps that blocks bear, and what holds in them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, box, rock
from rigdda import BadInput, Block, Scene, Settings, Simulation, Terrain
from rigdda.model.loads import FixedPoint
from rigdda.model.scene import Surface
from rigdda.model.settings import EARTH, longest_step
from rigdda.validation.scenes import incline, polygon


def test_a_slide_at_a_long_step_stays_exact():
    thrown = box(0.0, 0.5, velocity=(12.0, 0.0, 0.0))
    sim = Simulation(Scene(Terrain(FLAT), (thrown,), rock(30.0)), Settings(dt=1.0 / 60.0))
    sim.step(60)
    way = 12.0 - 0.5 * 9.81 * math.tan(math.radians(30.0))
    assert sim.poses[0, 0] == pytest.approx(way, rel=1e-5)


@pytest.mark.parametrize("dt", [1e-3, 5e-3, 1e-2])
@pytest.mark.parametrize(("slope", "friction"), [(30.0, 20.0), (45.0, 30.0)])
def test_a_slide_on_the_contacts_of_the_paper_is_exact(slope, friction, dt):
    """Its friction is found by open-close iteration, since its island is solved as a whole."""
    scene, down = incline(slope, friction)
    surfaces = {name: Surface(friction, restitution=None) for name in scene.surfaces}
    sim = Simulation(Scene(scene.terrain, scene.blocks, surfaces), Settings(dt=dt))
    start = sim.poses
    sim.step(round(1.0 / dt))
    angle = math.radians(slope)
    pull = math.sin(angle) - math.tan(math.radians(friction)) * math.cos(angle)
    way = (sim.poses - start)[0, :2] @ down
    assert way == pytest.approx(0.5 * 9.81 * pull, rel=1e-3)


@pytest.mark.parametrize(("steps", "bar"), [(200, 2e-3), (60, 4e-3)])
def test_what_tips_over_does_not_sink_in(steps, bar):
    """A square that is let go beyond its balance falls on its side, in so many steps a second."""
    scene = Scene(Terrain(FLAT), (box(0.0, 0.7, angle=1.0),), rock(60.0))
    sim = Simulation(scene, Settings(dt=1.0 / steps))
    sim.step(3 * steps)
    assert sim.diagnostics.penetration < bar
    turned = (sim.poses[0, 2] + 1.0) / (0.5 * math.pi)
    assert turned == pytest.approx(round(turned), abs=1e-4)


@pytest.mark.parametrize(("dt", "bar"), [(0.005, 1.2e-5), (0.02, 4e-5)])
def test_a_block_that_rocks_neither_lifts_nor_sinks_its_corner(dt, bar):
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 4.0), (0.0, 4.0)]
    block = Block(polygon(corners, angle=0.12))
    sim = Simulation(Scene(Terrain(FLAT), (block,), rock(60.0)), Settings(dt=dt))
    for _ in range(round(0.6 / dt)):
        sim.step()
        assert abs(sim.vertices(0)[0, 1]) < bar
    assert sim.poses[0, 2] < -0.07


@pytest.mark.parametrize("dt", [0.005, 0.02])
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


def test_a_step_is_refused_that_is_too_long_for_the_blocks():
    scene = Scene(Terrain(FLAT), (box(0.0, 0.5), box(5.0, 0.5)), rock())
    most = 0.16 / math.sqrt(9.81)
    Simulation(scene, Settings(dt=0.999 * most))
    with pytest.raises(BadInput, match=r"dt = .* give at most 0.05108 s: the blocks are 1 to 1 m"):
        Simulation(scene, Settings(dt=1.001 * most))
    Simulation(scene, Settings(dt=0.1, mode="static"))


def test_one_small_block_bounds_the_step_too():
    assert longest_step(np.array([1.0, 1.0, 1e-6]), EARTH) == pytest.approx(
        0.5 * math.sqrt(1e-3 / 9.81)
    )
    assert longest_step(np.array([1.0]), 0.0) == longest_step(np.array([1.0]), 9.81)


def test_a_block_that_bounces_on_shaken_ground_feels_the_shaking():
    """Ground that rises at 2 m/s2 and gravity are gravity greater by as much."""
    thrown = (box(0.0, 3.0, angle=0.3),)
    rises = ((0.0, 0.0, 2.0), (9.0, 0.0, 2.0))
    shaken = Scene(Terrain(FLAT), thrown, rock(20.0, restitution=0.5), base_motion=rises)
    heavier = Scene(Terrain(FLAT), thrown, rock(20.0, restitution=0.5), gravity=11.81)
    one, two = Simulation(shaken), Simulation(heavier)
    for _ in range(300):
        one.step()
        two.step()
        np.testing.assert_allclose(one.poses, two.poses, atol=1e-3)
