"""What is made of a release, worked out by hand on blocks in flight."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from physics.helpers import FLAT, box, rock

from rigdda import Ditch, Fence, Scene, Settings, Simulation, Site, Surface, Terrain, Wall
from rigdda.geometry import polygon_properties
from rigdda.measurement import measure, stations, watch
from rigdda.model.settings import longest_step
from rigdda.model.site_tables import Motion, Scatter

QUICK = Site.load("quick")
EDGE = QUICK.road.start
TURNING = 1300.0 * (400.0 + 400.0 / 6.0)
"""Kinetic energy of a square of 1 m2 at 20 m/s and 20 rad/s [J]."""


def test_an_outcome_is_what_blocks_in_flight_do():
    blocks = (box(EDGE - 2.0, 60.0, velocity=(20.0, 0.0, 20.0)), box(EDGE - 20.0, 60.0, 2.0, 1.0))
    scene = Scene(QUICK.profile, blocks, QUICK.surfaces, gravity=0.0)
    run = Simulation(scene, Settings(), stations(QUICK, ()), watch(QUICK)).run(0.3)
    found = measure(QUICK, run, "block", 3.0)
    assert found.released_mass == pytest.approx(3.0 * 2600.0)
    assert (found.road_volume, found.released_volume) == pytest.approx((3.0, 9.0))
    assert found.debris_on_road == pytest.approx(1.0) and found.reached
    assert found.debris_fraction == pytest.approx(1.0 / 3.0)
    assert found.run_out == pytest.approx((EDGE - 20.0, EDGE + 4.0, EDGE + 4.0))
    shares = (found.slope_fraction, found.road_fraction, found.beyond_fraction)
    assert shares == pytest.approx((2.0 / 3.0, 1.0 / 3.0, 0.0))
    assert found.max_energy_on_road == pytest.approx(TURNING)
    circles = EDGE - 20.0 - math.sqrt(1.25), EDGE + 4.0 + math.sqrt(0.5)
    assert found.reach == pytest.approx(circles)


def test_energies_are_of_translation_and_rotation():
    flyer, fence = box(-3.0, 5.0, velocity=(20.0, 0.0, 20.0)), Fence(0.0, 20.0, 1e7)
    scene = Scene(Terrain(FLAT), (flyer,), rock(), barriers=(fence,), gravity=0.0)
    run = Simulation(scene, Settings(), (-2.0,), (-5.0, 5.0)).run(0.3)
    assert run.hits(0)["energy"][0] == pytest.approx(TURNING)
    assert run.crossings(0)["energy"][0] == pytest.approx(TURNING)
    assert run.watch_energy[0] == pytest.approx(TURNING)


def test_a_fence_takes_its_class_over_the_width_of_the_event():
    fence = Fence(17.0, 3.0, energy_class=1000)
    group = QUICK.realise((fence,), 3, "group").barriers[0]
    assert isinstance(group, Fence) and group.capacity == pytest.approx(1e6 / 6.0)
    width = QUICK.draw(3, "block").width
    block = QUICK.realise((fence,), 3, "block").barriers[0]
    assert isinstance(block, Fence) and block.capacity == pytest.approx(1e6 / width)


def test_a_wall_holds_what_lies_uphill_below_the_slope_of_a_deposit():
    outline = np.array([[10.0, -1.0], [10.5, -1.0], [10.5, 2.0], [10.0, 2.0]])
    reach = Wall(10.0, 2.0).holds(outline, None, 0.5)
    points = ((9.0, 2.4), (9.0, 2.6), (0.0, 6.9), (10.5, 0.0))
    assert [reach.includes(*point) for point in points] == [True, False, True, False]


def test_a_ditch_holds_what_lies_between_its_edges():
    reach = Ditch(10.0, 1.0, 4.0).holds(np.zeros((0, 2)), Terrain(FLAT), 0.5)
    assert [reach.includes(x, 0.0) for x in (9.9, 10.1, 13.9, 14.1)] == [False, True, True, False]


def test_the_smaller_of_each_property_counts_where_two_surfaces_meet():
    surfaces = {"rock": Surface(30.0, 1e3, 5e2, 0.4), "ice": Surface(40.0, 5e2, 1e3, 0.1)}
    scene = Scene(Terrain(FLAT, ["ice"]), (box(0.0, 0.5), box(5.0, 0.5, surface="ice")), surfaces)
    assert scene.interface("rock", "ice") == Surface(30.0, 5e2, 5e2, 0.1)
    assert scene.interface("ice", "rock") == Surface(30.0, 5e2, 5e2, 0.1)


def test_friction_scatters_as_it_is_asked_to():
    even = msgspec.structs.replace(
        QUICK.surfaces["rock"], friction_sd_deg=0.0, restitution_sd=0.0, rolling_sd=0.0
    )
    site = msgspec.structs.replace(
        QUICK, surfaces={"rock": even}, scatter=Scatter(friction_deg=3.0)
    )
    shifts = np.array([site.draw(seed, "block").friction_deg for seed in range(400)])
    assert abs(shifts.mean()) < 4.0 * 3.0 / math.sqrt(400.0)
    assert shifts.std() == pytest.approx(3.0, rel=0.15)
    scene = site.realise((), 7, "block")
    assert scene.surfaces["rock"].friction_deg == pytest.approx(28.0 + shifts[7])


def test_a_site_divides_its_step_for_small_blocks():
    site = msgspec.structs.replace(QUICK, motion=Motion(dt=0.05))
    scene = site.realise((), 1, "block")
    dt = site.settings(scene).dt
    areas = np.array([polygon_properties(block.vertices)[0] for block in scene.blocks])
    assert dt <= longest_step(areas, 9.81) < 0.05
    assert 0.05 / dt == pytest.approx(round(0.05 / dt))
