"""One barrier a step: rewards that add up, what is seen, when it ends."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from cases import cut
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence

from rigdda import BadInput
from rigdda.envs import DesignProblem
from rigdda.envs.environments import BarrierDesign, BarrierPlacement

CUT = cut()
TERMS: dict[str, Any] = {"max_barriers": 3, "kinds": ("fence", "ditch"), "releases": 2}
SLOTS = np.array(
    [[1, 0.0, 0.2, -0.6, 1, 0], [1, -0.9, -0.3, -0.6, 1, 0], [1, 0.6, 0.4, -0.7, 0, 1]],
    dtype=np.float32,
)
ABSENT = np.array([-1, 0, 0, 0, 0, 0], dtype=np.float32)


@pytest.fixture
def env() -> BarrierPlacement:
    return BarrierPlacement(CUT, **TERMS, render_mode="rgb_array")


def play(env: BarrierPlacement, seed: int) -> list[Any]:
    """Return all that an episode of three barriers says."""
    return [env.reset(seed=seed), *(env.step(slot) for slot in SLOTS)]


def test_rewards_add_up_and_the_layout_is_that_of_the_whole_design(env: BarrierPlacement) -> None:
    """To (Z of nothing - Z of the layout) / Z of nothing, as scored; every step on its releases."""
    start, *steps = play(env, 5)
    design = BarrierDesign(CUT, **TERMS)
    assert design.reset(seed=5)[1] == start[1]
    _, total, _, _, info = design.step(SLOTS.ravel())
    assert steps[-1][4] == info
    assert len(info["layout"]) == 3
    assert sum(step[1] for step in steps) == pytest.approx(total, abs=1e-12)
    assert [step[2:4] for step in steps] == [(False, False)] * 2 + [(True, False)]
    assert all(type(step[1]) is float for step in steps)
    problem = DesignProblem(CUT, 3, TERMS["kinds"])
    assert total == pytest.approx(1.0 - info["objective"] / problem.nothing.objective)
    for i, (*_, said) in enumerate(steps):
        slots = [*SLOTS[: i + 1], *[ABSENT] * (2 - i)]
        found = problem.evaluate(problem.decode(np.concatenate(slots)), env.seeds)
        assert (said["layout"], said["objective"]) == (found.layout, found.objective)


def test_what_stands_stays_where_it_is(env: BarrierPlacement) -> None:
    _, *steps = play(env, 5)
    layouts = [set(step[4]["layout"]) for step in steps]
    assert layouts[0] < layouts[1] < layouts[2]


def test_what_barriers_take_and_let_past_is_seen(env: BarrierPlacement) -> None:
    """On releases of every event that are never scored."""
    (first, _), *steps = play(env, 1)
    assert not (first["taken"] + 1.0).any()  # of no barrier: log10(1 + 0) less 3 over 3
    lefts = np.ravel([first["slots_left"], *(step[0]["slots_left"] for step in steps)])
    np.testing.assert_allclose(0.5 + 0.5 * lefts, [1, 2 / 3, 1 / 3, 0], atol=1e-6)
    for seen, *_, info in steps:
        assert seen in env.observation_space
        seeds = {name: range(2**32, 2**32 + 2) for name in CUT.event_names}
        found = env.problem.sample(info["layout"], seeds)
        evaluation = env.problem.judge(info["layout"], found)
        past = evaluation.harm + evaluation.repair
        assert 0.5 + 0.5 * float(seen["harm_now"][0]) == pytest.approx(
            past / env.problem.nothing.objective, rel=1e-5, abs=1e-6
        )
        for i in range(len(info["layout"])):
            most = max(outcome.barriers[i].max_energy for outcome in found)
            assert 3.0 + 3.0 * seen["taken"][i] == pytest.approx(np.log10(1 + most), rel=1e-5)
            broke = np.mean([outcome.barriers[i].failed for outcome in found])
            assert 0.5 * seen["broken"][i] == pytest.approx(broke)
        np.testing.assert_allclose(seen["layout"], env.problem.encode(info["layout"]), atol=1e-6)
    assert max(env.seeds) < 2**31


def test_an_absent_barrier_ends_the_episode(env: BarrierPlacement) -> None:
    env.reset(seed=2)
    kept = env.step(SLOTS[0])
    seen, reward, terminated, truncated, info = env.step(ABSENT)
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert info == kept[4]
    np.testing.assert_array_equal(seen["harm_now"], kept[0]["harm_now"])
    with pytest.raises(ResetNeeded):
        env.step(SLOTS[1])


def test_only_a_time_limit_truncates() -> None:
    for limit, truncated in ((1, True), (3, False)):
        name = "rigdda.envs:rigdda/BarrierPlacement-v0"
        terms = TERMS | {"max_episode_steps": limit}
        env = gymnasium.make(name, site=CUT, **terms)
        env.reset(seed=0)
        assert env.step(SLOTS[0])[2:4] == (False, truncated)
    assert gymnasium.spec("rigdda/BarrierPlacement-v0").max_episode_steps is None


def test_same_seed_same_episodes(env: BarrierPlacement) -> None:
    first = play(env, 8)
    assert data_equivalence(first, play(env, 8), exact=True)
    assert not data_equivalence(first, play(env, 9), exact=True)


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_like_the_original(env: BarrierPlacement, clone: Any) -> None:
    env.reset(seed=4)
    env.step(SLOTS[0])
    other = clone(env)
    one, two = ([e.step(SLOTS[1]), e.step(ABSENT), e.reset()] for e in (env, other))
    assert data_equivalence(one, two, exact=True)


def test_a_refused_action_changes_nothing(env: BarrierPlacement) -> None:
    first = play(env, 3)
    again: list[Any] = [env.reset(seed=3)]
    for slot in SLOTS:
        with pytest.raises(BadInput, match=r"shape of action = \(2,\): give 6 numbers"):
            env.step(slot[:2])
        with pytest.raises(BadInput, match=r"action\[0\] = nan"):
            env.step(np.array([np.nan, *[0.0] * 5]))
        again.append(env.step(slot))
    assert data_equivalence(first, again, exact=True)


def test_pictures(env: BarrierPlacement) -> None:
    env.reset(seed=3)
    before = env.render()
    env.step(SLOTS[0])
    after = env.render()
    assert before.shape == after.shape == (450, 800, 3)
    assert (before != after).any()
