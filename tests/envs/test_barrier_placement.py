"""One barrier a step: rewards that add up, what is seen, when it ends."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence

from envs import DesignProblem
from envs.design import BarrierDesign
from envs.envelope import SEEDS, standing
from envs.placement import BarrierPlacement
from rigdda import BadInput, Site, sites

SLOTS = np.array([[0.6, 0.2, 0.0], [-0.8, -0.3, 0.5], [0.55, 0.4, -0.5]], dtype=np.float32)
ABSENT = np.array([0.0, -1.0, 0.0], dtype=np.float32)


@pytest.fixture
def env(ramp: Site) -> BarrierPlacement:
    return BarrierPlacement(ramp, max_barriers=3, releases=2, render_mode="rgb_array")


def play(env: BarrierPlacement, seed: int) -> list[Any]:
    """Return all that an episode of three barriers says."""
    return [env.reset(seed=seed), *(env.step(slot) for slot in SLOTS)]


def test_rewards_add_up_and_the_layout_is_that_of_the_whole_design(
    env: BarrierPlacement, ramp: Site
) -> None:
    start, *steps = play(env, 5)
    design = BarrierDesign(ramp, max_barriers=3, releases=2)
    assert design.reset(seed=5)[1] == start[1]
    _, total, _, _, info = design.step(SLOTS.ravel())
    assert steps[-1][4] == info
    assert len(info["layout"]) == 3
    assert sum(step[1] for step in steps) == pytest.approx(total, abs=1e-12)
    assert [step[2:4] for step in steps] == [(False, False)] * 2 + [(True, False)]
    assert all(type(step[1]) is float for step in steps)
    problem = DesignProblem(ramp)
    for i, (*_, said) in enumerate(steps):
        slots = [*SLOTS[: i + 1], *[ABSENT] * (2 - i)]
        found = problem.evaluate(problem.decode(np.concatenate(slots)), env.seeds)
        assert (said["layout"], said["objective"]) == (found.layout, found.objective)


def test_what_the_last_release_did_is_seen(env: BarrierPlacement, ramp: Site) -> None:
    (first, _), *steps = play(env, 1)
    for name in ("energy", "bounce", "deposit"):
        np.testing.assert_array_equal(first[f"{name}_now"], first[name])
    lefts = [first["slots_left"], *(step[0]["slots_left"] for step in steps)]
    np.testing.assert_allclose(np.ravel(lefts), [1, 2 / 3, 1 / 3, 0], rtol=1e-6)
    for seen, *_, info in steps:
        assert seen in env.observation_space
        (looked,) = standing([(ramp, info["layout"], SEEDS[:2])])
        np.testing.assert_allclose(seen["energy_now"], np.log10(1 + looked.energy) / 10, rtol=1e-6)
        np.testing.assert_allclose(seen["bounce_now"], looked.bounce / 100, rtol=1e-6)
        np.testing.assert_allclose(seen["deposit_now"], looked.deposit, rtol=1e-6)
        np.testing.assert_array_equal(seen["energy"], first["energy"])
        np.testing.assert_allclose(seen["layout"], env.problem.encode(info["layout"]), rtol=1e-6)
    assert set(env.seeds).isdisjoint(SEEDS)


def test_an_absent_barrier_ends_the_episode(env: BarrierPlacement) -> None:
    env.reset(seed=2)
    kept = env.step(SLOTS[0])
    seen, reward, terminated, truncated, info = env.step(ABSENT)
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert info == kept[4]
    np.testing.assert_array_equal(seen["energy_now"], kept[0]["energy_now"])
    with pytest.raises(ResetNeeded):
        env.step(SLOTS[1])


def test_only_a_time_limit_truncates(ramp: Site) -> None:
    for limit, truncated in ((1, True), (3, False)):
        name = "envs:rigdda/BarrierPlacement-v0"
        env = gymnasium.make(name, site=ramp, releases=1, max_episode_steps=limit)
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
        with pytest.raises(BadInput, match=r"shape of action = \(2,\): give 3 numbers"):
            env.step(slot[:2])
        with pytest.raises(BadInput, match=r"action\[0\] = nan"):
            env.step(np.array([np.nan, 0.0, 0.0]))
        again.append(env.step(slot))
    assert data_equivalence(first, again, exact=True)


def test_a_random_site_is_another_in_every_episode() -> None:
    env = BarrierPlacement("random", releases=1, fidelity="fast")
    names = []
    for i in range(4):
        seen, _ = env.reset(seed=0 if i == 0 else None)
        assert seen in env.observation_space
        names.append(env.problem.site.name)
    assert len(set(names)) == 4
    env.reset(seed=0)
    assert env.problem.site.name == names[0]
    known = {f"random-{seed}" for seed in sites.TRAIN_SEEDS}
    assert set(names) <= known


def test_pictures(env: BarrierPlacement) -> None:
    env.reset(seed=3)
    before = env.render()
    env.step(SLOTS[0])
    after = env.render()
    assert before.shape == after.shape == (450, 800, 3)
    assert (before != after).any()
