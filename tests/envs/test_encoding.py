"""Vectors and layouts: every vector is a layout that can be built, and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from envs import encoding
from rigdda import BadInput, Layout, Wall
from rigdda.site import BarrierZone

ZONE = BarrierZone(10.0, 30.0, max_height=4.0, min_thickness=0.5, max_thickness=2.0)
NEAR = 1e-9


@st.composite
def zones(draw: st.DrawFn) -> BarrierZone:
    low = draw(st.floats(0.1, 2.0))
    high = low + draw(st.sampled_from([0.0, 0.3, 2.5]))
    start = draw(st.floats(-50.0, 200.0))
    length = high + draw(st.floats(0.0, 60.0))
    return BarrierZone(start, start + length, draw(st.floats(0.6, 9.0)), low, high)


def vectors(slots: st.SearchStrategy[int]) -> st.SearchStrategy[np.ndarray]:
    return slots.flatmap(lambda n: arrays(float, 3 * n, elements=st.floats(-1.0, 1.0)))


def numbers(layout: Layout) -> np.ndarray:
    return np.array([(wall.x, wall.height, wall.thickness) for wall in layout]).reshape(-1, 3)


@settings(deadline=None)
@given(zones(), vectors(st.integers(1, 6)))
def test_every_vector_is_a_layout_that_can_be_built(zone: BarrierZone, vector: np.ndarray) -> None:
    layout = encoding.decode(zone, vector)
    assert encoding.check_layout(zone, layout) == layout
    x, height, thickness = numbers(layout).T
    assert len(layout) <= len(vector) // 3
    assert (height >= encoding.MIN_HEIGHT).all()
    assert (x[1:] - (x + thickness)[:-1] >= encoding.MIN_GAP - NEAR).all()


@settings(deadline=None)
@given(zones(), vectors(st.integers(1, 6)), st.integers(0, 2))
def test_encoding_is_undone_by_decoding(zone: BarrierZone, vector: np.ndarray, spare: int) -> None:
    layout = encoding.decode(zone, vector)
    slots = len(vector) // 3 + spare
    code = encoding.encode(zone, layout, slots)
    assert code.shape == (3 * slots,)
    assert np.abs(code).max() <= 1.0
    again = numbers(encoding.decode(zone, code))
    np.testing.assert_allclose(again, numbers(layout), rtol=0, atol=NEAR)


@settings(deadline=None)
@given(vectors(st.just(4)), st.permutations(range(4)))
def test_the_order_of_the_slots_does_not_matter(vector: np.ndarray, order: list[int]) -> None:
    shuffled = vector.reshape(4, 3)[order].ravel()
    assert encoding.decode(ZONE, shuffled) == encoding.decode(ZONE, vector)


@settings(deadline=None)
@given(arrays(float, 9, elements=st.floats(allow_nan=False)))
def test_numbers_beyond_the_bounds_are_clipped(values: np.ndarray) -> None:
    vector = encoding.vector("action", values, 9)
    np.testing.assert_array_equal(vector, np.clip(values, -1.0, 1.0))


def test_the_whole_range_of_a_wall() -> None:
    lowest = encoding.decode(ZONE, np.array([-1.0, 2 * 0.5 / 4.0 - 1.0, -1.0]))
    assert lowest == (Wall(10.0, 0.5, 0.5),)
    assert encoding.decode(ZONE, np.ones(3)) == (Wall(28.0, 4.0, 2.0),)
    assert encoding.decode(ZONE, np.zeros(3)) == (Wall(10.0 + 0.5 * 18.75, 2.0, 1.25),)
    assert encoding.decode(ZONE, np.array([0.0, 2 * 0.49 / 4.0 - 1.0, 0.0])) == ()
    assert encoding.decode(ZONE, np.full(9, -1.0)) == ()


def slots(*walls: tuple[float, float, float]) -> np.ndarray:
    """Return the vector of walls (x, height, thickness), however close they are."""
    return np.concatenate([encoding.encode(ZONE, [Wall(*wall)], 1) for wall in walls])


def test_walls_apart_stay_where_they_are() -> None:
    walls = [(11.0, 2.0, 1.0), (14.0, 3.0, 1.0), (20.0, 1.0, 2.0)]
    np.testing.assert_allclose(numbers(encoding.decode(ZONE, slots(*walls))), walls, atol=NEAR)


def test_close_walls_move_apart_both_ways() -> None:
    layout = encoding.decode(ZONE, slots((20.5, 3.0, 1.0), (20.0, 2.0, 1.0)))
    expected = [(18.75, 2.0, 1.0), (21.75, 3.0, 1.0)]
    np.testing.assert_allclose(numbers(layout), expected, atol=NEAR)


def test_close_walls_at_the_end_of_the_zone_stay_inside() -> None:
    layout = encoding.decode(ZONE, slots((29.0, 3.0, 1.0), (28.5, 2.0, 1.0)))
    expected = [(26.0, 2.0, 1.0), (29.0, 3.0, 1.0)]
    np.testing.assert_allclose(numbers(layout), expected, atol=NEAR)


def test_the_lowest_wall_is_dropped_where_there_is_no_room() -> None:
    short = BarrierZone(10.0, 15.0, min_thickness=1.0, max_thickness=1.0)
    vector = np.concatenate(
        [encoding.encode(short, [Wall(x, h, 1.0)], 1) for x, h in [(10, 2), (12, 1), (14, 3)]]
    )
    layout = encoding.decode(short, vector)
    np.testing.assert_allclose(numbers(layout), [(10, 2, 1), (14, 3, 1)], atol=NEAR)


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ([Wall(9.0, 1.0)], r"layout\[0\]\.x = 9\.0: give a number of at least 10 and at most 29"),
        ([Wall(29.5, 1.0)], r"layout\[0\]\.x = 29\.5: .* at most 29$"),
        ([Wall(12.0, 1.0), Wall(20.0, 4.5)], r"layout\[1\]\.height = 4\.5: .* at most 4$"),
        ([Wall(12.0, 1.0, 3.0)], r"layout\[0\]\.thickness = 3\.0"),
        ([Wall(12.0, 0.4)], r"layout\[0\]\.height = 0\.4: give a number of at least 0\.5"),
        ([Wall(12.0, 1.0), Wall(14.5, 1.0)], r"layout\[1\]\.x = 14\.5: put it 2 m downhill"),
        ([Wall(x, 1.0) for x in (11, 15, 19, 23)], "layout = '4 barriers': give at most 3"),
        ([(12.0, 1.0, 1.0)], r"layout\[0\] = \(12\.0, 1\.0, 1\.0\): give barriers: rigdda\.Wall"),
        (Wall(12.0, 1.0), "layout = Wall.*: give a sequence"),
    ],
)
def test_layouts_that_no_vector_gives_are_refused(layout: list[Wall], message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        encoding.encode(ZONE, layout, 3)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.zeros(8), r"shape of action = \(8,\): give 9 numbers, shape \(9,\)"),
        (np.zeros((3, 3)), r"shape of action = \(3, 3\)"),
        (0.5, r"shape of action = \(\)"),
        ([0.0] * 4 + [float("nan")] + [0.0] * 4, r"action\[4\] = nan: give a number"),
        ([[1.0], [2.0, 3.0]], "action = .*: give 9 numbers"),
        ("high", "action = 'high': give 9 numbers"),
        (None, "action"),
    ],
)
def test_vectors_of_the_wrong_shape_or_kind_are_refused(value: object, message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        encoding.vector("action", value, 9)
    assert "\n" not in str(caught.value)
