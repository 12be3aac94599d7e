"""Gymnasium's own recorder of videos takes the pictures of an environment."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import pytest
from cases import cut
from gymnasium.wrappers import RecordVideo

import rigdda.envs  # noqa: F401  registers the environments

clips = pytest.importorskip("moviepy", reason="needs the extra video")


def test_a_video_shows_every_step_of_an_episode(tmp_path: Path) -> None:
    env = gymnasium.make(
        "rigdda/BarrierPlacement-v0",
        site=cut(),
        releases=1,
        max_barriers=2,
        render_mode="rgb_array",
    )
    film = RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda episode: True)
    film.action_space.seed(0)
    film.reset(seed=0)
    steps, ended = 0, False
    while not ended:
        *_, terminated, truncated, _ = film.step(film.action_space.sample())
        ended, steps = terminated or truncated, steps + 1
    height, width, _ = env.render().shape
    film.close()
    (file,) = (tmp_path / "videos").iterdir()
    with clips.VideoFileClip(str(file)) as clip:
        assert clip.n_frames == 1 + steps
        assert clip.size == [width, height]
        assert clip.fps == env.metadata["render_fps"]
