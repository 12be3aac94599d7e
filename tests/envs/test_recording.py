"""Replays of episodes: the release that stands for the others, read back by rerun's reader."""

from __future__ import annotations

import os
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from cases import cut
from rerun.chunk import RrdReader

import rigdda
from rigdda import BadInput
from rigdda.barriers import describe
from rigdda.envs import DesignProblem
from rigdda.envs.environments import BarrierDesign, BarrierPlacement

CUT = cut()
FENCE = {"kinds": ("fence",)}
ACTION = np.array([1.0, 0.3, -0.4, -0.6], dtype=np.float32)
OTHER = np.array([1.0, -0.9, 0.0, -0.6], dtype=np.float32)


def rows(path: Path, entity: str, component: str, static: bool = False) -> list:
    """Return the values of a component, one a row in order of time."""
    stream = RrdReader(path).stream().filter(content=entity, is_static=static)
    (chunk,) = stream.to_chunks()
    return chunk.to_record_batch().column(component).to_pylist()


def test_an_episode_is_recorded(tmp_path: Path) -> None:
    env = BarrierDesign(CUT, **FENCE, max_barriers=1, releases=3, record=tmp_path / "replays")
    env.reset(seed=5)
    assert not (tmp_path / "replays").exists()
    _, reward, _, _, info = env.step(ACTION)
    path = tmp_path / "replays" / "episode-000000.rrd"
    assert os.listdir(path.parent) == [path.name]

    found = DesignProblem(CUT, 1, **FENCE).evaluate(info["layout"], env.seeds)
    seed, event = found.typical
    run, outcome = rigdda.release(CUT, info["layout"], seed, event)
    for i in (0, len(run.scene.blocks) - 1):
        places = rows(path, f"/world/blocks/{i}", "Transform3D:translation")
        assert len(places) == len(run.times)
        for frame in (0, len(places) // 2, -1):
            assert places[frame][0][:2] == pytest.approx(run.poses[frame, i, :2], rel=1e-6)
    debris = np.ravel(rows(path, "/plots/debris", "Scalars:scalars"))
    assert debris[-1] == pytest.approx(outcome.debris_fraction, abs=1e-9)

    there = {chunk.entity_path for chunk in RrdReader(path).stream().to_chunks()}
    assert {"/world/barriers/0", "/world/road", "/world/terrain"} <= there
    (wall,) = info["layout"]
    ((notes,),) = rows(path, "/notes", "TextDocument:text", static=True)
    assert f"**seed**: {seed}, event {event}, representative of the 3 scored" in notes
    assert f"**layout**: {describe(wall, 2)}" in notes
    assert f"**reward**: {reward:+.4f}" in notes
    assert f"**objective**: {info['objective']:.4f}" in notes


def test_copies_that_share_a_folder_keep_each_others_replays(tmp_path: Path) -> None:
    import rigdda.envs  # noqa: F401  registers the environments

    batch = gymnasium.make_vec(
        "rigdda/BarrierDesign-v0", 2, vectorization_mode="sync", site=CUT, **FENCE,
        max_barriers=1, releases=2, record=tmp_path,
    )  # fmt: skip
    batch.reset(seed=3)
    batch.step(np.stack([ACTION, ACTION]))
    batch.close()
    assert sorted(os.listdir(tmp_path)) == ["episode-000000-2.rrd", "episode-000000.rrd"]


def test_a_truncated_episode_is_recorded_when_the_next_begins(tmp_path: Path) -> None:
    env = BarrierPlacement(CUT, **FENCE, max_barriers=2, releases=1, record=tmp_path)
    env.reset(seed=5)
    _, _, terminated, _, _ = env.step(ACTION)
    assert not terminated and not os.listdir(tmp_path)
    env.reset()
    assert os.listdir(tmp_path) == ["episode-000000.rrd"]
    env.reset()  # nothing was placed: nothing to show
    assert os.listdir(tmp_path) == ["episode-000000.rrd"]
    env.step(ACTION)
    env.close()
    assert sorted(os.listdir(tmp_path)) == ["episode-000000.rrd", "episode-000001.rrd"]


def test_the_trigger_chooses_episodes(tmp_path: Path) -> None:
    asked: list[int] = []

    def odd(episode: int) -> bool:
        asked.append(episode)
        return episode % 2 == 1

    env = BarrierDesign(
        CUT, **FENCE, max_barriers=1, releases=1, record=tmp_path, record_trigger=odd
    )
    for _ in range(4):
        env.reset()
        env.reset()  # an episode that was not finished has no number
        env.step(ACTION)
    assert asked == [0, 1, 2, 3]
    assert sorted(os.listdir(tmp_path)) == ["episode-000001.rrd", "episode-000003.rrd"]


def test_a_trigger_that_raises_costs_no_step(tmp_path: Path) -> None:
    left = ["soon"]

    def trigger(episode: int) -> bool:
        if left:
            raise RuntimeError(left.pop())
        return episode == 0

    terms = {"max_barriers": 1, "releases": 1}
    env = BarrierDesign(CUT, **FENCE, **terms, record=tmp_path, record_trigger=trigger)
    plain = BarrierDesign(CUT, **FENCE, **terms)
    env.reset(seed=3), plain.reset(seed=3)
    with pytest.raises(RuntimeError, match="soon"):
        env.step(ACTION)
    assert env.step(ACTION)[1:] == plain.step(ACTION)[1:]
    assert os.listdir(tmp_path) == ["episode-000000.rrd"]


def test_a_replay_that_cannot_be_written_costs_no_step(tmp_path: Path) -> None:
    env = BarrierDesign(CUT, **FENCE, max_barriers=1, releases=1, record=tmp_path / "replays")
    plain = BarrierDesign(CUT, **FENCE, max_barriers=1, releases=1)
    env.reset(seed=3), plain.reset(seed=3)
    (tmp_path / "replays").touch()
    with pytest.warns(UserWarning, match="no replay of episode 0"):
        found = env.step(ACTION)
    assert found[1:] == plain.step(ACTION)[1:]
    (tmp_path / "replays").unlink()
    env.reset()
    env.step(ACTION)
    assert os.listdir(tmp_path / "replays") == ["episode-000001.rrd"]


@pytest.mark.parametrize("folder", [f"{os.devnull}/o", __file__, f"{__file__}/o"])
def test_a_folder_that_cannot_be_made_is_refused(folder: str) -> None:
    with pytest.raises(BadInput, match=r"record = .*: name a folder"):
        BarrierDesign(CUT, **FENCE, record=folder)


def test_an_episode_without_barriers_is_recorded(tmp_path: Path) -> None:
    env = BarrierDesign(CUT, **FENCE, max_barriers=1, releases=1, record=str(tmp_path))
    env.reset(seed=0)
    env.step(np.full(4, -1.0, np.float32))
    ((notes,),) = rows(tmp_path / "episode-000000.rrd", "/notes", "TextDocument:text", static=True)
    assert "**layout**: no barrier" in notes
    assert "**reward**: +0.0000" in notes


def test_recording_changes_nothing_else(tmp_path: Path) -> None:
    plain = BarrierDesign(CUT, **FENCE, max_barriers=1, releases=2)
    recorded = BarrierDesign(CUT, **FENCE, max_barriers=1, releases=2, record=tmp_path)
    for env in (plain, recorded):
        env.reset(seed=9)
    assert plain.step(ACTION)[1:] == recorded.step(ACTION)[1:]
    assert plain.reset()[1] == recorded.reset()[1]


def test_every_placement_is_recorded(tmp_path: Path) -> None:
    """On the timelines `placement` and `sim_time`, with seed, layout, reward and objective."""
    env = BarrierPlacement(CUT, **FENCE, max_barriers=2, releases=2, record=tmp_path)
    said = [env.reset(seed=5)[1]]
    rewards = [0.0]
    for slot in (ACTION, OTHER):
        _, reward, *_, info = env.step(slot)
        said.append(info)
        rewards.append(reward)
    (path,) = tmp_path.iterdir()
    end = DesignProblem(CUT, 2, **FENCE).evaluate(said[-1]["layout"], env.seeds)
    seed, event = end.typical
    objectives = np.ravel(rows(path, "/episode/objective", "Scalars:scalars"))
    assert objectives.tolist() == [info["objective"] for info in said]
    assert np.ravel(rows(path, "/episode/reward", "Scalars:scalars")).tolist() == rewards
    for k, info in enumerate(said):
        run, _ = rigdda.release(CUT, info["layout"], seed, event)
        entity = f"/placement_{k}/world/blocks/0"
        places = rows(path, entity, "Transform3D:translation")
        assert places[-1][0][:2] == pytest.approx(run.poses[-1, 0, :2], rel=1e-6)
        assert set(rows(path, entity, "placement")) == {k}
        (chunk,) = RrdReader(path).stream().filter(content=entity, is_static=False).to_chunks()
        sim_time = chunk.to_record_batch().column("sim_time").cast("int64").to_numpy()
        np.testing.assert_allclose(1e-9 * sim_time, run.times, atol=1e-8)
    ((notes,),) = rows(path, "/notes", "TextDocument:text", static=True)
    assert f"**seed**: {seed}, event {event}, representative of the 2 scored" in notes
    for info, reward in zip(said, rewards, strict=True):
        words = "; ".join(describe(b, 2) for b in info["layout"]) or "no barrier"
        numbers = f"| {reward:+.4f} | {info['objective']:.4f} | "
        lines = [line for line in notes.splitlines() if line.endswith(f"| {words} |")]
        assert any(numbers in line for line in lines)
