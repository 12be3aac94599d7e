"""New barriers, their handles, and what dragging a handle means."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from light_site import LIGHT

from rigdda import BadInput, Ditch, Embankment, Fence, GravityWall, Removal, Site, Wall
from rigdda.app.page import placing
from rigdda.app.page.figures import broken_rules
from rigdda.app.page.section import graded

OLD_FENCE = Site.load("old-fence")


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


@settings(deadline=None)
@given(
    elongation=st.floats(0.05, 9.0),
    place=st.integers(0, 1),
    x=st.floats(16.0, 30.0),
    y=st.floats(-5.0, 40.0),
)
def test_a_fence_that_is_dragged_keeps_the_elongation_that_it_was_given(elongation, place, x, y):
    fence = Fence(17.0, 3.0, capacity=50e3, elongation=elongation, thickness=0.3)
    grip = placing.grips(LIGHT, (fence,))[place]
    (moved,) = placing.dragged(LIGHT, (fence,), grip, x, y)
    assert (moved.capacity, moved.thickness) == (50e3, 0.3)
    assert moved.elongation == elongation


def test_the_elongation_of_a_fence_follows_its_class():
    fence = Fence(28.0, 3.0, energy_class=500)
    larger = placing.with_field(fence, "energy_class", 1000)
    assert larger == Fence(28.0, 3.0, energy_class=1000)
    assert placing.with_field(larger, "x", 27.0).elongation == larger.elongation


CHAINAGE = st.floats(16.0, 31.0).map(lambda x: round(x, 1))
SIZE = st.floats(0.5, 4.0).map(lambda size: round(size, 1))
BARRIER = st.one_of(
    st.builds(Fence, x=CHAINAGE, height=st.just(2.0), energy_class=st.just(500)),
    st.builds(Ditch, x=CHAINAGE, depth=SIZE, width=SIZE),
    st.builds(Embankment, x=CHAINAGE, height=SIZE, width=SIZE),
    st.builds(GravityWall, x=CHAINAGE, height=SIZE, thickness=SIZE),
    st.builds(Wall, x=CHAINAGE, height=SIZE, thickness=SIZE),
    st.just(Removal(21.0)),
)


def _simulated(site, layout):
    """Return the outlines in the scene of a release; None if there is none."""
    try:
        scene = site.realise(layout, 0, site.event_names[0])
    except BadInput:
        return None
    return [scene.outline(i) for i in range(len(scene.barriers))]


@settings(max_examples=150, deadline=None)
@given(site=st.sampled_from([LIGHT, OLD_FENCE]), layout=st.lists(BARRIER, max_size=3).map(tuple))
def test_barriers_are_drawn_as_they_are_simulated_and_each_once(site, layout):
    drawn = graded(site, layout).barriers
    simulated = _simulated(site, layout)
    if simulated is not None:
        assert len(drawn) == len(simulated)
        for (_, outline, _), corners in zip(drawn, simulated, strict=True):
            assert np.array_equal(outline, corners)
    for barrier in {one for one, _, _ in drawn}:
        shown = sum(one == barrier for one, _, _ in drawn)
        assert shown <= layout.count(barrier) + site.existing_barriers.count(barrier)


def test_a_fence_on_the_crest_of_an_embankment_is_drawn_and_dragged_there():
    embankment = Embankment(x=22.0, height=2.0, width=2.0)
    fence = Fence(x=23.5, height=2.0, energy_class=500)
    layout = (embankment, fence)
    outlines = {barrier: outline for barrier, outline, _ in graded(LIGHT, layout).barriers}
    crest = outlines[embankment][:, 1].max()
    assert outlines[fence][:, 1].max() == pytest.approx(crest + 2.0)
    foot, top = (grip for grip in placing.grips(LIGHT, layout) if grip.place == 1)
    assert foot.y == pytest.approx(crest)
    assert top.y == pytest.approx(crest + 2.0)


def test_existing_barriers_are_drawn_once_beside_barriers_that_cannot_stand():
    impossible, fence = Ditch(x=18.0, depth=3.0, width=1.0), Fence(26.0, 2.0, energy_class=100)
    found = [barrier for barrier, _, _ in graded(OLD_FENCE, (impossible, fence)).barriers]
    assert sorted(found, key=str) == sorted((*OLD_FENCE.existing_barriers, fence), key=str)


def test_barriers_that_cannot_stand_together_are_all_drawn():
    one, other = Ditch(x=22.0, depth=1.0, width=3.0), Ditch(x=22.0, depth=0.5, width=3.0)
    assert _simulated(LIGHT, (one, other)) is None
    found = graded(LIGHT, (one, other)).barriers
    assert [barrier for barrier, _, _ in found] == [one, other]
    assert all(math.isfinite(outline.sum()) for _, outline, _ in found)
