"""Blocks that are not convex: their parts, their contacts, and rest across reentrant corners."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from physics.helpers import FLAT, polygon, rock
from physics.shapes import KEYHOLE, SHAPES, L, T, U, overlap, star

from rigdda import BadInput, Block, Scene, Settings, Simulation, Terrain
from rigdda.geometry import convex_parts, is_convex

AWAKE = Settings(sleeping=False)


def check_parts(corners: np.ndarray) -> list[list[int]]:
    """Assert that the parts are convex and together are the polygon; return them."""
    parts = convex_parts(corners)
    whole, cells = shapely.Polygon(corners), [shapely.Polygon(corners[part]) for part in parts]
    assert all(is_convex(corners[part]) for part in parts)
    assert all(cell.exterior.is_ccw for cell in cells)
    assert sum(cell.area for cell in cells) == pytest.approx(whole.area, rel=1e-12)
    assert shapely.union_all(cells).symmetric_difference(whole).area < 1e-12 * whole.area
    return parts


@given(st.integers(0, 2**32 - 1), st.integers(4, 40), st.floats(0.01, 100.0))
def test_parts_of_any_star(seed, n, size):
    corners = star(np.random.default_rng(seed), n, size) + 1e3
    parts = check_parts(corners)
    reentrant = n - len(shapely.Polygon(corners).convex_hull.exterior.coords) + 1
    assert len(parts) <= 2 * n - 5 if reentrant else len(parts) == 1


@pytest.mark.parametrize(
    "name, count", [("L", 2), ("U", 3), ("T", 2), ("plus", 3), ("dart", 2), ("keyhole", 5)]
)
def test_parts_of_shapes(name, count):
    assert len(check_parts(SHAPES[name])) == count


def test_corners_within_edges_need_no_parts():
    flat = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    assert len(check_parts(np.array(flat, dtype=float))) == 1
    check_parts(np.array([(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (2, 1), (1, 1), (1, 3), (0, 3)]))


@pytest.mark.parametrize(
    "corners, words",
    [
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "untangle"),
        ([(0, 0), (2, 0), (2, 2), (1, 0), (0, 2)], "untangle"),
        ([(0, 0), (1, 0), (2, 0)], "area|untangle"),
        ([(0, 0), (3, 0), (3, 0), (1, 1), (0, 3)], "repeats"),
        ([(0, 0), (3, 0), (1, 1), (0, 3), (0, 0)], "repeats"),
    ],
    ids=["crosses", "touches", "no area", "repeats", "closed"],
)
def test_unsound_polygons_are_refused(corners, words):
    with pytest.raises(BadInput, match=words):
        Block(corners)


@pytest.mark.parametrize("name", SHAPES)
def test_either_winding(name):
    for corners in (SHAPES[name], SHAPES[name][::-1]):
        assert shapely.Polygon(Block(corners).vertices).exterior.is_ccw


def settle(blocks, duration, terrain=FLAT, friction=35.0) -> Simulation:
    """Run blocks on the ground; assert that no two of them ever overlap."""
    sim = Simulation(Scene(Terrain(terrain), blocks, rock(friction)), AWAKE)
    for _ in range(round(duration / sim.settings.dt / 10)):
        sim.step(10)
        for i in range(len(blocks)):
            for j in range(i):
                assert overlap(sim, i, j) < 1e-2, (i, j, sim.time)
    return sim


def assert_rest(sim, penetration=1e-3) -> None:
    assert np.abs(sim.velocities).max() < 1e-4
    assert sim.contacts()["penetration"].max() < penetration


def forces_on(sim, block) -> np.ndarray:
    """Return the sum of the contact forces on a block [N]."""
    c = sim.contacts()
    normal = np.stack([c["nx"], c["ny"]], axis=1)
    shear = np.stack([-c["ny"], c["nx"]], axis=1)
    force = c["normal_force"][:, None] * normal + c["shear_force"][:, None] * shear
    sign = (c["block_a"] == block).astype(float) - (c["block_b"] == block)
    return sign @ force


POST = [(1.0, 0.0), (2.0, 0.0), (2.0, 6.0), (1.0, 6.0)]


@pytest.mark.parametrize("play", [0.0, 1e-3, 0.05])
def test_u_hung_over_a_post_stays(play):
    """Its weight goes into the top of the post, at the crown of the U."""
    slim = np.array(POST) + np.array([(1, 0), (-1, 0), (-1, 0), (1, 0)]) * play
    hung = U[::-1] * (1.0, -1.0) + (0.0, 7.0)
    sim = settle((Block(slim, fixed=True), Block(hung)), 3.0)
    assert_rest(sim)
    assert sim.poses[1, :2] == pytest.approx(np.array([1.5, 7.0 - 1.357142857]), abs=2e-3)
    weight = 7.0 * 2600.0 * 9.81
    assert forces_on(sim, 1) == pytest.approx([0.0, weight], abs=1e-3 * weight)


def test_u_straddles_a_wall():
    """Dropped from 0.3 m with play, it comes to rest with its crown on the wall's top."""
    wall = np.array(POST) + np.array([(1, 0), (-1, 0), (-1, 0), (1, 0)]) * 0.1
    sim = settle((Block(wall, fixed=True), Block(U[::-1] * (1.0, -1.0) + (0.0, 7.3))), 5.0)
    assert_rest(sim)
    assert sim.poses[1, 1] == pytest.approx(7.0 - 1.357142857, abs=2e-3)


