"""The environment of corridors: money, rewards, order of sections and replays."""

from __future__ import annotations

import math
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rigdda.envs.repetition
import rigdda.envs.replay_record
from rigdda import BadInput, Corridor, CorridorSection, Ditch, Site
from rigdda.envs import CorridorProblem
from rigdda.envs.corridor_environment import CORRIDOR_FIELDS

NAMES = ("quick", "verge")


def make(**keywords: object) -> gymnasium.Env:
    terms = {"site": list(NAMES), "releases": 2, "kinds": ("ditch", "embankment")} | keywords
    return gymnasium.make("rigdda/Corridor-v0", **terms).unwrapped


def played(env: gymnasium.Env, seed: int, actions: object = None) -> tuple[list, list]:
    """Play an episode with random actions; return rewards and infos."""
    env.reset(seed=seed)
    env.action_space.seed(seed)
    rewards, infos, done = [], [], False
    while not done:
        action = env.action_space.sample() if actions is None else actions
        seen, reward, done, _, info = env.step(action)
        assert seen in env.observation_space
        rewards.append(reward)
        infos.append(info)
    return rewards, infos


def test_every_section_is_seen_once_and_rewards_add_up() -> None:
    env = make(budget=500.0)
    rewards, infos = played(env, 3)
    assert sorted(info["section"] for info in infos) == sorted(NAMES)
    before = math.fsum(s.length * s.problem.nothing.objective for s in env.placed)
    after = math.fsum(info["length"] * info["objective"] for info in infos)
    assert sum(rewards) == pytest.approx((before - after) / before)
    assert infos[-1]["gain"] == pytest.approx(before - after)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), budget=st.floats(1.0, 3000.0))
def test_what_is_spent_never_exceeds_the_budget(seed: int, budget: float) -> None:
    env = MONEY
    env.reset(seed=seed, options={"budget": budget})
    env.action_space.seed(seed)
    left, done = env.budget, False
    while not done:
        *_, done, _, info = env.step(env.action_space.sample())
        assert info["money"] >= -1e-6 * env.budget
        assert info["money"] == pytest.approx(left - info["length"] * info["cost"])
        left = info["money"]
        assert not info["layout"] or info["cost"] > 0.0
    assert info["spent"] + info["money"] == pytest.approx(env.budget)


MONEY = make(releases=1)
MIDDLE = np.tile([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], 3)
"""A ditch or an embankment of medium size in the middle of the zone, and two more."""


@pytest.mark.parametrize("budget", [0.0, 1.0])
def test_barriers_beyond_the_money_are_told(budget: float) -> None:
    env = make(budget=budget)
    _, infos = played(env, 0, MIDDLE)
    assert env.budget == budget * sum(section.length for section in env.placed)
    assert all(info["layout"] == () for info in infos)
    assert all("EUR are left" in " ".join(info["dropped"]) for info in infos)


def test_the_same_seed_gives_the_same_episode() -> None:
    env = make()
    first, second = played(env, 5), played(env, 5)
    assert first[0] == second[0]
    assert [info["layout"] for info in first[1]] == [info["layout"] for info in second[1]]


def test_copies_step_as_if_alone() -> None:
    batch = gymnasium.make_vec("rigdda/Corridor-v0", 2, site=list(NAMES), releases=1)
    seen, _ = batch.reset(seed=7)
    alone = [gymnasium.make("rigdda/Corridor-v0", site=list(NAMES), releases=1) for _ in range(2)]
    starts = [env.reset(seed=7 + i)[0] for i, env in enumerate(alone)]
    actions = np.zeros((2, *alone[0].action_space.shape), dtype=np.float32) + 0.5
    for name in CORRIDOR_FIELDS:
        assert (seen[name] == np.stack([start[name] for start in starts])).all()
    _, rewards, *_ = batch.step(actions)
    assert rewards.tolist() == [env.step(actions[i])[1] for i, env in enumerate(alone)]


def test_every_entry_of_the_corridor_changes() -> None:
    env = make(site=["quick", "verge", "bench"], budget=(50.0, 500.0), flat=False)
    seen = {name: [] for name in CORRIDOR_FIELDS}
    for seed in range(6):
        first, _ = env.reset(seed=seed)
        for now in (first, env.step(-np.ones(18))[0]):
            for name in CORRIDOR_FIELDS:
                seen[name].append(now[name])
    for name, values in seen.items():
        assert (np.ptp(np.stack(values), axis=0) > 0.0).all(), name


def test_replays_show_the_sections_with_barriers(tmp_path: Path) -> None:
    env = make(record=tmp_path, budget=2000.0)
    _, infos = played(env, 1, MIDDLE)
    built = [i + 1 for i, info in enumerate(infos) if info["layout"]]
    files = sorted(file.name for file in (tmp_path / "episode-000000").iterdir())
    assert files == [f"section-{i:04d}.rrd" for i in built] and files
    found = rigdda.envs.replay_record.load(tmp_path / "episode-000000" / files[0])
    assert rigdda.envs.repetition.repeat(found).same


