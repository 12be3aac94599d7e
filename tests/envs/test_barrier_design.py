"""The one-step environment: rewards, sites, repeatability, pictures and bad input."""

from __future__ import annotations

import copy
import json
import pickle
from pathlib import Path
from typing import Any

import gymnasium
import msgspec
import numpy as np
import pytest
from cases import FREE, HARMLESS, cut
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence

import rigdda
from rigdda import BadInput, Fence, Prices, sites
from rigdda.envs import DesignProblem, Targets
from rigdda.envs.environments import BarrierDesign, BarrierEnv, BarrierPlacement

CUT = cut()
TERMS: dict[str, Any] = {"max_barriers": 2, "kinds": ("fence",), "releases": 10}
ACTION = np.array([1.0, 0.3, -0.2, -0.6, -1.0, 0.0, 0.0, 0.0], dtype=np.float32)


@pytest.fixture
def env() -> BarrierDesign:
    return BarrierDesign(CUT, **TERMS, render_mode="rgb_array")


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


@pytest.mark.parametrize("releases", [1, 10])
def test_reward_is_the_fall_of_the_cost_over_the_cost_of_nothing(releases: int) -> None:
    """As scored on the episode's releases, against the site's mean: one simulation a release."""
    env = BarrierDesign(CUT, **TERMS | {"releases": releases})
    problem = DesignProblem(CUT, 2, ("fence",))
    nothing = problem.nothing
    rewards = []
    for seed in range(4):
        _, before = env.reset(seed=seed)
        _, reward, terminated, truncated, after = env.step(ACTION)
        built = problem.evaluate(problem.decode(ACTION), env.seeds)
        assert len(built.layout) == 1 and built.releases == releases
        assert reward == pytest.approx(1.0 - built.objective / nothing.objective, abs=1e-12)
        assert type(reward) is float
        assert (terminated, truncated) == (True, False)
        for info, found in ((before, nothing), (after, built)):
            assert info["layout"] == found.layout
            for name in ("objective", "cost", "capital", "harm", "repair", "debris"):
                assert info[name] == getattr(found, name)
        rewards.append(reward)
    assert len(set(rewards)) > 1


