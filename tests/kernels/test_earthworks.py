"""Ditches and embankments change the ground as their drawings say."""

from __future__ import annotations

import numpy as np
import pytest
from physics.helpers import FLAT, box, rock

from rigdda import BadInput, Ditch, Embankment, Scene, Simulation, Surface, Terrain, Wall
from rigdda.barriers import earthworks, section

LEVEL = Terrain([(0.0, 0.0), (40.0, 0.0)])
SLOPE = Terrain([(0.0, 20.0), (40.0, 0.0)])
BENCH = Terrain([(0.0, 20.0), (10.0, 10.0), (14.0, 9.0), (24.0, -1.0), (40.0, -1.0)], list("abcd"))


def built(terrain, *barriers):
    """Return the corners of the ground, and the areas that were moved."""
    ground, moved = earthworks(terrain, barriers, "soil")
    return ground, [section(moved[b]) for b in barriers]


def test_a_ditch_in_level_ground():
    ground, (area,) = built(LEVEL, Ditch(10.0, 2.0, 5.0, 0.5))
    np.testing.assert_allclose(
        ground.points, [(0, 0), (10, 0), (11, -2), (14, -2), (15, 0), (40, 0)], atol=1e-9
    )
    assert area == pytest.approx(8.0)
    assert ground.surfaces == ("rock",) * 5


def test_an_embankment_on_level_ground():
    ground, (area,) = built(LEVEL, Embankment(10.0, 2.0, 1.0, 0.5))
    np.testing.assert_allclose(
        ground.points, [(0, 0), (10, 0), (11, 2), (12, 2), (13, 0), (40, 0)], atol=1e-9
    )
    assert area == pytest.approx(4.0)
    assert ground.surfaces == ("rock", "soil", "soil", "soil", "rock")


def test_a_ditch_in_a_slope_is_as_deep_below_its_lower_edge():
    ground, (area,) = built(SLOPE, Ditch(10.0, 1.0, 4.0, 0.25))
    # edges at 15 and 13 m, floor at 12 m
    corners = [(0, 20), (10, 15), (10.75, 12), (13.75, 12), (14, 13), (40, 0)]
    np.testing.assert_allclose(ground.points, corners, atol=1e-9)
    assert area == pytest.approx(0.5 * 2.0 * 4.0 + 4.0 - 0.5 * 0.75 * 3.0 - 0.5 * 0.25)


def test_an_embankment_on_a_slope_ends_where_its_side_meets_the_ground():
    ground, _ = built(SLOPE, Embankment(10.0, 2.0, 1.0, 0.5))
    # crest at 17 m from 11 to 12 m; 17 - 2 (x - 12) = 20 - x/2 at x = 14
    corners = [(0, 20), (10, 15), (11, 17), (12, 17), (14, 13), (40, 0)]
    np.testing.assert_allclose(ground.points, corners, atol=1e-9)


@pytest.mark.parametrize(
    "barrier",
    [
        Ditch(8.0, 1.0, 5.0),
        Ditch(12.0, 1.0, 6.0),
        Ditch(10.0, 1.0, 4.0),
        Embankment(8.0, 1.0, 4.0),
        Embankment(10.0, 1.5, 0.5),
        Embankment(22.0, 2.0, 1.0),
    ],
)
def test_across_corners_of_the_terrain_only_the_one_side_changes(barrier):
    ground, (area,) = built(BENCH, barrier)
    x = np.linspace(0.0, 40.0, 4001)
    change = np.interp(x, *ground.points.T) - np.interp(x, *BENCH.points.T)
    sign = -1.0 if isinstance(barrier, Ditch) else 1.0
    assert (sign * change > -1e-9).all()
    assert np.abs(change).sum() * 0.01 == pytest.approx(area, rel=1e-2)
    untouched = (x < barrier.x) | (np.abs(change) < 1e-9)
    surface = {s for s, mid in zip(ground.surfaces, _middles(ground), strict=True) if mid < 8.0}
    assert surface == {"a"}
    assert untouched[x < barrier.x].all()
    if isinstance(barrier, Ditch):
        assert set(ground.surfaces) <= set("abcd")


def _middles(ground):
    return 0.5 * (ground.points[1:, 0] + ground.points[:-1, 0])


def test_at_a_corner_no_segment_without_length_is_left():
    for start in (10.0, 14.0, 10.0 + 1e-9):
        ground, _ = built(BENCH, Ditch(start, 1.0, 4.0))
        assert np.diff(ground.points[:, 0]).min() > 1e-6


