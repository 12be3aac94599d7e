"""What every registered environment keeps: checkers, spaces, lazy imports, learning."""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from cases import cut
from gymnasium.utils.env_checker import check_env

from rigdda.envs.registration import ENVIRONMENTS

CUT = cut()
every = pytest.mark.parametrize("name", ENVIRONMENTS)


flat = pytest.mark.parametrize("flat", [False, True])


@every
@flat
def test_gymnasium_finds_no_fault(name: str, flat: bool) -> None:
    check_env(gymnasium.make(name, site=CUT, releases=1, flat=flat).unwrapped)


@every
@flat
def test_stable_baselines3_finds_no_fault(name: str, flat: bool) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    terms = {"site": CUT, "releases": 1, "render_mode": "rgb_array", "flat": flat}
    env = gymnasium.make(name, **terms)
    checker.check_env(env.unwrapped, skip_render_check=False)


@every
def test_any_action_gives_an_observation_of_the_space(name: str) -> None:
    env = gymnasium.make(name, site=CUT, releases=1)
    env.action_space.seed(0)
    for i in range(10):
        seen, _ = env.reset(seed=i)
        assert seen in env.observation_space
        seen, reward, *_ = env.step(env.action_space.sample())
        assert seen in env.observation_space
        assert np.isfinite(reward)


@every
def test_ppo_takes_200_steps(name: str) -> None:
    ppo = pytest.importorskip("stable_baselines3").PPO
    env = gymnasium.make(name, site=CUT, max_barriers=1, releases=1)
    model = ppo("MultiInputPolicy", env, n_steps=50, batch_size=50, n_epochs=2, gamma=1.0, seed=0)
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(200)
    assert model.num_timesteps == 200
    after = model.policy.parameters()
    assert any((a != b).any() for a, b in zip(after, before, strict=True))
    seen, _ = env.reset()
    action, _ = model.predict(seen)
    assert env.action_space.contains(action)


def test_heavy_packages_are_imported_when_they_are_used() -> None:
    heavy = {"torch", "stable_baselines3", "matplotlib", "rerun"}
    code = f"import sys, rigdda.envs.environments; sys.exit(not {heavy!r}.isdisjoint(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
