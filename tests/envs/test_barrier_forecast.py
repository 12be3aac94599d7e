"""The environment of forecasts: conventions of Gymnasium, copies, masks and what it returns."""

from __future__ import annotations

import pickle
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import rigdda.envs
from rigdda import BadInput
from rigdda.envs import forecast_environment, forecast_table
from rigdda.envs.forecast_table import NAMES, WIDTH, ForecastTable, joined
from rigdda.envs.observation import FIELDS

NAME = "rigdda/BarrierForecast-v0"
SITES = ("random-0", "random-1", "random-2", "random-1000000", "random-1000000000")


@pytest.fixture(scope="module")
def table() -> ForecastTable:
    """Return a table of five sites and four layouts, of which some cannot be built."""
    rng = np.random.default_rng(0)
    z = rng.uniform(0.2, 1.4, (5, 4))
    z[:, 0] = 1.0
    z[1, 2] = z[2, 3] = np.nan
    seen = rng.uniform(-2, 2, (5, WIDTH)).astype(np.float32)
    features = rng.normal(size=(5, 4, 6)).clip(-10, 10).astype(np.float16).astype(np.float32)
    layouts = ("[]", '[{"kind": "a"}]', '[{"kind": "b"}]', '[{"kind": "c"}]')
    return ForecastTable(SITES, layouts, seen, features, z.astype(np.float32), {"seed": "0"})


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("layout_features", [False, True])
def test_gymnasium_finds_no_fault(table: ForecastTable, flat: bool, layout_features: bool) -> None:
    terms = {"flat": flat, "layout_features": layout_features}
    env = gymnasium.make(NAME, table=table, **terms)
    check_env(env.unwrapped)
    seen, _ = env.reset(seed=0)
    assert seen in env.observation_space


@pytest.mark.parametrize("flat", [False, True])
def test_stable_baselines3_finds_no_fault(table: ForecastTable, flat: bool) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(gymnasium.make(NAME, table=table, flat=flat).unwrapped)


def test_the_reward_is_the_forecast_reduction_of_z(table: ForecastTable) -> None:
    env = gymnasium.make(NAME, table=table)
    for row, name in enumerate(SITES):
        for action in range(4):
            _, info = env.reset(options={"site": name})
            assert info["site"] == name
            _, reward, terminated, truncated, info = env.step(action)
            built = np.isfinite(table.z[row, action])
            assert reward == (pytest.approx(1.0 - table.z[row, action]) if built else 0.0)
            assert terminated and not truncated
            assert info["layout"] == (table.layouts[action] if built else "[]")
            assert bool(info["action_mask"][action]) == built


def test_the_observation_is_that_of_the_design_environment(table: ForecastTable) -> None:
    env = gymnasium.make(NAME, table=table, site="random-1")
    seen, _ = env.reset(seed=3)
    assert {name: array.shape for name, array in seen.items()} == {
        name: (field.size,) for name, field in FIELDS.items()
    }
    assert (joined(seen) == table.observation[1]).all() and tuple(sorted(seen)) == NAMES
    design = gymnasium.make("rigdda/BarrierDesign-v0", site="quick")
    assert env.observation_space == design.observation_space
    flat, _ = gymnasium.make(NAME, table=table, site="random-1", flat=True).reset()
    assert (flat == table.observation[1]).all()


def test_layouts_are_described_in_the_observation(table: ForecastTable) -> None:
    env = gymnasium.make(NAME, table=table, site="random-2", layout_features=True)
    seen, _ = env.reset()
    assert (seen["layouts"].reshape(4, -1) == table.features[2]).all()


def test_a_split_gives_only_its_sites(table: ForecastTable) -> None:
    wanted = {"train": SITES[:3], "random": SITES[:3], "validation": SITES[3:4], "test": SITES[4:]}
    for split, names in wanted.items():
        env = gymnasium.make(NAME, table=table, site=split)
        drawn = {env.reset(seed=i)[1]["site"] for i in range(40)}
        assert drawn == {*names}


