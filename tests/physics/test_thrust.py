"""What thrust moves: embankments; and what is said of walls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec.structs import replace
from rerun.chunk import RrdReader

from physics.helpers import GRAVITY, box
from physics.steps import each
from rigdda import (
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Run,
    Scene,
    Settings,
    Simulation,
    Site,
    Surface,
    Terrain,
    Wall,
    release,
)

HALF = Terrain([(-40.0, 20.0), (0.0, 0.0), (60.0, 0.0)], ["ice", "rock"])
SURFACES = {"rock": Surface(35.0), "ice": Surface(0.0)}
DAM = Embankment(1.0, 2.0, 1.0, 0.5)


def row(blocks, dam=DAM):
    """Return smooth cubes that come to lean on an embankment at the foot of a ramp of ice."""
    slope = math.atan(0.5)
    up, out = np.array([-math.cos(slope), math.sin(slope)]), np.array([0.4472136, 0.8944272])
    rocks = [
        box(*(up * (1.0 + 1.01 * i) + out * 0.51), angle=-slope, surface="ice")
        for i in range(blocks)
    ]
    return Scene(HALF, rocks, SURFACES, barriers=(dam,))


def test_resistances_are_weight_times_friction():
    """And of a fence the force against which it gives way."""
    barriers = (
        Wall(20.0, 2.0),
        GravityWall(5.0, 2.0),
        Fence(10.0, 2.0, 1e6, elongation=4.5),
        DAM,
        Ditch(30.0, 1, 4),
    )
    scene = Scene(HALF, (box(-5.0, 8.0),), SURFACES, barriers=barriers)
    tan = math.tan(math.radians(35.0))
    expected = (
        math.inf,
        2400 * 2.0 * GRAVITY * tan,
        1e6 / 4.5,
        1900 * 4.0 * GRAVITY * tan,
        math.inf,
    )
    assert [scene.resistance(i) for i in range(5)] == pytest.approx(expected)
    soil = Scene(HALF, scene.blocks, SURFACES | {"soil": Surface(20.0)}, barriers=(DAM,))
    assert soil.resistance(0) == pytest.approx(1900 * 4.0 * GRAVITY * math.tan(math.radians(20.0)))


def test_what_is_wider_is_resisted_by_less():
    assert GravityWall(0.0, 2.0).for_width(2.0).density == 2400.0 * 2.5
    assert GravityWall(0.0, 2.0).for_width(30.0).density == 2400.0
    assert DAM.for_width(2.0).density == pytest.approx(1900.0 * 3.0)
    assert DAM.for_width(40.0).density == pytest.approx(1900.0 * 1.1)
    for barrier in (Wall(0.0, 2.0), Ditch(0.0, 1.0, 4.0)):
        assert barrier.for_width(2.0) is barrier


@pytest.mark.parametrize("dt", [1e-2, 2.5e-3])
def test_an_embankment_is_pushed_by_more_than_its_friction(dt):
    held = Simulation(row(3), Settings(dt=dt)).run(6.0)
    assert math.isinf(held.failure(0)) and held.thrust[0] > 0.0
    weak = replace(DAM, density=DAM.density * 0.7 * held.thrust[0] / held.scene.resistance(0))
    pushed = Simulation(row(3, weak), Settings(dt=dt)).run(8.0)
    assert math.isfinite(pushed.failure(0))
    assert held.poses[-1, :, 0].max() < 3.0 < pushed.poses[-1, :, 0].max()
    assert pushed.ground.height(2.0) == pytest.approx(0.0, abs=1e-9) != held.ground.height(2.0)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_the_thrust_of_a_row_on_a_heavy_embankment_does_not_depend_on_the_step(count):
    """Contacts count as soon as they press on its face, also from uphill of its foot."""
    heavy = row(count, replace(DAM, density=10.0 * DAM.density))
    taken = [
        Simulation(heavy, Settings(dt=dt)).run(6.0).thrust[0] for dt in (1e-2, 5e-3, 2.5e-3, 1e-3)
    ]
    assert max(taken) / min(taken) < 1.1


def test_thrust_on_an_embankment_does_not_depend_on_the_step():
    taken = [Simulation(row(4), Settings(dt=dt)).run(6.0).thrust[0] for dt in (1e-2, 2.5e-3)]
    assert taken[0] == pytest.approx(taken[1], rel=0.2)
    assert taken[0] < 4 * 2600.0 * GRAVITY


def test_one_that_is_pushed_away_is_shown_and_stored(tmp_path):
    run = Simulation(row(4, replace(DAM, density=200.0))).run(4.0)
    run.save(tmp_path / "run.npz")
    again = Run.load(tmp_path / "run.npz")
    assert again.failure(0) == run.failure(0) < 4.0
    np.testing.assert_array_equal(again.thrust, run.thrust)
    run.to_rerun(tmp_path / "run.rrd")
    chunks = RrdReader(tmp_path / "run.rrd").stream().filter(is_static=False).to_chunks()
    assert any(chunk.entity_path == "/world/barriers/0" for chunk in chunks)


@pytest.mark.filterwarnings("ignore:motion.duration")  # 12 s are enough to break it
@pytest.mark.parametrize("dt", each([2e-2, 5e-3]))
@pytest.mark.parametrize("barrier", [Embankment(50.2, 0.6, 0.5), GravityWall(50.2, 0.6)])
def test_nothing_low_holds_a_jammed_mass(barrier, dt):
    site = Site.load("shu-hwa")
    site = replace(site, motion=replace(site.motion, dt=dt, damping_when="contact", duration=12.0))
    (found,) = release(site, (barrier,), 0, "mass")[1].barriers
    assert found.failed and found.state in ("pushed", "slid", "overturned")
    # a wall may be knocked over before anything thrusts
    assert found.state == "overturned" or found.thrust > found.resistance


@pytest.mark.filterwarnings("ignore:motion.duration")
@pytest.mark.parametrize("dt", [2e-2, 5e-3])
@pytest.mark.parametrize(
    "fence", [Fence(50.2, 2.5, energy_class=100), Fence(50.2, 3.0, energy_class=1000)]
)
def test_a_fence_fails_under_a_jammed_mass(fence, dt):
    site = Site.load("shu-hwa")
    site = replace(site, motion=replace(site.motion, dt=dt, damping_when="contact", duration=12.0))
    (found,) = release(site, (fence,), 0, "mass")[1].barriers
    assert found.failed and found.state == "failed"


def test_a_ditch_in_the_crest_of_an_embankment_is_lost_with_it():
    """It could not be dug into the ground that is left."""
    barriers = (DAM, Ditch(2.25, 0.4, 0.5, 0.2), Ditch(10.0, 1.0, 4.0))
    scene = Scene(HALF, (box(-5.0, 8.0),), SURFACES, barriers=barriers)
    left = scene.ground_without([0])
    assert left is not None
    assert [left.height(x) for x in (1.5, 2.5, 3.5)] == [0.0, 0.0, 0.0]
    assert left.height(12.0) == -1.0
    assert scene.ground_without([]) is scene.ground