def test_a_reward_costs_one_simulation_a_release(
    env: BarrierDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    env.reset(seed=0)  # the site is known now
    seen: list[int] = []
    once = rigdda.release_many
    monkeypatch.setattr(rigdda, "release_many", lambda jobs: seen.append(len(jobs)) or once(jobs))
    env.reset(seed=17)
    env.step(ACTION)
    assert sum(seen) <= env.releases


def test_without_prices_the_reward_is_the_debris_kept_off() -> None:
    env = BarrierDesign(cut(FREE, HARMLESS), **TERMS)
    env.reset(seed=0)
    _, reward, *_, info = env.step(ACTION)
    assert reward == pytest.approx(1.0 - info["debris_share"])


@pytest.mark.parametrize("prices", [FREE, None])
def test_the_reward_is_the_share_of_debris_only_if_z_is_zero(prices: Prices | None) -> None:
    harmless = BarrierDesign(cut(prices, HARMLESS), **TERMS)
    harmless.reset(seed=0)
    _, reward, *_, info = harmless.step(ACTION)
    assert reward == (pytest.approx(1.0 - info["debris_share"]) if prices else -1.0)
    harmful = BarrierDesign(cut(prices), **TERMS)
    harmful.reset(seed=0)
    _, reward, *_, info = harmful.step(ACTION)
    nothing = harmful.problem.nothing.objective
    assert reward == pytest.approx((nothing - info["objective"]) / nothing)


@pytest.mark.parametrize("env_class", [BarrierDesign, BarrierPlacement])
def test_scores_are_in_the_order_of_the_kinds_of_the_slots(env_class: type[BarrierEnv]) -> None:
    """It is the same on a site that lacks some of the kinds."""
    bare = msgspec.structs.replace(CUT, meshes=())
    env = env_class([bare, CUT], max_barriers=1, kinds=("mesh", "fence", "ditch"), releases=1)
    assert env.slots.kinds == ("mesh", "fence", "ditch")
    for site, offered in ((bare, ("fence", "ditch")), (CUT, ("mesh", "fence", "ditch"))):
        for i, kind in enumerate(env.slots.kinds):
            env.reset(seed=0, options={"site": site})
            assert env.problem.kinds == offered
            scores = np.eye(3)[i]
            *_, info = env.step(np.array([1.0, 0.9, -0.5, -0.6, *scores], np.float32))
            built = {barrier.kind for barrier in info["layout"]}
            assert built == ({kind} if kind in offered else {"fence"})


def test_removal_is_a_default_kind_of_a_single_site_only() -> None:
    assert "removal" in BarrierDesign("old-fence").slots.kinds
    for site in (["old-fence"], "wide-train"):
        assert {"removal", "wall"}.isdisjoint(BarrierDesign(site).slots.kinds)
        assert "mesh" in BarrierDesign(site).slots.kinds


@pytest.mark.slow
@pytest.mark.parametrize("env_class", [BarrierDesign, BarrierPlacement])
def test_the_expected_reward_ranks_as_a_problem_with_targets(env_class: type[BarrierEnv]) -> None:
    """A low fence misses the target clearly, in every episode: it ranks behind a tall one."""
    terms: dict[str, Any] = {"max_barriers": 1, "kinds": ("fence", "ditch")}
    actions = np.array(
        [[1, 1.0, -0.2, 0.2, 1, 0], [1, -0.9, -1.0, -1.0, 1, 0], [-1, 0, 0, 0, 0, 0]], np.float32
    )
    env = env_class(CUT, **terms, releases=640, targets={"reach": 0.1})
    problem = DesignProblem(CUT, **terms, targets=Targets(reach=0.1))
    found = [problem.evaluate(problem.decode(action), range(2000)) for action in actions]
    rewards = np.zeros((len(actions), 12))
    for i, action in enumerate(actions):
        for seed in range(rewards.shape[1]):
            env.reset(seed=seed)
            _, rewards[i, seed], *_, info = env.step(action)
            assert info["targets"] in ("met", "missed", "undecided")
    expected = rewards.mean(axis=1)
    wanted = np.array([problem.reward(one) - problem.reward(problem.nothing) for one in found])
    assert [one.targets for one in found] == ["met", "missed", "missed"]
    np.testing.assert_allclose(expected[:2], wanted[:2], atol=0.1)
    assert expected[2] == 0.0  # exactly, whatever the releases


def test_targets_survive_as_json() -> None:
    for targets in ({"reach": 0.01}, Targets(reach=0.01, failure=0.05)):
        env = gymnasium.make("rigdda/BarrierDesign-v0", site="quick", targets=targets)
        again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
        assert again.unwrapped.problem.targets == env.unwrapped.problem.targets != Targets()


def test_info_holds_plain_values(env: BarrierDesign) -> None:
    _, start = env.reset(seed=1)
    assert start["outcomes"] == ()
    info = env.step(ACTION)[-1]
    assert start.keys() == info.keys() and info["site"] == "cut"
    assert [type(barrier) for barrier in info["layout"]] == [Fence]
    assert len(info["outcomes"]) == 10
    plain = {name: value for name, value in info.items() if name != "layout"}
    assert json.loads(json.dumps(plain))["outcomes"] == list(info["outcomes"])
    harmed = [one["road_volume"] > 0.0 for one in info["outcomes"]]
    assert harmed == [one["reached"] for one in info["outcomes"]]


def test_no_barrier_earns_nothing(env: BarrierDesign) -> None:
    env.reset(seed=1)
    assert env.step(np.full(8, -1.0, np.float32))[1] == 0.0


def test_random_actions_build_from_nothing_to_all() -> None:
    env = BarrierDesign(CUT, max_barriers=3, releases=1)
    env.action_space.seed(0)
    built = [
        env.slots.decode(env.problem, env.action_space.sample().astype(float)) for _ in range(300)
    ]
    assert {len(layout) for layout in built} == {0, 1, 2, 3}
    assert {barrier.kind for layout in built for barrier in layout} == set(env.problem.kinds)


def test_a_reset_may_name_the_site(env: BarrierDesign) -> None:
    for site, name in (("narrow", "narrow"), (sites.load("bench"), "bench"), (None, "cut")):
        options = None if site is None else {"site": site}
        seen, info = env.reset(seed=0, options=options)
        assert info["site"] == name and seen in env.observation_space
        assert env.problem.kinds == ("fence",)
    env.reset(seed=1, options={"site": "test"})
    assert env.problem.site.name in sites.split("test")
    with pytest.raises(BadInput, match=r"options = .*weather.*: the only option is site"):
        env.reset(options={"weather": 1})
    with pytest.raises(BadInput, match="site = 'nowhere'"):
        env.reset(options={"site": "nowhere"})
    env.reset(options={})
    assert env.problem.site is CUT


@pytest.mark.parametrize("name", ["train", "random", "validation", "test"])
def test_a_split_draws_another_site_in_every_episode(name: str) -> None:
    env = BarrierDesign(name, releases=1)
    assert env.slots.kinds == ("fence", "ditch", "embankment", "gravity_wall", "mesh")
    drawn: list[str] = []
    for seed in (0, None, None, 0):
        env.draw(seed)  # nothing is simulated
        drawn.append(env.problem.site.name)
        assert ("mesh" in env.problem.kinds) == bool(env.problem.site.meshes)
    assert len(set(drawn)) == 3 and drawn[0] == drawn[3]
    assert set(drawn) <= set(sites.split("train" if name == "random" else name))


@pytest.mark.parametrize("env_class", [BarrierDesign, BarrierPlacement])
def test_a_sequence_draws_its_sites_under_common_limits(env_class: type[BarrierEnv]) -> None:
    targets = {"reach": 0.5}
    env = env_class(["quick", "verge", CUT], releases=1, targets=targets, max_cost=700.0)
    env.draw(0)
    drawn = [env.problem.site.name]
    for _ in range(30):
        env.draw(None)
        drawn.append(env.problem.site.name)
        assert env.problem.targets == Targets(reach=0.5) and env.problem.max_cost == 700.0
    assert {*drawn} == {"quick", "verge", CUT.name}
    env.draw(1, {"site": ["bench"]})
    assert env.problem.site.name == "bench" and env.problem.max_cost == 700.0


@pytest.mark.parametrize("site", ["bench", "random", "test", ["quick", "bench"]])
def test_a_spec_survives_as_json(site: str | list[str]) -> None:
    terms = {"kinds": ["fence", "ditch"], "max_barriers": 2, "flat": True}
    env = gymnasium.make("rigdda/BarrierDesign-v0", site=site, **terms)
    assert env.spec is not None
    spec = gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json())
    again = gymnasium.make(spec)
    assert again.action_space == env.action_space
    assert again.observation_space == env.observation_space


