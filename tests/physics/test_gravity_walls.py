"""Gravity walls as bodies of a scene; the accuracy suite has their limit loads."""

from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec.structs import replace

from physics.helpers import FLAT, GRAVITY, box, rock
from rigdda import (
    Block,
    Embankment,
    Fence,
    GravityWall,
    Run,
    Scene,
    Simulation,
    Site,
    Surface,
    Terrain,
    Wall,
    release,
)
from rigdda.geometry import polygon_properties
from rigdda.releases import release_many
from rigdda.validation.barriers import FACE, LOADING_TIME, Push, displacement
from rigdda.validation.case import Lab


@pytest.mark.parametrize("slope_deg", [20.0, 30.0])
def test_slides_on_a_slope_steeper_than_friction(slope_deg):
    fall = math.tan(math.radians(slope_deg))
    terrain = Terrain([(-30.0, 30.0 * fall), (90.0, -90.0 * fall)])
    limit = math.tan(math.radians(slope_deg))
    far = box(-20.0, 60.0)
    for share, slides in ((0.98, True), (1.02, False)):
        friction_deg = math.degrees(math.atan(share * limit))
        scene = Scene(terrain, (far,), rock(friction_deg), barriers=(GravityWall(0.0, 1.0, 2.0),))
        x, y, turn = displacement(Lab(5e-3), scene)
        assert turn == pytest.approx(0.0, abs=1e-3)
        if slides:  # s = 1/2 g (sin - cos tan phi) t^2
            way = (
                0.5 * GRAVITY * math.sin(math.radians(slope_deg)) * (1.0 - share) * LOADING_TIME**2
            )
            assert math.hypot(x, y) == pytest.approx(way, rel=0.01)
        else:
            assert math.hypot(x, y) < 1e-4


def test_the_base_is_the_chord_and_never_dips_into_the_ground():
    wall = GravityWall(1.0, 2.0, 2.0)
    valley = Terrain([(0.0, 3.0), (2.0, 1.0), (4.0, 1.0)])
    np.testing.assert_allclose(wall.outline(valley), [(1, 2), (3, 1), (3, 4), (1, 4)])
    ridge = Terrain([(0.0, 2.0), (2.5, 2.0), (5.0, 0.0)])
    np.testing.assert_allclose(wall.outline(ridge), [(1, 2), (3, 2), (3, 4), (1, 4)])


def test_it_is_no_rock_and_keeps_its_place_in_the_layout():
    barriers = (Wall(10.0, 2.0), GravityWall(0.0, 2.0), Fence(20.0, 2.0, 1e6))
    rocks = (box(-5.0, 0.5, velocity=(8.0, 0.0, 0.0)), box(15.0, 0.5))
    sim = Simulation(Scene(Terrain(FLAT), rocks, rock(20.0), barriers=barriers))
    run = sim.run(2.0)
    assert run.poses.shape[1:] == (2, 3) and run.barrier_poses.shape[1:] == (3, 3)
    moved = np.hypot(*(run.barrier_poses[-1] - run.barrier_poses[0])[:, :2].T)
    assert moved[1] > 0.01 and moved[0] == moved[2] == 0.0
    assert [len(run.hits(i)) > 0 for i in range(3)] == [False, True, False]
    assert run.absorbed[1] > 0.0
    contacts = sim.contacts()
    assert set(contacts["block_a"]) <= {0, 1, 3}  # 3: the gravity wall, barrier 1
    at_rest = run.outline(1)
    np.testing.assert_allclose(at_rest.mean(axis=0), run.barrier_poses[-1, 1, :2], atol=1e-9)


def test_the_energy_of_a_pushed_wall_is_in_the_ledger():
    scene = Scene(
        Terrain(FLAT),
        (box(-5.0, 0.6, velocity=(12.0, 0.0, 0.0)),),
        rock(20.0),
        barriers=(GravityWall(0.0, 2.0),),
    )
    sim = Simulation(scene)
    start = sim.energy()
    sim.step(300)
    end = sim.energy()
    before, after = (e.kinetic + e.potential for e in (start, end))
    work = end.friction + end.impact + end.damping
    assert after - before == pytest.approx(work, rel=2e-3)


@pytest.mark.parametrize("dt", [1.25e-3, 2.5e-3, 5e-3, 1e-2, 2e-2])
@pytest.mark.parametrize("size", [0.7, 1.0, 2.0])
@pytest.mark.parametrize("speed", [3.0, 10.0])
def test_a_wall_that_is_struck_flat_slides_on_with_the_block(size, speed, dt):
    """By momentum and friction: V = v m/(m + M) after a plastic blow, then V^2/(2 g tan phi)."""
    friction_deg, gap = 30.0, 0.5
    mu = math.tan(math.radians(friction_deg))
    wall = GravityWall(0.0, size, 1.5 * size)
    corners = size * np.array([(-1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)]) - [gap, 0.0]
    block = Block(corners, velocity=(speed, 0.0, 0.0))
    scene = Scene(Terrain(FLAT), (block,), rock(friction_deg, 0.0), barriers=(wall,))
    x, _, turn = displacement(Lab(dt), scene)
    hit = math.sqrt(speed**2 - 2.0 * mu * GRAVITY * gap)
    share = block.density / (block.density + 1.5 * wall.density)
    assert x == pytest.approx((share * hit) ** 2 / (2.0 * mu * GRAVITY), rel=0.02)
    assert turn == pytest.approx(0.0, abs=1e-3)