def test_a_wide_split_has_the_sites_of_the_version_with_wide_ranges() -> None:
    shipped = forecast_table.load()
    for part in ("train", "validation", "test"):
        assert (shipped.rows(f"wide-{part}") == shipped.rows(part)).all()
    both = replace(shipped, names=("random-0", *shipped.names[1:]))
    assert both.rows("train")[0] == 0
    assert (both.rows("wide-train") == both.rows("train")[1:]).all()


def test_the_page_has_the_rewards_of_the_shipped_table() -> None:
    page = Path(__file__).parents[2] / "docs/environments/BarrierForecast-v0.md"
    table = forecast_table.load()
    parts = [table.rows(part) for part in ("train", "validation", "test")]
    best = table.reward[parts[0]].mean(axis=0).argmax()
    uniform = [np.mean([table.reward[i][table.mask[i]].mean() for i in rows]) for rows in parts]
    figures = {
        "a random layout that can be built": uniform,
        "on the training sites": [table.reward[rows, best].mean() for rows in parts],
        "the upper bound": [table.reward[rows].max(axis=1).mean() for rows in parts],
    }
    text = page.read_text(encoding="utf-8")
    for words, values in figures.items():
        assert words + "".join(f" | {value:.2f}" for value in values) + " |" in text
    for rows, part in zip(parts, ("training", "validation", "test"), strict=True):
        assert f"{len(rows)} {part} sites" in text


def test_a_table_of_narrow_sites_has_no_wide_split(table: ForecastTable) -> None:
    with pytest.raises(BadInput, match="no site of this split"):
        gymnasium.make(NAME, table=table, site="wide-train")


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_a_copy_is_what_it_is_alone(
    table: ForecastTable, flat: bool, mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forecast_environment, "AHEAD", 3)
    terms = {"table": table, "flat": flat}
    batch = gymnasium.make_vec(
        NAME, 3, vectorization_mode="vector_entry_point", autoreset_mode=mode, **terms
    )
    alone = [gymnasium.make(NAME, **terms) for _ in range(3)]
    seen, infos = batch.reset(seed=5)
    started = [env.reset(seed=5 + i) for i, env in enumerate(alone)]
    rng = np.random.default_rng(0)

    def same(batched: object, one: object, i: int) -> None:
        if isinstance(one, dict):
            assert all((batched[name][i] == one[name]).all() for name in one)
        else:
            assert (batched[i] == one).all()

    for turn in range(20):  # beyond the sites that are drawn ahead
        for i, (own, info) in enumerate(started):
            same(seen, own, i)
            assert infos["site"][i] == info["site"]
            assert (infos["action_mask"][i] == info["action_mask"]).all()
        actions = rng.integers(4, size=3)
        seen, rewards, terminated, truncated, infos = batch.step(actions)
        assert not truncated.any()
        if mode == "NextStep" and turn % 2:
            assert not terminated.any() and not rewards.any() and "layout" not in infos
            started = [env.reset() for env in alone]
            continue
        assert terminated.all()
        ended = [env.step(action) for env, action in zip(alone, actions, strict=True)]
        assert rewards.tolist() == [reward for _, reward, *_ in ended]
        if mode == "NextStep":
            assert infos["layout"].tolist() == [info["layout"] for *_, info in ended]
            started = [(own, info) for own, *_, info in ended]
            continue
        for i, (own, *_, info) in enumerate(ended):
            last = infos["final_obs"][i]
            assert all((last[n] == own[n]).all() for n in own) if not flat else (last == own).all()
            assert infos["final_info"]["layout"][i] == info["layout"]
        started = [env.reset() for env in alone]


def test_disabled_autoreset_restarts_the_masked_copies(table: ForecastTable) -> None:
    batch = gymnasium.make_vec(
        NAME, 2, vectorization_mode="vector_entry_point", table=table,
        autoreset_mode=AutoresetMode.DISABLED,
    )  # fmt: skip
    batch.reset(seed=0)
    batch.step(np.array([0, 1]))
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"\[0, 1\]"):
        batch.step(np.array([0, 1]))
    before = batch.reset(options={"reset_mask": np.array([True, False])})[1]["site"]
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"\[1\]"):
        batch.step(np.array([0, 1]))
    after = batch.reset(options={"reset_mask": np.array([False, True])})[1]["site"]
    assert before[0] == after[0]
    batch.step(np.array([0, 1]))