def test_a_ditch_at_the_foot_of_a_vertical_face():
    cliff = Terrain([(0.0, 10.0), (5.0, 10.0), (5.0, 0.0), (30.0, 0.0)])
    ground, (area,) = built(cliff, Ditch(5.0, 1.0, 3.0, 0.5))
    corners = [(0, 10), (5, 10), (5, 0), (5.5, -1), (7.5, -1), (8, 0), (30, 0)]
    np.testing.assert_allclose(ground.points, corners, atol=1e-9)
    assert area == pytest.approx(2.5)


def test_a_ditch_and_the_embankment_of_its_earth():
    ground, areas = built(LEVEL, Embankment(14.0, 1.0, 1.0), Ditch(10.0, 1.0, 4.0))
    assert ground.height(12.0) == pytest.approx(-1.0)
    assert ground.height(15.0) == pytest.approx(1.0)
    assert areas == pytest.approx([1.5, 3.75])


@pytest.mark.parametrize(
    ("barrier", "field", "mend"),
    [
        (Ditch(38.0, 1.0, 4.0), "ditch x", "stay on the terrain"),
        (Ditch(10.0, 4.0, 1.0), "ditch width", "give more than"),
        (Embankment(10.0, 1.0, 1.0, 2.5), "embankment x", "flatter than its downhill side"),
        (Embankment(39.0, 1.0, 1.0), "embankment x", "stay on the terrain"),
    ],
)
def test_what_does_not_fit_is_refused(barrier, field, mend):
    with pytest.raises(BadInput, match=mend) as caught:
        earthworks(SLOPE, [barrier], "soil")
    assert caught.value.field == field


@pytest.mark.parametrize(("fall", "side"), [(0.1, 0.5), (0.5, 1.0), (0.5, 1.9), (0.9, 1.0)])
def test_the_least_width_of_a_ditch_on_a_slope(fall, side):
    """The floor has the width W - s (2 d + W t) on a slope t, with sides s and a depth d."""
    slope, depth = Terrain([(0.0, 200.0 * fall), (200.0, 0.0)]), 1.5
    least = 2.0 * side * depth / (1.0 - side * fall)
    with pytest.raises(BadInput, match=f"give more than {least:g}, or less depth"):
        earthworks(slope, [Ditch(10.0, depth, 0.9 * least, side)], "soil")
    earthworks(slope, [Ditch(10.0, depth, least + 0.01, side)], "soil")


@pytest.mark.parametrize("width", [2.0, 20.0])
def test_a_ditch_that_no_width_makes_possible(width):
    slope = Terrain([(0.0, 200.0), (200.0, 0.0)])
    with pytest.raises(BadInput, match="give less depth or steeper sides"):
        earthworks(slope, [Ditch(10.0, 1.5, width, 1.0)], "soil")


def test_faces_and_overhangs_are_refused():
    for points in (
        [(0, 10), (6, 10), (6, 0), (30, 0)],
        [(0, 10), (6, 10), (5, 0), (30, 0)],
    ):
        with pytest.raises(BadInput, match="no vertical face or overhang"):
            earthworks(Terrain(points), [Ditch(4.0, 1.0, 4.0)], "soil")


def test_a_scene_stands_on_the_changed_ground():
    surfaces = rock() | {"soil": Surface(35.0)}
    barriers = (Ditch(0.0, 1.0, 4.0), Embankment(6.0, 1.0, 2.0), Wall(7.0, 2.0, 0.5))
    scene = Scene(Terrain(FLAT), (box(2.0, 1.0),), surfaces, barriers=barriers)
    assert scene.terrain is not scene.ground
    assert "soil" in scene.ground.surfaces
    assert scene.outline(2)[:, 1].max() == pytest.approx(3.0)
    run = Simulation(scene).run(2.0)
    assert run.poses[-1, 0, 1] == pytest.approx(-0.5, abs=1e-2)


def test_an_embankment_without_soil_is_of_the_surface_of_barriers():
    scene = Scene(
        Terrain(FLAT),
        (box(2.0, 1.0),),
        rock() | {"concrete": Surface(40.0)},
        barriers=(Embankment(6.0, 1.0),),
    )
    assert scene.ground.surfaces == ("rock", "concrete", "concrete", "concrete", "rock")
