"""Area, centroid and second moment against shapely and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from physics.helpers import ngon, polygon, rough
from shapely.ops import triangulate

from rigdda.geometry import polygon_properties, without_straight_corners


def second_moment(corners: np.ndarray) -> float:
    """Return the polar second moment about the centroid, summed over shapely's triangles."""
    whole = shapely.Polygon(corners)
    centre = np.array(whole.centroid.coords[0])
    total = 0.0
    for triangle in triangulate(whole):
        p = np.array(triangle.exterior.coords)[:3] - centre
        middle = np.array([p[0] + p[1], p[1] + p[2], p[2] + p[0]]) / 2.0
        total += triangle.area * (middle**2).sum() / 3.0  # exact for squares
    return total


@given(
    st.integers(0, 2**32 - 1),
    st.integers(3, 12),
    st.floats(0.01, 100.0),
    st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)),
)
def test_against_shapely(seed, n, size, place):
    corners = polygon(rough(np.random.default_rng(seed), n, size), place)
    area, centre, second = polygon_properties(corners)
    whole = shapely.Polygon(corners)
    scale = 1e-12 * max(1.0, np.abs(corners).max() / size)
    assert area == pytest.approx(whole.area, rel=100.0 * scale)
    assert np.abs(centre - whole.centroid.coords[0]).max() < 100.0 * scale * np.abs(corners).max()
    assert second == pytest.approx(second_moment(corners - centre), rel=100.0 * scale)


def test_rectangle():
    area, centre, second = polygon_properties(
        np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)])
    )
    assert (area, *centre) == (6.0, 1.5, 1.0)
    assert second == pytest.approx(6.0 * (9.0 + 4.0) / 12.0, rel=1e-15)


@pytest.mark.parametrize("n", [3, 6, 100])
def test_regular_polygon(n):
    area, centre, second = polygon_properties(ngon(n, 2.0, (7.0, -3.0), 0.3))
    turn = 2.0 * math.pi / n
    assert area == pytest.approx(2.0 * n * math.sin(turn), rel=1e-12)
    assert centre == pytest.approx([7.0, -3.0], abs=1e-12)
    assert second == pytest.approx(area * 4.0 * (2.0 + math.cos(turn)) / 6.0, rel=1e-12)


@given(st.integers(0, 2**32 - 1), st.integers(3, 9), st.floats(0.1, 100.0), st.integers(0, 20))
def test_corners_within_edges_are_left_out_and_all_others_kept(seed, n, size, shift):
    rng = np.random.default_rng(seed)
    corners = polygon(ngon(n, size), (1e3 * rng.random(), 1e4 * rng.random()))
    more = []
    for k in range(n):
        shares = np.sort(rng.random(rng.integers(0, 4)))[:, None]
        more += [corners[k], *(corners[k] + shares * (corners[(k + 1) % n] - corners[k]))]
    found = without_straight_corners(np.roll(more, shift, axis=0))
    assert sorted(map(tuple, found)) == sorted(map(tuple, corners))
    np.testing.assert_array_equal(without_straight_corners(corners[::-1]), corners[::-1])


def test_of_corners_that_nearly_coincide_one_stays():
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1e-12), (1.0, 1.0), (1.0 - 1e-12, 1.0), (0.0, 1.0)]
    found = without_straight_corners(np.array(square))
    np.testing.assert_allclose(found, [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], atol=1e-11)
