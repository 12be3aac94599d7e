"""The lumped-mass model against closed forms."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigdda import BadInput, Ditch, Embankment, GravityWall, Site, Terrain, lumped
from rigdda.dynamics.point_mass import trajectories
from rigdda.lumped_mass import smoothed

G = 9.81


def follow(ground, law, start, line=1e9):
    """Return run-out, speed and height of one point on ground of one surface."""
    corners, found = np.array(ground, dtype=float), np.zeros((1, 3))
    normal, tangential, angle = law
    laws = np.tile([normal, tangential, math.tan(math.radians(angle))], (1, len(corners) - 1, 1))
    trajectories(corners, laws, np.array([start], dtype=float), G, line, found)
    return found[0]


@given(st.floats(31.0, 60.0), st.floats(5.0, 30.0), st.floats(1.0, 50.0))
def test_it_slides_down_and_out(slope, friction, length):
    """Down a slope from rest, past a corner that takes what is normal, onto level ground."""
    a, mu = math.radians(slope), math.tan(math.radians(friction))
    ground = [(0.0, 0.0), (60.0 * math.cos(a), -60.0 * math.sin(a))]
    ground.append((ground[1][0] + 5000.0, ground[1][1]))
    begin = 60.0 - length
    start = (begin * math.cos(a), -begin * math.sin(a), 0.0, 0.0)
    square = 2.0 * G * length * (math.sin(a) - mu * math.cos(a)) * math.cos(a) ** 2
    exact = ground[1][0] + square / (2.0 * G * mu)
    assert follow(ground, (0.0, 1.0, friction), start)[0] == pytest.approx(exact, rel=1e-9)


def test_it_bounces_along():
    """Parabolas whose rise and speed shrink by the coefficients, then a slide."""
    x, vx, vy = 0.0, 3.0, math.sqrt(2.0 * G * 5.0)
    x = vx * vy / G
    while 0.5 * vy >= 0.05:
        vx, vy = 0.8 * vx, 0.5 * vy
        x += vx * 2.0 * vy / G
    x += (0.8 * vx) ** 2 / (2.0 * G * math.tan(math.radians(20.0)))
    found = follow([(-10.0, 0.0), (500.0, 0.0)], (0.5, 0.8, 20.0), (0.0, 5.0, 3.0, 0.0), 1.0)
    fall = 1.0 / 3.0
    assert found[0] == pytest.approx(x, rel=1e-9)
    assert found[1] == pytest.approx(math.hypot(3.0, G * fall))
    assert found[2] == pytest.approx(5.0 - 0.5 * G * fall**2)


@given(st.floats(0.0, 1.0), st.floats(0.3, 1.0), st.floats(10.0, 50.0), st.integers(0, 2**31))
def test_it_never_gains_energy_nor_leaves_the_ground(normal, tangential, friction, seed):
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(0.5, 5.0, 20))
    ground = np.column_stack([x, np.cumsum(rng.uniform(-4.0, 1.0, 20))])
    height, speed = rng.uniform(0.0, 3.0), rng.uniform(0.0, 10.0)
    top = np.interp(x[2] + 0.1, x, ground[:, 1]) + height
    end, passed, over = follow(ground, (normal, tangential, friction),
                               (x[2] + 0.1, top, speed, 0.0), x[15])  # fmt: skip
    assert x[0] <= end <= x[-1]
    if not math.isnan(passed):
        level = np.interp(x[15], *ground.T)
        before = 0.5 * speed**2 + G * top
        assert 0.5 * passed**2 + G * (level + over) <= before * (1.0 + 1e-9) + 1e-9
        assert over >= 0.0


def test_releases_of_a_site_are_points():
    site = Site.load("verge")
    points = lumped(site, (), range(200), "group")
    assert set(points.release) == set(range(200)) and len(points.mass) > 800
    assert 0.0 < points.reached.mean() < 1.0
    assert np.isnan(points.energy).sum() == (~points.reached).sum()
    again = lumped(site, (), range(200), "group")
    np.testing.assert_array_equal(points.run_out, again.run_out)
    ditch = lumped(site, (Ditch(6.0, 1.5, 4.0),), range(200), "group")
    assert ditch.reached.mean() < points.reached.mean()


def on_slope(points):
    """Return what becomes of blocks of 0.3 to 1.1 m on another slope of a built-in site."""
    site = Site.load("ritchie-60")
    slope = msgspec.structs.replace(site.slope, points=tuple(map(tuple, points)))
    return lumped(msgspec.structs.replace(site, slope=slope), (), range(10))


def with_features(points, depth, width, places):
    """Return the ground with a notch, or a bump of negative depth, at each of some chainages."""
    x, y = np.transpose(points)
    more = np.add.outer(places, width * np.array([0.0, 0.1, 0.9, 1.0])).ravel()
    new = np.interp(more, x, y) - depth * np.tile([0.0, 1.0, 1.0, 0.0], len(places))
    return sorted([*map(tuple, points), *zip(more.tolist(), new.tolist(), strict=True)])


FACE = (Site.load("ritchie-60").slope.points[1], Site.load("ritchie-60").slope.points[2])
"""Crest and toe of a face at 60 deg."""


@pytest.mark.parametrize("depth", [1e-3, 1e-2, -1e-3, -1e-2])
@pytest.mark.parametrize("width", [1e-3, 1e-2, 0.1])
def test_features_far_smaller_than_a_block_do_not_stop_it(depth, width):
    """On the face, where points slide and bounce, and where they run out."""
    points = Site.load("ritchie-60").slope.points
    plain = on_slope(points)
    assert 0.5 < plain.reached.mean() < 1.0
    (start, _), (toe, _) = FACE
    places = np.array([start + 3.0, 0.5 * (start + toe), toe - 2.0, toe + 3.0])
    rough = on_slope(with_features(points, depth, width, places))
    np.testing.assert_array_equal(rough.reached, plain.reached)
    np.testing.assert_allclose(rough.run_out, plain.run_out, rtol=1e-9)


def test_a_step_far_smaller_than_a_block_does_not_stop_it():
    """A step of 1 cm up, without an end, where points slide out on level ground."""
    points, x = list(Site.load("ritchie-60").slope.points), FACE[1][0] + 2.0
    after = [(x + 1e-3, 0.01), *((at, y + 0.01) for at, y in points if at > x)]
    stepped, plain = (
        on_slope([*(p for p in points if p[0] < x), (x, 0.0), *after]),
        on_slope(points),
    )
    assert stepped.reached.mean() == pytest.approx(plain.reached.mean(), abs=0.02)
    assert stepped.run_out.mean() == pytest.approx(plain.run_out.mean(), rel=0.01)


def test_a_ditch_larger_than_a_block_stops_it():
    points, toe = Site.load("ritchie-60").slope.points, FACE[1][0]
    ditched = on_slope(with_features(points, 1.0, 4.0, np.array([toe + 0.5])))
    assert ditched.reached.mean() < 0.5 * on_slope(points).reached.mean()


@pytest.mark.parametrize("count", [3, 30, 3_000])
def test_straight_slopes_may_be_divided_finely(count):
    points = np.array(Site.load("ritchie-60").slope.points)
    x = np.union1d(points[:, 0], np.linspace(*np.array(FACE)[:, 0], count))
    divided = on_slope(np.column_stack([x, np.interp(x, *points.T)]))
    np.testing.assert_allclose(divided.run_out, on_slope(points).run_out, rtol=1e-9)


def test_ground_that_a_block_feels():
    """A notch of 1 cm with a surface of its own goes, its surface and a step of 0.3 m stay."""
    points = [
        (0.0, 10.0),
        (4.0, 6.0),
        (4.001, 5.989),
        (4.02, 5.98),
        (6.0, 4.0),
        (6.1, 3.6),
        (9.0, 3),
    ]
    names = ["rock", "soil", "soil", "rock", "rock", "grass"]
    corners, surfaces = smoothed(Terrain(points, names), 1.0)
    exact = [(0.0, 10.0), (4.0, 6.0), (4.02, 5.98), (6.0, 4.0), (6.1, 3.6), (9.0, 3.0)]
    np.testing.assert_allclose(corners, exact, atol=1e-12)
    assert surfaces == ("rock", "soil", "rock", "rock", "grass")
    everything, _ = smoothed(Terrain(points, names), 0.005)
    np.testing.assert_array_equal(everything, points)


def test_it_says_what_it_does_not_know():
    with pytest.raises(BadInput, match=r"gravity_wall.*use the block model"):
        lumped(Site.load("verge"), (GravityWall(9.0, 2.0),))
    with pytest.raises(BadInput, match="overhangs"):
        lumped(Site.load("toppling"))
    with pytest.raises(BadInput, match="outside the loose rock"):
        lumped(Site.load("quick"), (Embankment(7.0, 2.0),))
    for seeds in ([], 3):
        with pytest.raises(BadInput, match="seeds"):
            lumped(Site.load("quick"), (), seeds)