def test_l_hooked_over_a_block():
    """Statics: it would tip about the edge inside its corner, but its leg leans on the side."""
    post = Block([(0.0, 0.0), (3.0, 0.0), (3.0, 4.0), (0.0, 4.0)], fixed=True)
    hook = polygon(L, (4.0, 5.0), np.pi)  # arm to the left on the top, leg down on the right side
    sim = settle((post, Block(hook)), 3.0)
    assert_rest(sim)
    weight = 5.0 * 2600.0 * 9.81
    assert forces_on(sim, 1) == pytest.approx([0.0, weight], abs=1e-3 * weight)


def test_square_in_a_notch_rests():
    """An L with its notch up at 45 degrees holds a square on both faces."""
    cradle = polygon(L - 1.0, (0.0, 3.0), np.pi / 4)
    stone = polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + 1e-4, (0.0, 3.0), np.pi / 4)
    sim = settle((Block(cradle, fixed=True), Block(stone)), 3.0)
    assert_rest(sim)
    corner = sim.vertices(1)[0]
    assert corner == pytest.approx([0.0, 3.0], abs=2e-3)
    weight = 2600.0 * 9.81
    c = sim.contacts()
    up = (c["normal_force"] * c["ny"] + c["shear_force"] * c["nx"]).sum()
    across = (c["normal_force"] * c["nx"] - c["shear_force"] * c["ny"]).sum()
    assert (across, up) == pytest.approx((0.0, weight), abs=1e-3 * weight)
    # each face would carry the weight times cos 45, but friction may hold the square squeezed
    mu = np.tan(np.radians(35.0))
    squeeze = c["normal_force"].sum() / (np.sqrt(2.0) * weight)
    assert 1.0 / (1.0 + mu) < squeeze < 1.0 / (1.0 - mu)


def test_t_hangs_in_a_keyhole():
    """Its bar cannot pass the slot that its stem is in."""
    inside = T * (0.8, -0.8) + (1.3, 5.5)  # bar below the slot, stem up through it
    hole = Block(KEYHOLE, fixed=True)
    sim = settle((hole, Block(inside, velocity=(0.0, 4.0, 0.0))), 4.0)
    assert sim.vertices(1)[:, 1].max() < 5.61
    assert_rest(sim)


def test_key_in_a_keyhole_stands_still():
    """A T with its bar on the floor of the hole and its stem in the slot."""
    key = np.array([(1, 1), (4, 1), (4, 2), (3, 2), (3, 6), (2, 6), (2, 2), (1, 2)], dtype=float)
    sim = settle((Block(KEYHOLE, fixed=True), Block(key)), 3.0)
    assert_rest(sim)
    assert sim.poses[1, :2] == pytest.approx([2.5, (3.0 * 1.5 + 4.0 * 4.0) / 7.0], abs=1e-3)


def test_two_hooks_lean_on_each_other():
    """Two L's, one across the other's reentrant corner, on the ground."""
    lower, upper = L, polygon(L, (4.0, 3.0), np.pi)
    sim = settle((Block(lower), Block(upper)), 3.0)
    assert_rest(sim)
    assert sim.poses[1, :2] == pytest.approx([4.0, 3.0] - sim.poses[0, :2], abs=1e-3)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
def test_shapes_come_to_rest_on_the_ground(name, turn):
    sim = settle((Block(polygon(SHAPES[name], (0.0, 6.0), turn)),), 8.0)
    assert_rest(sim)
    assert sim.vertices(0)[:, 1].min() > -1e-3


@pytest.mark.parametrize("seed", range(6))
def test_pile_of_stars_never_overlaps(seed):
    rng = np.random.default_rng(seed)
    blocks = [
        Block(polygon(star(rng, rng.integers(5, 10)), (0.4 * (i % 3) - 0.4, 1.5 + 2.1 * i)))
        for i in range(6)
    ]
    settle(blocks, 4.0, [(-6.0, 6.0), (-2.0, 0.0), (2.0, 0.0), (6.0, 6.0)])


@pytest.mark.parametrize("speed", [1.0, 20.0])
def test_no_snag_on_a_cut(speed):
    """A square slides without friction over a face that cuts end at: it keeps its speed."""
    teeth = [p for x in range(2, 39, 4) for p in ((x, 0), (x + 1, 1.9), (x + 1.5, 0))]
    top = [(x, 2) for x in range(40, -1, -4)]
    floor = Block(np.array([(0, 0), *teeth, (40, 0), *top], dtype=float), fixed=True)
    slider = Block(np.array([(1, 2), (2, 2), (2, 3), (1, 3)], dtype=float), velocity=(speed, 0, 0))
    sim = Simulation(Scene(None, (floor, slider), rock(0.0)), AWAKE)
    sim.step(round(36.0 / speed / sim.settings.dt) if speed > 5 else 2000)
    assert sim.velocities[1] == pytest.approx([speed, 0.0, 0.0], abs=2e-3)
