"""Wrappers of Gymnasium on the environments, single and in batches, as the pages say."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from cases import cut
from gymnasium import wrappers
from gymnasium.wrappers import vector as of_batches

import rigdda.envs  # noqa: F401 - registers the environments

CUT = cut()
DESIGN, PLACEMENT = "rigdda/BarrierDesign-v0", "rigdda/BarrierPlacement-v0"
FORECAST, CORRIDOR = "rigdda/BarrierForecast-v0", "rigdda/Corridor-v0"
BOXES = pytest.mark.parametrize("name", [DESIGN, PLACEMENT])
EVERY = pytest.mark.parametrize("name", [DESIGN, PLACEMENT, FORECAST])


def made(name: str, **keywords: object) -> gymnasium.Env:
    """Return a small environment."""
    terms = {} if name == FORECAST else {"site": CUT, "releases": 1, "max_barriers": 1}
    return gymnasium.make(name, **(terms | keywords))


def batch(name: str, **keywords: object) -> gymnasium.vector.VectorEnv:
    """Return a batch of two copies in the mode that most wrappers need."""
    terms = {} if name == FORECAST else {"site": CUT, "releases": 1, "max_barriers": 1}
    given = terms | {"autoreset_mode": "NextStep"} | keywords
    return gymnasium.make_vec(name, 2, vectorization_mode="vector_entry_point", **given)


def played(env: gymnasium.Env) -> tuple[object, float, dict]:
    """Play one episode; return the last observation, the sum of rewards and the last info."""
    env.reset(seed=1)
    env.action_space.seed(1)
    total, over = 0.0, False
    while not over:
        seen, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert seen in env.observation_space
        total, over = total + float(reward), terminated or truncated
    return seen, total, info


def played_together(env: gymnasium.vector.VectorEnv, steps: int = 3) -> tuple[object, dict]:
    """Take some steps with a batch; return the rewards of all steps and the last infos."""
    env.reset(seed=1)
    env.action_space.seed(1)
    rewards = []
    for _ in range(steps):
        seen, reward, _, _, infos = env.step(env.action_space.sample())
        rewards.append(reward)
    assert seen in env.observation_space
    return np.array(rewards), infos


@EVERY
def test_record_episode_statistics(name: str) -> None:
    _, total, info = played(wrappers.RecordEpisodeStatistics(made(name)))
    assert info["episode"]["r"] == pytest.approx(total) and info["episode"]["l"] == 1
    rewards, infos = played_together(of_batches.RecordEpisodeStatistics(batch(name)), 1)
    assert infos["episode"]["r"] == pytest.approx(rewards[0])


@EVERY
def test_normalize_observation_needs_flat_observations(name: str) -> None:
    seen, *_ = played(wrappers.NormalizeObservation(made(name, flat=True)))
    assert np.isfinite(seen).all()
    played_together(of_batches.NormalizeObservation(batch(name, flat=True)))
    with pytest.raises((AttributeError, TypeError, ValueError, np.exceptions.AxisError)):
        played(wrappers.NormalizeObservation(made(name)))
    flat = wrappers.FlattenObservation(made(name))
    assert np.isfinite(played(wrappers.NormalizeObservation(flat))[0]).all()


@EVERY
def test_normalize_reward(name: str) -> None:
    plain, scaled = played(made(name))[1], played(wrappers.NormalizeReward(made(name)))[1]
    assert np.isfinite(scaled) and np.sign(scaled) == np.sign(plain)
    rewards, _ = played_together(of_batches.NormalizeReward(batch(name)))
    assert np.isfinite(rewards).all()


@EVERY
def test_flatten_observation(name: str) -> None:
    seen, *_ = played(wrappers.FlattenObservation(made(name)))
    assert seen.shape == played(made(name, flat=True))[0].shape
    assert (seen == played(made(name, flat=True))[0]).all()
    played_together(of_batches.FlattenObservation(batch(name)))


@EVERY
def test_transform_reward(name: str) -> None:
    plain = played(made(name))[1]
    doubled = wrappers.TransformReward(made(name), lambda reward: 2.0 * reward)
    assert played(doubled)[1] == pytest.approx(2.0 * plain)
    twice = of_batches.TransformReward(batch(name), lambda rewards: 2.0 * rewards)
    assert played_together(twice)[0] == pytest.approx(2.0 * played_together(batch(name))[0])


@BOXES
def test_clip_action(name: str) -> None:
    clipped, plain = wrappers.ClipAction(made(name)), made(name)
    far = np.full(plain.action_space.shape, 5.0, np.float32)
    clipped.reset(seed=2)
    plain.reset(seed=2)
    assert clipped.step(far)[1] == plain.step(far.clip(-1.0, 1.0))[1]
    both = of_batches.ClipAction(batch(name))
    both.reset(seed=2)
    assert np.isfinite(both.step(np.stack([far, -far]))[1]).all()


def test_clip_action_is_for_boxes() -> None:
    with pytest.raises(TypeError, match="Box"):
        wrappers.ClipAction(made(FORECAST))


def test_record_video(tmp_path: Path) -> None:
    pytest.importorskip("moviepy")
    env = made(DESIGN, render_mode="rgb_array")
    recorded = wrappers.RecordVideo(env, str(tmp_path / "videos"), disable_logger=True)
    played(recorded)
    recorded.close()
    assert list((tmp_path / "videos").glob("*.mp4"))


def test_record_video_of_a_batch_is_refused_for_forecasts(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="render"):
        of_batches.RecordVideo(batch(FORECAST), str(tmp_path))


PAGES = Path(__file__).parents[2] / "docs" / "environments"


@EVERY
def test_the_page_names_the_wrappers(name: str) -> None:
    page = (PAGES / f"{name.removeprefix('rigdda/')}.md").read_text(encoding="utf-8")
    assert "## Wrappers" in page
    assert "NormalizeObservation" in page or "(BarrierDesign-v0.md#wrappers)" in page
