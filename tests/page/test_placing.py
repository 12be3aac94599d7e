"""New barriers, their handles, and what dragging a handle means."""

import pytest
from light_site import LIGHT

from rigdda import BadInput, Ditch, Fence
from rigdda.app.page import placing
from rigdda.app.page.figures import broken_rules


@pytest.mark.parametrize("kind", ["fence", "ditch", "embankment", "gravity_wall", "wall"])
def test_a_new_barrier_is_where_the_rules_allow_it(kind):
    try:
        new = placing.new_barrier(LIGHT, (), kind)
    except BadInput as bad:
        assert "no place" in str(bad.value)
        return
    assert new.kind == kind
    assert broken_rules(LIGHT, (new,)) == ()


def test_a_second_fence_stands_clear_of_the_first():
    first = placing.new_barrier(LIGHT, (), "fence")
    second = placing.new_barrier(LIGHT, (first,), "fence")
    layout = tuple(sorted((first, second), key=lambda barrier: barrier.x))
    assert second.x != first.x
    assert broken_rules(LIGHT, layout) == ()


def test_the_handles_of_a_fence_move_it_and_make_it_higher():
    layout = (Fence(28.0, 3.0, energy_class=1000),)
    place, top = placing.grips(LIGHT, layout)
    assert (place.field, top.field) == ("x", "height")
    assert top.y == pytest.approx(place.y + 3.0)
    moved = placing.dragged(LIGHT, layout, place, 26.43, 50.0)
    assert moved == (Fence(26.4, 3.0, energy_class=1000),)
    taller = placing.dragged(LIGHT, layout, top, 0.0, top.y + 1.02)
    assert taller == (Fence(28.0, 4.0, energy_class=1000),)
    lowest = placing.dragged(LIGHT, layout, top, 0.0, top.y - 9.0)
    assert lowest[0].height > 0.0


def test_the_handles_of_a_ditch_change_its_depth_and_width():
    layout = (Ditch(30.0, 1.0, 3.0),)
    grips = {grip.field: grip for grip in placing.grips(LIGHT, layout)}
    assert set(grips) == {"x", "depth", "width"}
    deeper = placing.dragged(LIGHT, layout, grips["depth"], 0.0, grips["depth"].y - 0.5)
    assert deeper[0].depth == pytest.approx(1.5)
    wider = placing.dragged(LIGHT, layout, grips["width"], grips["width"].x + 0.4, 0.0)
    assert wider[0].width == pytest.approx(3.4)


def test_a_fence_of_another_class_has_a_height_of_that_class():
    fence = Fence(28.0, 5.0, energy_class=3000)
    small = placing.with_field(fence, "energy_class", 100)
    assert small.energy_class == 100
    assert small.height < 5.0


def test_a_broken_rule_tells_its_reason():
    (told,) = broken_rules(LIGHT, (Fence(31.0, 3.0, energy_class=1000),))
    assert "road begins at 34.8" in told
