"""Replays hold what it takes to compute them again, and `rigdda repeat` does so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import msgspec
import numpy as np
import pytest
from cases import cut
from processes import called

import rigdda
from rigdda import BadInput, Fence, Site
from rigdda.envs import replay_record
from rigdda.envs.registration import ENVIRONMENTS
from rigdda.envs.repetition import repeat
from rigdda.envs.replay_record import EpisodeRecord, ReleaseRecord, as_json, release_record
from rigdda.replay.recording import Marks

CUT = cut()
LAYOUT = (Fence(12.0, 2.0, energy_class=250),)
DESIGNS = [name for name in ENVIRONMENTS if "Corridor" not in name]  # records each release
every = pytest.mark.parametrize("name", DESIGNS)


def played(name: str, folder: Path, **keywords: Any) -> tuple[Path, list[float]]:
    """Return the replay of an episode of random actions, and its rewards."""
    env = gymnasium.make(name, record=folder, **keywords)
    env.action_space.seed(4)
    env.reset(seed=11)
    rewards, ended = [], False
    while not ended:
        action = env.action_space.sample()
        action[0] = abs(action[0])
        _, reward, ended, *_ = env.step(action)
        rewards.append(reward)
    env.close()
    (path,) = folder.iterdir()
    return path, rewards


@every
@pytest.mark.parametrize(
    "keywords",
    [
        {"site": CUT, "releases": 2},
        {"site": CUT, "releases": 20, "targets": {"reach": 0.2}, "kinds": ("fence",)},
        {"site": "validation", "releases": 1, "fidelity": "fast", "max_barriers": 2},
    ],
)
def test_an_episode_is_repeated_to_the_last_bit(
    name: str, keywords: dict[str, Any], tmp_path: Path
) -> None:
    path, rewards = played(name, tmp_path, **keywords)
    record = replay_record.load(path)
    assert isinstance(record, EpisodeRecord)
    assert (record.environment, record.rewards, record.seed) == (name, rewards, 11)
    assert len(record.release_seeds) == keywords["releases"]
    found = repeat(record)
    assert found.same and not found.other_versions


@pytest.mark.parametrize(
    "keywords",
    [
        {"site": "old-fence", "kinds": ("removal",)},
        {"site": ["old-fence"], "kinds": ("removal", "mesh", "ditch")},  # drawn: without mesh
        {"site": "slab-cut", "targets": {"individual": 1e-6}},
    ],
)
def test_kinds_and_targets_that_only_this_site_allows_are_repeated(
    keywords: dict[str, Any], tmp_path: Path
) -> None:
    """Sites of the splits have neither traffic nor, most of them, an old fence."""
    path, _ = played("rigdda/BarrierDesign-v0", tmp_path, releases=1, **keywords)
    assert repeat(replay_record.load(path)).same


@every
def test_episodes_of_copies_are_repeated(name: str, tmp_path: Path) -> None:
    batch = gymnasium.make_vec(
        name, 2, vectorization_mode="vector_entry_point", site=CUT, max_barriers=1, releases=1,
        record=tmp_path, autoreset_mode="NextStep",
    )  # fmt: skip
    batch.reset(seed=3)
    batch.action_space.seed(1)
    _, rewards, *_ = batch.step(batch.action_space.sample())
    for i in range(2):
        (path,) = (tmp_path / f"copy-{i}").iterdir()
        record = replay_record.load(path)
        assert isinstance(record, EpisodeRecord) and record.rewards == [rewards[i]]
        assert repeat(record).same


def test_a_command_repeats_an_episode_and_tells_what_differs(tmp_path: Path) -> None:
    path, (reward,) = played("rigdda/BarrierDesign-v0", tmp_path, site=CUT, releases=2)
    code, out, _ = called("repeat", path, folder=tmp_path)
    assert code == 0 and f"identical bit for bit: reward {reward!r}" in out

    record = replay_record.load(path)
    wrong = float(np.nextafter(reward, 1.0))
    versions = msgspec.structs.replace(record.versions, mechanics="0ld")
    other = msgspec.structs.replace(record, rewards=[wrong], versions=versions)
    run, _ = rigdda.release(CUT, (), 0)
    run.to_rerun(tmp_path / "other.rrd", Marks(record=as_json(other)))
    code, out, err = called("repeat", "other.rrd", folder=tmp_path)
    assert code == 1
    assert f"results differ: recorded reward {wrong!r}, computed reward {reward!r}" in err
    assert f"version differs: mechanics 0ld, now {record.versions.mechanics}" in out


@pytest.mark.parametrize("event", [None, "block"])
def test_a_release_is_repeated(event: str | None, tmp_path: Path) -> None:
    run, outcome = rigdda.release(CUT, LAYOUT, 5, event)
    record = release_record(CUT, LAYOUT, 5, event, outcome)
    run.to_rerun(tmp_path / "it.rrd", Marks(record=record))
    found = replay_record.load(tmp_path / "it.rrd")
    assert isinstance(found, ReleaseRecord) and found.site == CUT
    assert found.barriers[0]["kind"] == "fence"
    assert repeat(found).same
    assert not repeat(msgspec.structs.replace(found, seed=6)).same


def test_every_built_in_site_survives_in_a_record() -> None:
    for name in rigdda.sites.names():
        site = Site.load(name)
        assert msgspec.json.decode(msgspec.json.encode(site), type=Site) == site


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "name an existing .rrd file"),
        (b"no replay", "name a whole .rrd file"),
        ("", "recorded"),
        ("{}", "this version of rigdda recorded"),
    ],
)
def test_another_file_is_refused(content: bytes | str | None, words: str, tmp_path: Path) -> None:
    path = tmp_path / "it.rrd"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        run, _ = rigdda.release(CUT, (), 0)
        run.to_rerun(path, Marks(record=content))
    with pytest.raises(BadInput, match=words) as caught:
        replay_record.load(path)
    assert "\n" not in str(caught.value)
