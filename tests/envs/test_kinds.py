"""Several kinds of barrier in one decision vector."""

from __future__ import annotations

from itertools import pairwise

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import envs  # noqa: F401, registers the environments
from envs import DesignProblem, encoding
from envs.observation import observe, space
from rigdda import BadInput, Ditch, Embankment, Fence, GravityWall, Site, Wall
from rigdda.barriers import KINDS
from rigdda.site import BarrierZone

ALL = tuple(KINDS)
ZONE = BarrierZone(10.0, 40.0)
SLOT = encoding.slot_size(ALL)
vectors = st.integers(1, 4).flatmap(
    lambda n: arrays(float, SLOT * n, elements=st.floats(-1.0, 1.0))
)


def slot(kind, station=0.0, height=0.0, size=0.0):
    return np.array([station, height, size, *(1.0 if k == kind else 0.0 for k in ALL)])


def test_one_kind_needs_no_scores():
    assert [encoding.slot_size(ALL[:n]) for n in (1, 2, 5)] == [3, 5, 8]


@pytest.mark.parametrize(
    ("kind", "least", "middle", "most"),
    [
        ("wall", Wall(10.0, 0.5, 0.5), (2.0, 1.25), (4.0, 2.0)),
        ("gravity_wall", GravityWall(10.0, 0.5, 0.5), (2.0, 1.25), (4.0, 2.0)),
        ("fence", Fence(10.0, 0.5, 1e5), (2.0, 1e5 * 50**0.5), (4.0, 5e6)),
        ("ditch", Ditch(10.0, 0.5, 2.0), (1.0, 4.0), (2.0, 6.0)),
        ("embankment", Embankment(10.0, 0.5, 0.5), (2.0, 1.25), (4.0, 2.0)),
    ],
)
def test_the_range_of_every_kind(kind, least, middle, most):
    tallest = 2.0 if kind == "ditch" else 4.0
    assert encoding.decode(ZONE, slot(kind, -1, 1.0 / tallest - 1.0, -1), ALL) == (least,)
    for share, expected in ((0.0, middle), (1.0, most)):
        (barrier,) = encoding.decode(ZONE, slot(kind, share, share, share), ALL)
        decision = encoding.DECISIONS[kind]
        found = [getattr(barrier, decision.height), getattr(barrier, decision.size)]
        assert found == pytest.approx(expected)
    assert barrier.x + barrier.extent == pytest.approx(40.0)
    assert encoding.decode(ZONE, slot(kind, 0.0, -1.0, 1.0), ALL) == ()


@settings(deadline=None)
@given(vectors)
def test_encoding_is_undone_by_decoding(vector):
    layout = encoding.decode(ZONE, vector, ALL)
    assert encoding.check_layout(ZONE, layout) == layout
    for before, after in pairwise(layout):
        assert after.x - before.x - before.extent >= encoding.MIN_GAP - 1e-8
    code = encoding.encode(ZONE, layout, len(vector) // SLOT, ALL)
    assert code.shape == vector.shape and np.abs(code).max() <= 1.0
    again = encoding.decode(ZONE, code, ALL)
    assert [b.kind for b in again] == [b.kind for b in layout]
    for one, two in zip(again, layout, strict=True):
        numbers = [[getattr(b, f) or 0.0 for f in b.__struct_fields__] for b in (one, two)]
        np.testing.assert_allclose(*numbers, rtol=1e-7, atol=1e-7)


def test_the_largest_score_wins_and_the_first_of_equals():
    vector = np.array([0.0, 0.0, 0.0, 0.1, 0.2, 0.2, -1.0, 0.0])
    assert encoding.decode(ZONE, vector, ALL)[0].kind == "gravity_wall"


@pytest.mark.parametrize(
    ("layout", "kinds", "message"),
    [
        ([Fence(12.0, 2.0, 1e6)], ("wall", "ditch"), r"layout\[0\]\.kind = 'fence'"),
        ([Fence(12.0, 2.0, 9e9)], ALL, r"layout\[0\]\.capacity = 9"),
        (
            [Fence(12.0, 2.0, 1e6, thickness=0.5)],
            ALL,
            r"layout\[0\]\.thickness = 0\.5: leave it at 0\.2",
        ),
        ([GravityWall(12.0, 2.0, 1.0, 2000.0)], ALL, r"layout\[0\]\.density"),
        ([Ditch(12.0, 3.0, 4.0)], ALL, r"layout\[0\]\.depth = 3\.0: .* at most 2$"),
        ([Ditch(12.0, 1.0, 4.0), Wall(17.0, 2.0)], ALL, r"layout\[1\]\.x = 17\.0: put it 2 m"),
    ],
)
def test_layouts_that_no_vector_gives_are_refused(layout, kinds, message):
    with pytest.raises(BadInput, match=message):
        encoding.encode(ZONE, layout, 3, kinds)


@settings(deadline=None, max_examples=60)
@given(vectors)
def test_every_vector_stands_for_a_layout_that_can_be_built(vector):
    problem = DesignProblem("quick", len(vector) // SLOT, ALL)
    layout = problem.decode(vector)
    problem.site.realise(layout)
    assert problem.site.cost(layout) >= 0.0
    again = problem.decode(problem.encode(layout))
    assert [b.kind for b in again] == [b.kind for b in layout]


def test_earthworks_that_do_not_fit_the_slope_are_absent():
    ditches = DesignProblem("quick", 1, ("ditch",))
    assert ditches.decode([0.0, 1.0, -1.0]) == ()  # deep and narrow on the steep part
    assert len(ditches.decode([1.0, 0.0, 0.0])) == 1
    problem = DesignProblem("quick", 1, ("embankment",))
    assert problem.decode([1.0, 0.0, 0.0]) == ()  # the ground falls: it ends beyond the zone
    (dam,) = problem.decode([0.95, -0.6, -1.0])  # at the toe
    moved, _ = dam.build(problem.site.profile, "rock")
    assert moved[:, 0].max() <= problem.site.barrier_zone.end


def test_the_observation_holds_every_kind_in_bounds(ramp: Site) -> None:
    problem = DesignProblem(ramp, 3, ALL)
    layout = problem.decode(
        np.concatenate(
            [slot("fence", -0.8), slot("gravity_wall", 0.6)] * 1 + [slot("ditch", 0.0, -1.0)]
        )
    )
    assert [b.kind for b in layout] == ["fence", "gravity_wall"]
    seen = observe(problem, layout)
    assert space(problem).contains(seen)
    np.testing.assert_array_equal(
        seen["layout"].reshape(3, SLOT)[:, 3:],
        [[-1, -1, 1, -1, -1], [-1, 1, -1, -1, -1], [0, 0, 0, 0, 0]],
    )


def test_the_environment_takes_every_kind(ramp: Site) -> None:
    env = gymnasium.make("rigdda/BarrierDesign-v0", site=ramp, kinds=ALL, releases=1)
    assert env.action_space.shape == (3 * SLOT,)
    check_env(env.unwrapped, skip_render_check=True)
    env.reset(seed=1)
    action = np.concatenate([slot("fence", -0.8), slot("wall", 0.8), slot("ditch", 0.0, -1.0)])
    seen, reward, *_, info = env.step(action.astype(np.float32))
    assert [b.kind for b in info["layout"]] == ["fence", "wall"]
    assert env.observation_space.contains(seen)
    assert isinstance(reward, float)
