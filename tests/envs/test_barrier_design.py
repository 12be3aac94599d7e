"""The one-step environment: rewards, repeatability, pictures and bad input."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence

from envs import DesignProblem
from envs.design import BarrierDesign
from rigdda import BadInput, Fence, Outcome, Site

ACTION = np.array([0.2, -0.4, -0.3, 0.9, -1.0, 0.0], dtype=np.float32)


@pytest.fixture
def env(ramp: Site) -> BarrierDesign:
    return BarrierDesign(ramp, max_barriers=2, releases=2, risk_weight=2.0, render_mode="rgb_array")


def episodes(env: gymnasium.Env, seed: int, n: int = 2) -> list[Any]:
    """Return all that an environment says in its first episodes after a seed."""
    out: list[Any] = []
    for i in range(n):
        out.append(env.reset(seed=seed if i == 0 else None))
        out.append(env.step(ACTION))
    return out


def same(one: list[Any], other: list[Any]) -> bool:
    return len(one) == len(other) and all(
        data_equivalence(a, b, exact=True) for a, b in zip(one, other, strict=True)
    )


def test_reward_is_the_fall_of_the_objective(env: BarrierDesign, ramp: Site) -> None:
    problem = DesignProblem(ramp, max_barriers=2, risk_weight=2.0)
    rewards = []
    for seed in range(6):
        _, before = env.reset(seed=seed)
        _, reward, terminated, truncated, after = env.step(ACTION)
        nothing = problem.evaluate((), env.seeds)
        design = problem.evaluate(problem.decode(ACTION), env.seeds)
        assert len(design.layout) == 1
        assert reward == nothing.objective - design.objective
        assert type(reward) is float
        assert (terminated, truncated) == (True, False)
        for info, evaluation in ((before, nothing), (after, design)):
            assert info == {
                "objective": evaluation.objective,
                "cost": evaluation.cost,
                "layout": evaluation.layout,
                "outcomes": evaluation.outcomes,
            }
        rewards.append(reward)
    assert len(set(rewards)) > 1  # few blocks: two releases may bring the same debris


def test_info_holds_plain_values(env: BarrierDesign) -> None:
    env.reset(seed=1)
    info = env.step(ACTION)[-1]
    assert type(info["objective"]) is type(info["cost"]) is float
    assert [type(barrier) for barrier in info["layout"]] == [Fence]
    assert [type(outcome) for outcome in info["outcomes"]] == [Outcome] * 2


def test_no_barrier_earns_nothing(env: BarrierDesign) -> None:
    env.reset(seed=1)
    assert env.step(np.full(6, -1.0, np.float32))[1] == 0.0


def test_same_seed_same_episodes(env: BarrierDesign, ramp: Site) -> None:
    first = episodes(env, 11)
    assert same(first, episodes(env, 11))
    other = BarrierDesign(ramp, max_barriers=2, releases=2, risk_weight=2.0)
    assert same(first, episodes(other, 11))
    assert not same(first, episodes(env, 12))
    assert first[0][1]["outcomes"] != first[2][1]["outcomes"]  # releases differ by episode


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_like_the_original(env: BarrierDesign, clone: Any) -> None:
    env.reset(seed=4)
    env.render()
    other = clone(env)
    assert same([env.step(ACTION), env.reset()], [other.step(ACTION), other.reset()])


def test_an_episode_has_one_step(env: BarrierDesign) -> None:
    with pytest.raises(ResetNeeded):
        env.step(ACTION)
    with pytest.raises(ResetNeeded):
        env.render()
    assert env.seeds == ()
    env.reset(seed=0)
    env.step(ACTION)
    with pytest.raises(ResetNeeded):
        env.step(ACTION)


def test_only_a_time_limit_truncates(ramp: Site) -> None:
    for limit, truncated in ((1, True), (2, False)):
        env = gymnasium.make(
            "envs:rigdda/BarrierDesign-v0",
            site=ramp,
            max_barriers=2,
            releases=1,
            max_episode_steps=limit,
        )
        env.reset(seed=0)
        assert env.step(ACTION)[2:4] == (True, truncated)
    assert gymnasium.spec("rigdda/BarrierDesign-v0").max_episode_steps is None


def test_pictures(env: BarrierDesign) -> None:
    env.reset(seed=3)
    before = env.render()
    assert before.shape == (450, 800, 3)
    assert before.dtype == np.uint8
    assert before.std() > 10.0
    np.testing.assert_array_equal(env.render(), before)
    env.step(ACTION)
    assert (env.render() != before).any()
    env.close()


def test_no_picture_without_a_render_mode(ramp: Site) -> None:
    env = BarrierDesign(ramp)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(3), r"shape of action = \(3,\): give 6 numbers, shape \(6,\)"),
        (np.array([0.0, np.nan, 0.0, 0.0, 0.0, 0.0]), r"action\[1\] = nan: give a number"),
    ],
)
def test_bad_actions_are_refused_and_the_episode_goes_on(
    env: BarrierDesign, action: np.ndarray, message: str
) -> None:
    env.reset(seed=0)
    with pytest.raises(BadInput, match=message) as caught:
        env.step(action)
    assert "\n" not in str(caught.value)
    assert env.step(ACTION)[2]


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"releases": 0}, "releases = 0: give a whole number"),
        ({"releases": 10**6}, "releases = 1000000: give a whole number"),
        ({"render_mode": "human"}, "render_mode = 'human': choose one of rgb_array"),
        ({"record": 3}, "record = 3: name a folder"),
        ({"record": __file__}, "record = .*: name a folder that can be made"),
        ({"record_trigger": bool}, "record_trigger = .*: name a folder"),
        ({"record": Path("here"), "record_trigger": 2}, "record_trigger = 2: give a function"),
        ({"site": "nowhere"}, "site = 'nowhere'"),
        ({"max_barriers": -1}, "max_barriers = -1"),
    ],
)
def test_bad_keywords_are_refused(keywords: dict, message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        BarrierDesign(**keywords)
    assert "\n" not in str(caught.value)