def test_replays_of_another_run_are_kept(tmp_path: Path) -> None:
    content = {}
    for seed, name in ((1, "episode-000000"), (2, "episode-000000-2"), (3, "episode-000000-3")):
        env = make(record=tmp_path, budget=2000.0)
        _, infos = played(env, seed, MIDDLE)
        built = sum(bool(info["layout"]) for info in infos)
        files = [*(tmp_path / name).iterdir()]
        assert len(files) == built > 0
        assert all(file.read_bytes() == old for file, old in content.items())
        content |= {file: file.read_bytes() for file in files}
    assert sorted(folder.name for folder in tmp_path.iterdir()) == [
        "episode-000000", "episode-000000-2", "episode-000000-3"
    ]  # fmt: skip


def test_copies_that_share_a_folder_keep_each_others_replays(tmp_path: Path) -> None:
    batch = gymnasium.make_vec(
        "rigdda/Corridor-v0", 2, vectorization_mode="sync", site=list(NAMES), releases=1,
        kinds=("ditch", "embankment"), budget=2000.0, record=tmp_path,
    )  # fmt: skip
    batch.reset(seed=1)
    for _ in NAMES:
        batch.step(np.stack([MIDDLE, MIDDLE]).astype(np.float32))
    batch.close()
    folders = sorted(folder.name for folder in tmp_path.iterdir())
    assert folders == ["episode-000000", "episode-000000-2"]


@pytest.mark.parametrize("batched", [False, True])
def test_a_truncated_episode_is_recorded_when_the_next_begins(
    tmp_path: Path, batched: bool
) -> None:
    asked: list[int] = []

    def trigger(episode: int) -> bool:
        asked.append(episode)
        return episode != 1

    terms = {
        "site": list(NAMES), "releases": 1, "kinds": ("ditch", "embankment"), "budget": 2000.0,
        "record": tmp_path, "record_trigger": trigger, "max_episode_steps": 1,
    }  # fmt: skip
    if batched:
        env = gymnasium.make_vec(
            "rigdda/Corridor-v0", 1, autoreset_mode="Disabled",
            vectorization_mode="vector_entry_point", **terms,
        )  # fmt: skip
        folder, action = tmp_path / "copy-0", MIDDLE[None].astype(np.float32)
    else:
        env = gymnasium.make("rigdda/Corridor-v0", **terms)
        folder, action = tmp_path, MIDDLE.astype(np.float32)

    def episodes() -> dict[str, list[str]]:
        found = sorted(folder.glob("episode-*"))
        return {one.name: sorted(file.name for file in one.iterdir()) for one in found}

    only = ["section-0001.rrd"]
    env.reset(seed=1)
    for number in range(3):
        *_, terminated, truncated, _ = env.step(action)
        assert truncated and not terminated and asked == [*range(number + 1)]
        if number < 2:
            env.reset()
            assert episodes() == {"episode-000000": only}
    env.close()
    assert episodes() == {"episode-000000": only, "episode-000002": only}


def test_an_episode_without_steps_has_no_number(tmp_path: Path) -> None:
    env = make(record=tmp_path)
    env.reset(seed=0)
    env.reset()
    env.close()
    assert not [*tmp_path.iterdir()]


def test_kinds_need_to_fit_the_own_sites_only() -> None:
    env = make(site=["old-fence"], kinds=["removal"], releases=1, budget=3000.0)
    env.reset(seed=0)
    *_, info = env.step(np.ones(env.action_space.shape))
    assert {barrier.kind for barrier in info["layout"]} <= {"removal"}
    with pytest.raises(BadInput, match=r"kinds = .*quick has no existing barrier"):
        make(site=["quick"], kinds=["removal"])


def test_the_info_is_that_of_the_design_environment_without_targets() -> None:
    _, info = gymnasium.make("rigdda/BarrierDesign-v0", site="quick").reset(seed=0)
    env = make()
    own = {"section", "length", "money", "metres", "spent", "gain"}
    assert {*env.reset(seed=0)[1]} == {*info} - {"targets"} | own
    assert {*env.step(MIDDLE)[-1]} == {*info} - {"targets"} | own


def test_sections_of_a_corridor_are_all_played() -> None:
    quick = Site.load("quick")
    sections = tuple(CorridorSection(quick, 10.0 * (i + 1), f"km {i}") for i in range(3))
    env = make(site=Corridor("small", sections, (1e4, 2e4)))
    _, infos = played(env, 0)
    assert sorted(info["section"] for info in infos) == ["km 0", "km 1", "km 2"]
    assert env.budget in (pytest.approx(1e4), pytest.approx(2e4))


