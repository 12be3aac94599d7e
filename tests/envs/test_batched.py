"""Batched environments: copies that step together give what each gives alone."""

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
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import rigdda.envs
from rigdda import BadInput, Site, sites
from rigdda.envs.registration import ENVIRONMENTS

CUT = cut()
COPIES = 3
MODES = [*AutoresetMode]
every = pytest.mark.parametrize("name", ENVIRONMENTS)


def batch(name: str, site: Site | str, **keywords: Any) -> Any:
    return gymnasium.make_vec(
        name, num_envs=COPIES, vectorization_mode="vector_entry_point",
        site=site, releases=1, **keywords,
    )  # fmt: skip


@every
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("limit", [None, 2])
def test_copies_give_what_singles_give(name: str, mode: AutoresetMode, limit: int | None) -> None:
    """Five episodes of every copy, bit for bit, the last observations and infos included."""
    together = batch(name, CUT, max_episode_steps=limit, autoreset_mode=mode.value)

    def single() -> gymnasium.Env:
        terms = {"site": CUT, "releases": 1, "max_episode_steps": limit}
        return gymnasium.make(name, **terms, disable_env_checker=True)

    alone = SyncVectorEnv([single] * COPIES, autoreset_mode=mode)
    assert together.metadata["autoreset_mode"] is mode
    assert together.action_space == alone.action_space
    assert together.observation_space == alone.observation_space
    assert data_equivalence(together.reset(seed=7), alone.reset(seed=7), exact=True)
    together.action_space.seed(1)
    ended, cut_short = np.zeros(COPIES, int), 0
    while ended.min() < 5:
        actions = together.action_space.sample()
        one, other = together.step(actions), alone.step(actions)
        assert data_equivalence(list(one), list(other), exact=True)
        assert one[0] in together.observation_space
        ended += one[2] | one[3]
        cut_short += one[3].sum()
        if mode is AutoresetMode.DISABLED and (one[2] | one[3]).any():
            with pytest.raises(ResetNeeded, match="reset_mask"):
                together.step(actions)
            start = [
                env.reset(options={"reset_mask": one[2] | one[3]}) for env in (together, alone)
            ]
            assert data_equivalence(*start, exact=True)
    assert (cut_short > 0) == (limit is not None and "Placement" in name)


@every
@pytest.mark.parametrize("site", ["random", ["quick", "bench", "random-3"]])
def test_copies_draw_the_sites_that_singles_draw(name: str, site: str | list[str]) -> None:
    together, alone = batch(name, site), gymnasium.make(name, site=site, releases=1)
    for i, copy_ in enumerate(together.unwrapped.copies):
        copy_.draw(3 + i)
        alone.unwrapped.draw(3 + i)
        assert copy_.problem == alone.unwrapped.problem
        assert copy_.problem.site.name in (sites.split("train") if site == "random" else site)


def test_a_reset_may_name_the_site_of_all_copies() -> None:
    env = batch("rigdda/BarrierDesign-v0", CUT)
    _, info = env.reset(seed=0, options={"site": "quick"})
    assert info["site"].tolist() == ["quick"] * COPIES
    with pytest.raises(BadInput, match="the only option is site"):
        env.reset(options={"weather": 1})
    for mask in (np.zeros(COPIES, bool), np.ones(2, bool), [1, 0, 0]):
        with pytest.raises(BadInput, match=r"reset_mask = .*: give 3 booleans"):
            env.reset(options={"reset_mask": mask})
    with pytest.raises(BadInput, match=r"autoreset_mode = 'later': choose one of"):
        batch("rigdda/BarrierDesign-v0", CUT, autoreset_mode="later")