def test_flat_observations_hold_the_same(env: BarrierDesign) -> None:
    flat = BarrierDesign(CUT, **TERMS, flat=True)
    seen, _ = env.reset(seed=2)
    line, _ = flat.reset(seed=2)
    assert line in flat.observation_space and line.ndim == 1
    np.testing.assert_array_equal(line, np.concatenate([seen[n] for n in sorted(seen)]))


def test_same_seed_same_episodes(env: BarrierDesign) -> None:
    first = episodes(env, 11)
    assert same(first, episodes(env, 11))
    other = BarrierDesign(CUT, **TERMS)
    assert same(first, episodes(other, 11))
    assert not same(first, episodes(env, 12))
    assert first[1][4]["outcomes"] != first[3][4]["outcomes"]  # releases differ by episode


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


def test_only_a_time_limit_truncates() -> None:
    for limit, truncated in ((1, True), (2, False)):
        env = gymnasium.make(
            "rigdda.envs:rigdda/BarrierDesign-v0",
            site=CUT,
            max_barriers=2,
            kinds=("fence",),
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


def test_no_picture_without_a_render_mode() -> None:
    env = BarrierDesign(CUT)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(3), r"shape of action = \(3,\): give 8 numbers, shape \(8,\)"),
        (np.array([0.0, np.nan, *[0.0] * 6]), r"action\[1\] = nan: give a number"),
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
        ({"record": __file__}, "record = .*: name a folder that can be created"),
        ({"record_trigger": bool}, "record_trigger = .*: also give a folder"),
        ({"record": Path("here"), "record_trigger": 2}, "record_trigger = 2: give a function"),
        ({"site": "nowhere"}, "site = 'nowhere'"),
        ({"site": []}, r"site = \[\]: give a site, a split, or a sequence"),
        ({"site": 3}, "site = 3: give a site, a split, or a sequence"),
        ({"site": ["quick", "test"]}, r"site\[1\] = 'test': give a name"),
        ({"site": ["quick", "nowhere"]}, r"site\[1\].site = 'nowhere'"),
        ({"max_barriers": -1}, "max_barriers = -1"),
        ({"site": "train", "kinds": "fence"}, "kinds = 'fence': give a sequence"),
        ({"site": "train", "kinds": ["fence", "fence"]}, "kinds = .*: name each kind once"),
        ({"site": "bench", "kinds": ["mesh"]}, "kinds = .*: leave mesh out"),
        ({"site": "train", "kinds": ["mesh"]}, r"kinds = \('mesh',\): .*: random-1 offers no mesh"),
        (
            {"site": "wide-train", "kinds": ["mesh", "removal"]},
            "kinds = .*: add a kind that every site offers: wide-1 offers no mesh or removal",
        ),
        ({"fidelity": "coarse"}, "coarse"),
    ],
)
def test_bad_keywords_are_refused(keywords: dict, message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        BarrierDesign(**keywords)
    assert "\n" not in str(caught.value)


def test_a_split_of_which_a_site_offers_no_kind_is_refused_before_a_site_is_drawn() -> None:
    env = BarrierDesign("quick", kinds=["mesh"])
    for seed in range(3):
        with pytest.raises(BadInput, match=r"kinds = .*: random-1 offers no mesh"):
            env.reset(seed=seed, options={"site": "train"})
    both = BarrierDesign("train", kinds=["mesh", "ditch"])
    assert both.slots.kinds == ("mesh", "ditch")


@pytest.mark.parametrize(("wrong", "right"), [(3.0, 3), (True, 1), ("2", 2)])
@pytest.mark.parametrize("site", ["quick", "train"])
def test_a_number_of_barriers_is_checked_whatever_was_made_before(
    wrong: object, right: int, site: str
) -> None:
    for _ in range(2):
        with pytest.raises(BadInput, match=r"max_barriers = .*: give a whole number"):
            BarrierDesign(site, max_barriers=wrong)  # type: ignore[arg-type]
        assert BarrierDesign(site, max_barriers=np.int64(right)).slots.count == right


def test_a_barrier_that_is_asked_for_and_not_built_is_told() -> None:
    env = BarrierDesign(CUT, kinds=("ditch",), max_barriers=4, releases=1)
    _, info = env.reset(seed=1)
    assert info["dropped"] == ()
    widest = np.tile(np.array([1.0, 0.0, 1.0, 1.0], dtype=np.float32), 4)
    _, _, _, _, info = env.step(widest)
    assert len(info["layout"]) + len(info["dropped"]) == 4 and info["dropped"]
    assert all(words.endswith("no feasible place for it in the zone") for words in info["dropped"])
    vector = env.problem.encode(info["layout"])
    assert env.problem.dropped(vector) == ()