@pytest.mark.parametrize(
    "values, named",
    [
        ({"name": 3}, "name = 3: give a text"),
        ({"sections": None}, "sections = None: give a sequence of rigdda.CorridorSection"),
        ({"sections": (3,)}, r"sections\[0\] = 3: give rigdda.CorridorSection only"),
        ({"sections": ()}, "sections = 0: give 1 to 10,000"),
        ({"budgets": ()}, "budgets = "),
        ({"yearly_budget": -5}, "yearly_budget = -5: .* at least 0 .*EUR/year"),
        ({"yearly_budget": "a"}, "yearly_budget = 'a': give a number"),
        ({"yearly_budget": math.nan}, "yearly_budget = nan: give a finite number"),
    ],
)
def test_malformed_corridors(values: dict[str, object], named: str) -> None:
    sections = [CorridorSection(Site.load("quick"), 10.0, "km 0")]
    sound = {"name": "small", "sections": sections, "budgets": [2e4, 1e4], "yearly_budget": 300}
    corridor = Corridor(**sound)
    assert corridor.sections == tuple(sections) and corridor.budgets == (1e4, 2e4)
    assert isinstance(corridor.yearly_budget, float)
    with pytest.raises(BadInput, match=named):
        Corridor(**sound | values)


@pytest.mark.parametrize(
    "keywords, named",
    [
        ({"site": []}, "site"),
        ({"site": "nowhere"}, "nowhere"),
        ({"sections": 3}, "sections"),
        ({"budget": -1.0}, "budget"),
        ({"budget": "much"}, "budget"),
        ({"budget": (5.0, 1.0)}, "budget"),
        ({"lengths": (0.0, 1.0)}, "lengths"),
        ({"lengths": 0.0}, "lengths = 0.*above 0"),
        ({"lengths": 0}, "lengths = 0.*above 0"),
        ({"lengths": 0.04}, r"lengths = 0\.04: .* of at least 0\.1 m"),
        ({"lengths": (0.001, 300.0)}, r"lengths = \(0\.001, 300\.0\): .* of at least 0\.1 m"),
        ({"budget": (0.0, 5.0)}, "budget"),
        (
            {"site": ["quick", "bench"], "kinds": ["mesh"]},
            r"kinds = \('mesh',\): add a kind that every site offers: bench offers no mesh",
        ),
        ({"site": "train", "kinds": ["mesh"]}, "kinds = .*: random-1 offers no mesh"),
        ({"site": "corridor-12", "kinds": ["mesh"]}, "kinds = .* offers no mesh"),
        ({"max_barriers": 3.0}, r"max_barriers = 3\.0: give a whole number"),
        ({"releases": 0}, "releases"),
    ],
)
def test_malformed_keywords(keywords: dict[str, object], named: str) -> None:
    with pytest.raises(BadInput, match=named):
        make(**keywords)


def test_the_shortest_lengths_are_not_rounded_to_nothing() -> None:
    for lengths in (0.1, (0.1, 0.2), (0.1, 300.0)):
        env = make(lengths=lengths, budget=0.0)
        for seed in range(5):
            env.reset(seed=seed)
            assert all(section.length >= 0.1 for section in env.placed)


def test_a_layout_that_costs_what_is_left_is_built_from_a_rounded_action() -> None:
    """Actions have 32 bits, and their layouts may be a little dearer than those in 64 bits."""
    env = make(site=["quick"], lengths=100.0)
    rng, dearer = np.random.default_rng(0), 0
    env.reset(seed=0)
    for _ in range(60):
        vector = np.tile([1.0, *rng.uniform(-0.9, 0.9, 3), -1.0, 1.0], 3)
        vector[6:] = -1.0
        layout = env.slots.decode(env.problem, vector)
        if not layout:  # there is no place for it
            continue
        cost = env.problem.site.capital(layout)
        env.reset(seed=0, options={"budget": cost})
        action = env.slots.encode(env.problem, layout).astype(np.float32)
        ask = env.ask(action)
        assert ask is not None and len(ask.layout) == len(layout) == 1
        dearer += env.problem.site.capital(ask.layout) > cost * (1.0 + 1e-9)
    assert dearer > 5
    env.reset(seed=0, options={"budget": cost * (1.0 - 1e-5)})
    assert env.ask(action) is None


def test_the_objective_of_a_corridor_is_that_of_its_sections() -> None:
    quick = Site.load("quick")
    sections = tuple(CorridorSection(quick, 50.0 * (i + 1), f"km {i}") for i in range(2))
    problem = CorridorProblem(Corridor("two", sections, (1e5,)))
    ditch = (Ditch(quick.slope.toe, 1.0, 3.0),)
    found = problem.evaluate([(), ditch], range(60))
    parts = [
        problem.problems[0].evaluate((), range(60)),
        problem.problems[1].evaluate(ditch, range(60)),
    ]
    assert found.objective == pytest.approx(50.0 * parts[0].objective + 100.0 * parts[1].objective)
    assert found.cost == pytest.approx(100.0 * quick.capital(ditch))
    nothing = problem.problems[0].nothing.objective
    assert found.gain == pytest.approx(100.0 * (nothing - parts[1].objective))
    assert found.gain_ci[0] < found.gain < found.gain_ci[1]