@every
@pytest.mark.parametrize("clone", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_like_the_original(name: str, clone: Any) -> None:
    env = batch(name, CUT)
    env.reset(seed=2)
    env.action_space.seed(0)
    actions = env.action_space.sample()
    env.step(actions)
    other = clone(env)
    assert data_equivalence(list(env.step(actions)), list(other.step(actions)), exact=True)


def test_bad_input_is_refused_and_changes_nothing() -> None:
    env = batch("rigdda/BarrierPlacement-v0", CUT, kinds=("fence",))
    actions = np.zeros((COPIES, 4), np.float32)
    with pytest.raises(ResetNeeded):
        env.step(actions)
    for seed in ([1, 2], 1.5, (x for x in "abc"), np.array(1.5), "ab"):
        with pytest.raises(BadInput, match=r"seed = .*: give one number, or 3"):
            env.reset(seed=seed)
    for seed in (-1, True, [4, 5, -1], "abc", [4, 5, 0.5]):
        with pytest.raises(BadInput, match=r"seed(\[\d\])? = .*: give a whole number"):
            env.reset(seed=seed)
    env.reset(seed=np.array([4, 5, 6]))
    for nothing in (None, 5, np.float32(0.0), (row for row in actions)):
        with pytest.raises(BadInput, match=r"actions = .*: give 3 rows"):
            env.step(nothing)
    for unsound in ("abc", {0: 0, 1: 1, 2: 2}, [[0.0] * 4, [0.0], None]):
        with pytest.raises(BadInput, match=r"actions\[\d\]"):
            env.step(unsound)
    with pytest.raises(BadInput, match=r"shape of actions\[0\] = \(2,\)"):
        env.step(actions[:, :2])
    with pytest.raises(BadInput, match="actions = '2 rows': give 3"):
        env.step(actions[:2])
    other = batch("rigdda/BarrierPlacement-v0", CUT, kinds=("fence",))
    other.reset(seed=4)
    assert data_equivalence(list(env.step(actions)), list(other.step(actions)), exact=True)
    for keywords in (
        {"num_envs": 0}, {"num_envs": 10**9}, {"max_episode_steps": 0},
    ):  # fmt: skip
        with pytest.raises(BadInput, match=r"= (0|10{9}): give a whole number of at least 1"):
            gymnasium.make_vec("rigdda/BarrierDesign-v0", site=CUT, **keywords)


def test_every_copy_has_a_picture() -> None:
    env = batch("rigdda/BarrierDesign-v0", CUT, render_mode="rgb_array")
    env.reset(seed=0)
    pictures = env.render()
    assert [picture.shape for picture in pictures] == [(450, 800, 3)] * COPIES


def test_every_copy_has_a_folder_for_its_replays(tmp_path: Any) -> None:
    env = batch("rigdda/BarrierDesign-v0", CUT, record=tmp_path)
    env.reset(seed=0)
    env.step(np.zeros(env.action_space.shape, np.float32))
    found = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.rrd"))
    assert found == [f"copy-{i}/episode-000000.rrd" for i in range(COPIES)]


@pytest.mark.parametrize("record", [5, "file", "file/deeper"])
def test_a_folder_for_replays_that_cannot_be_made_is_refused(
    record: Any, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(BadInput, match=r"record = .*: name a folder"):
        batch("rigdda/BarrierDesign-v0", CUT, record=record)


def test_the_bridge_says_what_the_batch_says() -> None:
    """Observations, rewards, ends, what was seen last and why an episode ended."""
    pytest.importorskip("stable_baselines3")
    name, terms = "rigdda/BarrierPlacement-v0", {"site": CUT, "releases": 1}
    bridge = rigdda.envs.sb3_vec_env(name, COPIES, **terms, max_episode_steps=2)
    plain = batch(name, CUT, max_episode_steps=2)
    bridge.seed(3)
    seen, info = plain.reset(seed=3)
    assert data_equivalence(bridge.reset(), seen, exact=True)
    assert [one["objective"] for one in bridge.venv.reset_infos] == info["objective"].tolist()
    plain.action_space.seed(0)
    truncations = 0
    for _ in range(6):
        actions = plain.action_space.sample()
        seen, rewards, done, infos = bridge.step(actions)
        other, exact, terminated, truncated, info = plain.step(actions)
        assert data_equivalence(seen, other, exact=True)
        np.testing.assert_array_equal(rewards, exact.astype(np.float32))
        np.testing.assert_array_equal(done, terminated | truncated)
        for i in np.flatnonzero(done):
            final = info["final_obs"][i]
            assert data_equivalence(infos[i]["terminal_observation"], final, exact=True)
            assert infos[i]["TimeLimit.truncated"] == (truncated[i] and not terminated[i])
            assert infos[i]["objective"] == info["final_info"]["objective"][i]
            assert "episode" in infos[i]
            truncations += truncated[i]
    assert truncations > 0


def test_environments_of_others_are_refused_for_stable_baselines3() -> None:
    pytest.importorskip("stable_baselines3")
    with pytest.raises(BadInput, match="id = 'CartPole-v1': name an environment of this package"):
        rigdda.envs.sb3_vec_env("CartPole-v1", 2)


@every
def test_ppo_learns_on_copies(name: str) -> None:
    ppo = pytest.importorskip("stable_baselines3").PPO
    env = rigdda.envs.sb3_vec_env(name, COPIES, site=CUT, releases=1)
    model = ppo("MultiInputPolicy", env, n_steps=6, batch_size=9, n_epochs=2, gamma=1.0, seed=0)
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(36)
    assert model.num_timesteps == 36
    after = model.policy.parameters()
    assert any((a != b).any() for a, b in zip(after, before, strict=True))
    assert env.get_attr("releases", [0]) == [1]
    env.close()