def test_runs_with_every_kind_are_stored(tmp_path):
    barriers = (Wall(10.0, 2.0), GravityWall(0.0, 2.0), Fence(20.0, 2.0, 1e6))
    run = Simulation(
        Scene(Terrain(FLAT), (box(-2.0, 0.5, velocity=(8.0, 0.0, 0.0)),), rock(), barriers=barriers)
    ).run(1.0)
    run.save(tmp_path / "run.npz")
    again = Run.load(tmp_path / "run.npz")
    assert again.scene.barriers == barriers
    np.testing.assert_array_equal(again.barrier_poses, run.barrier_poses)


@pytest.mark.parametrize(
    ("share", "at", "friction_deg", "state"),
    [(0.9, 1.9, 60.0, "stands"), (1.3, 0.5, 20.0, "slid"), (1.5, 1.9, 60.0, "overturned")],
)
def test_the_state_at_the_end_is_told(share, at, friction_deg, state):
    push = Push(GravityWall(FACE, 2.0, 1.0), friction_deg, at)
    run = Simulation(push.scene(share * push.limit())).run(5.0)
    assert run.states(0)[-1][1] == state


def test_more_walls_than_blocks():
    walls = tuple(GravityWall(5.0 + 2.0 * i, 1.0) for i in range(4))
    sim = Simulation(Scene(Terrain(FLAT), (box(0.0, 0.5),), rock(), barriers=walls))
    sim.step(10)
    assert sim.time == pytest.approx(10 * sim.settings.dt)


def test_a_wall_that_overturned_and_stands_again_has_failed_in_many_releases_too():
    """It is judged by all frames, as one release is: here it is carried on, turning round."""
    site = Site.load("shu-hwa")
    site = replace(site, motion=replace(site.motion, dt=2.5e-3))  # by its last frame it stands
    wall = GravityWall(83.6, 1.5, 0.4 * 1.5)
    (found,) = release_many([(site, (wall,), 1, "mass")])
    assert found == release(site, (wall,), 1, "mass")[1]
    assert found.barriers[0].failed


@pytest.mark.parametrize("rolling", [0.1, 0.4])
def test_rolling_resistance_does_not_keep_a_wall_upright(rolling):
    """It overturns at W b / (2 h), whatever the ground resists to blocks that roll on it."""
    push = Push(GravityWall(FACE, 2.0, 1.0), 60.0, 1.9)
    for share, falls in ((0.97, False), (1.04, True)):
        scene = push.scene(share * push.limit())
        surfaces = dict(scene.surfaces) | {"rock": Surface(60.0, 0.0, rolling=rolling)}
        scene = Scene(scene.terrain, scene.blocks, surfaces, barriers=scene.barriers)
        x, y, _ = displacement(Lab(5e-3), scene)
        assert (math.hypot(x, y) > 1e-3) == falls


@pytest.mark.parametrize("slope_deg", [-10.0, 0.0, 15.0, 25.0, 40.0])
def test_the_resistance_on_a_slope_is_that_of_statics(slope_deg):
    """H = W tan(phi - b), none if b exceeds phi; a rise of the ground is not counted."""
    fall = math.tan(math.radians(slope_deg))
    ground = Terrain([(-60.0, 60.0 * fall), (60.0, -60.0 * fall)])
    surfaces = {"rock": Surface(33.0), "soil": Surface(33.0)}
    barriers = [GravityWall(0.0, 2.0, 1.0)]
    if abs(slope_deg) <= 25.0:
        barriers.append(Embankment(0.0, 2.0, width=1.0, side_slope=0.5))
    for barrier in barriers:
        scene = Scene(ground, (box(-20.0, 60.0),), surfaces, barriers=(barrier,))
        weight = barrier.density * GRAVITY * abs(polygon_properties(scene.outline(0))[0])
        right = weight * math.tan(math.radians(max(33.0 - max(slope_deg, 0.0), 0.0)))
        assert scene.resistance(0) == pytest.approx(right, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("edge", "stands"), [(0.6, True), (0.2, False)])
def test_a_wall_at_the_edge_of_a_bench_resists_as_its_base_does(edge, stands):
    """It stands on the level bench if its middle does, and on the slope beyond otherwise."""
    ground = Terrain([(-60.0, 0.0), (edge, 0.0), (60.0, edge - 60.0)])
    wall = GravityWall(0.0, 2.0, 1.0)
    scene = Scene(ground, (box(-20.0, 5.0),), {"rock": Surface(33.0)}, barriers=(wall,))
    weight = wall.density * GRAVITY * abs(polygon_properties(scene.outline(0))[0])
    right = weight * math.tan(math.radians(33.0)) if stands else 0.0
    assert scene.resistance(0) == pytest.approx(right)