def test_masks_are_the_layouts_that_can_be_built(table: ForecastTable) -> None:
    env = gymnasium.make(NAME, table=table)
    env.reset(options={"site": "random-1"})
    assert env.unwrapped.action_masks().tolist() == [True, True, False, True]
    batch = gymnasium.make_vec(
        NAME, 2, vectorization_mode="vector_entry_point", table=table, site="random-2"
    )
    batch.reset(seed=0)
    assert batch.unwrapped.action_masks().tolist() == 2 * [[True, True, True, False]]


def test_the_same_seed_gives_the_same_episodes(table: ForecastTable) -> None:
    def play() -> list[tuple[str, float]]:
        env = gymnasium.make(NAME, table=table)
        _, info = env.reset(seed=11)
        env.action_space.seed(11)
        out = []
        for _ in range(50):
            out.append((info["site"], env.step(env.action_space.sample())[1]))
            _, info = env.reset()
        return out

    assert play() == play()


def test_it_can_be_pickled_in_an_episode(table: ForecastTable) -> None:
    env = gymnasium.make(NAME, table=table)
    env.reset(seed=1)
    other = pickle.loads(pickle.dumps(env))
    assert env.step(1)[1] == other.step(1)[1]
    assert env.reset()[1]["site"] == other.reset()[1]["site"]


@pytest.mark.parametrize(
    "terms, words",
    [
        ({"site": "random-7"}, "site = 'random-7': the table of forecasts has other sites"),
        ({"site": ()}, "site = "),
        ({"flat": 1}, "flat"),
        ({"table": "none.safetensors"}, "none.safetensors"),
    ],
)
def test_a_bad_keyword_is_named(table: ForecastTable, terms: dict, words: str) -> None:
    from rigdda.envs.forecast_environment import BarrierForecast, BarrierForecastVector

    for kind in (BarrierForecast, BarrierForecastVector):
        with pytest.raises(BadInput, match=words):
            kind(**{"table": table} | terms)


def test_there_are_no_pictures(table: ForecastTable) -> None:
    env = gymnasium.make(NAME, table=table, render_mode=None)
    batch = gymnasium.make_vec(NAME, 2, vectorization_mode="vector_entry_point", table=table)
    for made in (env, batch):
        made.reset(seed=0)
        with pytest.warns(UserWarning, match="no pictures"):
            assert made.render() is None
    with (
        pytest.warns(UserWarning, match="not in the possible render_modes"),
        pytest.raises(TypeError, match="no pictures"),
    ):
        gymnasium.make(NAME, table=table, render_mode="rgb_array")


@pytest.mark.filterwarnings("ignore:.*render_mode='rgb_array'")
def test_stable_baselines3_makes_it_by_its_name() -> None:
    dqn = pytest.importorskip("stable_baselines3").DQN
    from stable_baselines3.common.env_util import make_vec_env

    copies = make_vec_env(NAME, 2)
    assert copies.reset()["nothing"].shape == (2, 1)
    model = dqn("MultiInputPolicy", NAME, learning_starts=8, buffer_size=64, batch_size=8)
    model.learn(24)
    assert model.num_timesteps == 24


@pytest.mark.parametrize("mode", ["SameStep", "NextStep", "Disabled"])
def test_a_limit_truncates_a_batch_as_a_single_environment(table: ForecastTable, mode: str) -> None:
    terms = {"vectorization_mode": "vector_entry_point", "autoreset_mode": mode, "table": table}
    for limit in (1, 2):
        alone = gymnasium.make(NAME, table=table, max_episode_steps=limit)
        alone.reset(seed=0)
        ends = alone.step(1)[2:4]
        batch = gymnasium.make_vec(NAME, 2, max_episode_steps=limit, **terms)
        batch.reset(seed=0)
        _, _, terminated, truncated, _ = batch.step(np.array([1, 1]))
        assert [*zip(terminated.tolist(), truncated.tolist(), strict=True)] == [ends, ends]
        assert ends == (True, limit == 1)
        if mode == "NextStep":
            *_, terminated, truncated, _ = batch.step(np.array([1, 1]))
            assert not terminated.any() and not truncated.any()


