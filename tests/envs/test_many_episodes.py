"""A thousand random episodes: no exception, no value that is not finite, no memory that grows."""

from __future__ import annotations

import gc
import tracemalloc
from typing import Any

import gymnasium
import numpy as np
import pytest
from cases import cut

from rigdda.envs import outcome_cache
from rigdda.envs.registration import ENVIRONMENTS

EPISODES, COPIES = 1000, 8


def play(env: Any, episodes: int) -> None:
    ended = 0
    while ended < episodes:
        seen, rewards, terminated, truncated, infos = env.step(env.action_space.sample())
        assert np.isfinite(rewards).all()
        assert np.isfinite(infos["objective"]).all()
        assert all(np.isfinite(array).all() for array in seen.values())
        ended += int((terminated | truncated).sum())


@pytest.mark.slow
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_a_thousand_random_episodes(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is remembered on purpose is made small, so that it is full from the start."""
    for memory in (outcome_cache.bare_outcomes, outcome_cache.standing_layouts):
        monkeypatch.setattr(memory, "room", 16)
    env = gymnasium.make_vec(name, num_envs=COPIES, site=cut(), releases=1)
    env.reset(seed=0)
    env.action_space.seed(0)
    play(env, 300)
    gc.collect()
    tracemalloc.start()
    play(env, 100)
    sizes = []
    for _ in range(2):
        play(env, (EPISODES - 400) // 2)
        gc.collect()
        sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert sizes[1] - sizes[0] < 2e5