def test_a_copy_that_begins_anew_ignores_its_action(table: ForecastTable) -> None:
    batch = gymnasium.make_vec(
        NAME, 2, vectorization_mode="vector_entry_point", autoreset_mode="NextStep", table=table
    )
    batch.reset(seed=0)
    batch.step(np.array([1, 2]))
    _, rewards, terminated, *_ = batch.step(np.array([99, -1]))
    assert not rewards.any() and not terminated.any()
    with pytest.raises(BadInput, match="from 0 to 3"):
        batch.step(np.array([99, 0]))
    batch.step(np.array([0, 0]))  # the refused step has changed nothing
    batch.step(np.array([0, 0]))


def test_the_layout_is_told_after_a_step_without_autoreset(table: ForecastTable) -> None:
    batch = gymnasium.make_vec(
        NAME, 2, vectorization_mode="vector_entry_point", table=table, site="random-1",
        autoreset_mode="Disabled",
    )  # fmt: skip
    _, infos = batch.reset(seed=0)
    assert "layout" not in infos
    *_, infos = batch.step(np.array([1, 2]))  # 2 cannot be built
    assert infos["layout"].tolist() == [table.layouts[1], "[]"] and infos["_layout"].all()


def test_the_bridge_says_what_single_environments_say(table: ForecastTable) -> None:
    pytest.importorskip("stable_baselines3")
    copies = rigdda.envs.sb3_vec_env(NAME, 3, table=table)
    assert copies.get_attr("action_space") == 3 * [gymnasium.spaces.Discrete(4)]
    assert copies.get_attr("observation_space", [1]) == [copies.observation_space]
    copies.seed(5)
    places = ["random-1", "test", None]
    copies.set_options([{"site": place} if place else {} for place in places])
    seen = copies.reset()
    alone = [gymnasium.make(NAME, table=table) for _ in places]
    told = [
        env.reset(seed=5 + i, options={"site": place} if place else None)
        for i, (env, place) in enumerate(zip(alone, places, strict=True))
    ]

    def same(info: dict, wanted: dict) -> None:
        assert {*info} - {"terminal_observation", "TimeLimit.truncated", "episode"} == {*wanted}
        assert info["site"] == wanted["site"] and info.get("layout") == wanted.get("layout")
        assert (info["action_mask"] == wanted["action_mask"]).all()

    actions = np.array([2, 1, 3])  # the first cannot be built
    for i, (own, wanted) in enumerate(told):
        same(copies.unwrapped.reset_infos[i], wanted)
        assert all((seen[name][i] == own[name]).all() for name in own)
    _, rewards, dones, infos = copies.step(actions)
    for i, env in enumerate(alone):
        last, reward, *_, wanted = env.step(actions[i])
        assert dones[i] and rewards[i] == np.float32(reward)
        same(infos[i], wanted)
        assert all((infos[i]["terminal_observation"][name] == last[name]).all() for name in last)
        same(copies.unwrapped.reset_infos[i], env.reset()[1])
    copies.set_options({"site": "random-2"})
    copies.reset()
    assert [info["site"] for info in copies.unwrapped.reset_infos] == 3 * ["random-2"]
    copies.set_options({"place": "random-2"})
    with pytest.raises(BadInput, match="options"):
        copies.reset()


def test_a_bad_action_or_option_is_named(table: ForecastTable) -> None:
    env = gymnasium.make(NAME, table=table).unwrapped
    env.reset(seed=0)
    for action in (4, -1, 0.5, "a", True, np.True_, [0], None):
        with pytest.raises(BadInput, match="from 0 to 3"):
            env.step(action)
    env.step(np.int64(1))
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(1)
    with pytest.raises(BadInput, match="options"):
        env.reset(options={"place": 1})
    batch = gymnasium.make_vec(NAME, 2, vectorization_mode="vector_entry_point", table=table)
    batch.reset(seed=0)
    for actions in ([0, 4], [0], [0.5, 1.0]):
        with pytest.raises(BadInput, match="2 whole numbers from 0 to 3"):
            batch.step(np.array(actions))
    for loose in ([True, False], [[0, 1], [2]], None):
        with pytest.raises(BadInput, match="2 whole numbers from 0 to 3"):
            batch.step(loose)


@pytest.mark.parametrize("given", [3, True, 3.5, b"forecasts.safetensors", [1], {}])
def test_what_is_no_path_of_a_table_is_named(given: object) -> None:
    with pytest.raises(BadInput, match=r"table = .*give a ForecastTable or the path"):
        gymnasium.make(NAME, table=given)


def test_a_table_survives_its_file(table: ForecastTable, tmp_path) -> None:
    table.save(tmp_path / "a.safetensors")
    read = ForecastTable.load(tmp_path / "a.safetensors")
    read.save(tmp_path / "b.safetensors")
    files = [(tmp_path / f"{name}.safetensors").read_bytes() for name in "ab"]
    assert files[0] == files[1] and read.notes == table.notes
    assert read.names == table.names and read.layouts == table.layouts
    np.testing.assert_array_equal(read.z, table.z)
    np.testing.assert_array_equal(read.features, table.features)
    (tmp_path / "c.safetensors").write_bytes(files[0][:200])
    with pytest.raises(BadInput, match=r"c\.safetensors"):
        ForecastTable.load(tmp_path / "c.safetensors")


def test_stable_baselines3_learns_the_best_layout(table: ForecastTable) -> None:
    ppo = pytest.importorskip("stable_baselines3").PPO
    copies = rigdda.envs.sb3_vec_env(NAME, 16, table=table, site="train", flat=True)
    copies.reset()
    assert np.stack(copies.env_method("action_masks")).shape == (16, 4)
    model = ppo("MlpPolicy", copies, n_steps=16, batch_size=64, learning_rate=3e-3, seed=0)
    model.learn(6000)
    best = table.reward[:3].max(axis=1)
    for row in range(3):
        action, _ = model.predict(table.observation[row], deterministic=True)
        assert table.reward[row, action] == pytest.approx(best[row])


def test_it_needs_no_torch() -> None:
    code = (
        "import sys, gymnasium, rigdda.envs\n"
        f"env = gymnasium.make({NAME!r})\n"
        "env.reset(seed=0)\n"
        "env.step(0)\n"
        "heavy = {'torch', 'stable_baselines3', 'matplotlib', 'rerun'}\n"
        "sys.exit(not heavy.isdisjoint(sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_the_table_that_ships_is_of_this_version() -> None:
    from rigdda import MECHANICS
    from rigdda.envs.forecast_table import load

    shipped = load()
    assert shipped.notes["mechanics"] == MECHANICS
    for split in ("train", "validation", "test"):
        assert len(shipped.rows(split)) >= 2
    assert (shipped.z[:, 0] == 1.0).all() and np.nanmax(shipped.reward) < 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(NAME).unwrapped)


@pytest.mark.slow
def test_maskable_ppo_learns_and_builds_only_what_can_be_built(table: ForecastTable) -> None:
    """MaskablePPO of sb3-contrib runs on the environment as it is."""
    contrib = pytest.importorskip("sb3_contrib")
    env = gymnasium.make(NAME, table=table, site=SITES[:3], flat=True)
    env.reset(seed=0)
    agent = contrib.MaskablePPO(
        "MlpPolicy", env, n_steps=128, batch_size=64, learning_rate=3e-3, gamma=1.0, seed=0,
        device="cpu", ent_coef=0.0,
    )  # fmt: skip
    agent.learn(2_048)
    rewards = []
    for name in SITES[:3]:
        seen, info = env.reset(options={"site": name})
        masks = env.unwrapped.action_masks()
        assert (masks == info["action_mask"]).all()
        action, _ = agent.predict(seen, action_masks=masks, deterministic=True)
        assert masks[action]
        rewards.append(env.step(action)[1])
    usual = table.reward[:3].sum() / table.mask[:3].sum()  # of random layouts
    assert np.mean(rewards) > 0.5 * (usual + table.reward[:3].max(axis=1).mean())
