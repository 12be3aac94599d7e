"""Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347; Stable-Baselines3).

`design` searches on one problem. `learn`, which `rigdda train` uses, trains a policy on a pool of
sites with one release per episode. This is the only module of the designers that imports torch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from rigdda.agents.designers.protocol import DesignResult, Ledger, Plan, Progress, finish
from rigdda.agents.designers.store import Store
from rigdda.agents.policy import ANCHOR, SLOTS, Network, features, scaled
from rigdda.envs import DesignProblem, sb3_vec_env
from rigdda.files import atomic

Floats = NDArray[np.float32]

HIDDEN = [64, 64]
"""Number of neurons of the hidden layers; small, because the number of sites is small."""
EXPLORATION = -0.7
"""Initial logarithm of the standard deviation of actions. The standard deviation is half the
distance from the middle of the decision box to its edge, so that every kind and class is tried."""
RECENT = 0.1
"""Weight of the last episode in the moving average of the reward of a site [-]."""
COMMON: dict[str, Any] = {"gamma": 1.0, "device": "cpu", "verbose": 0}


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best layout that PPO tries on this problem within the budget.

    A policy for a single problem is a normal distribution in the decision box. This is therefore a
    search like that of the other designers. For a policy for many sites, see
    `rigdda.agents.policy`.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    plan = Plan.of(ledger.left)
    bandit = _Bandit(ledger, plan)
    torch.set_num_threads(1)
    model = PPO(
        "MlpPolicy", bandit, n_steps=16, batch_size=16, n_epochs=10, learning_rate=1e-3,
        policy_kwargs={"net_arch": [16], "log_std_init": -0.7}, seed=ledger.seed, **COMMON,
    )  # fmt: skip
    if bandit.paid():
        model.learn(10**9, callback=_WhilePaid(bandit))
    return finish(ledger, plan)


class _Bandit(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A problem as an environment with a constant observation; a ledger counts the releases."""

    def __init__(self, ledger: Ledger, plan: Plan):
        self.ledger, self.plan = ledger, plan
        self.observation_space = spaces.Box(0.0, 1.0, (1,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (ledger.problem.size,), np.float32)

    def paid(self) -> bool:
        """Return whether the budget suffices for another layout of the search."""
        return self.ledger.left >= self.plan.reserve + self.plan.releases

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Return the constant observation."""
        super().reset(seed=seed)
        return np.zeros(1, dtype=np.float32), {}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Evaluate the layout of an action."""
        problem = self.ledger.problem
        evaluation = self.ledger.evaluate(problem.decode(action), "search", self.plan.releases)
        return np.zeros(1, dtype=np.float32), problem.reward(evaluation), True, False, {}


class _WhilePaid(BaseCallback):
    """Callback that ends the training when the budget is used up."""

    def __init__(self, bandit: _Bandit):
        super().__init__()
        self.bandit = bandit

    def _on_step(self) -> bool:
        return self.bandit.paid()


class Featured(VecEnvWrapper):
    """Wrapper of `BarrierDesign` with the observations and actions of the policy network.

    Observations are scaled features, and actions are added to `rigdda.agents.policy.ANCHOR`. The
    moving average of the reward of each site is subtracted from the reward, because sites differ
    in the possible gain. Each copy of the environment keeps its site.
    """

    def __init__(self, venv: VecEnv, mean: Floats, scale: Floats):
        self.mean, self.scale = mean, scale
        self.usual = np.full(venv.num_envs, np.nan)
        seen = spaces.Box(-np.inf, np.inf, mean.shape, np.float32)
        super().__init__(venv, seen, spaces.Box(-2.0, 2.0, venv.action_space.shape, np.float32))

    def reset(self) -> Floats:
        """Start every copy."""
        return self._scaled(self.venv.reset())

    def step_async(self, actions: NDArray[Any]) -> None:
        """Start a step of every copy."""
        built = np.clip(ANCHOR + actions, -1.0, 1.0)
        self.venv.step_async(built.astype(np.float32))

    def step_wait(self) -> Any:
        """Step every copy."""
        seen, rewards, dones, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                last = features(info["terminal_observation"])
                info["terminal_observation"] = scaled(last, self.mean, self.scale)
        self.usual = np.where(np.isnan(self.usual), rewards, self.usual)
        better = rewards - self.usual
        self.usual += RECENT * better
        return self._scaled(seen), better.astype(np.float32), dones, infos

    @property
    def state(self) -> dict[str, Any]:
        """The state between episodes that determines all further steps."""
        return {
            "usual": self.usual.copy(),
            "random": [rng.bit_generator.state for rng in self.get_attr("np_random")],
            "seeds": self.get_attr("seeds"),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Reset all copies to a state that was read from `state`."""
        self.reset()
        self.usual = state["usual"].copy()
        for i, rng in enumerate(self.get_attr("np_random")):
            rng.bit_generator.state = state["random"][i]
            self.set_attr("seeds", state["seeds"][i], i)

    def _scaled(self, seen: Any) -> Floats:
        plain = [features({k: v[i] for k, v in seen.items()}) for i in range(self.num_envs)]
        return np.stack([scaled(one, self.mean, self.scale) for one in plain])


def pool(names: Sequence[str], fidelity: str) -> VecEnv:
    """Return one copy of `BarrierDesign` for each site, with one release per episode.

    Each copy keeps its site, so that the releases for its observation are simulated only once.
    Releases are simulated in threads on all cores.
    """
    copies = sb3_vec_env(
        "rigdda/BarrierDesign-v0", len(names), site=names[0], kinds=SLOTS.kinds,
        max_barriers=SLOTS.count, releases=1, fidelity=fidelity,
    )  # fmt: skip
    for i, name in enumerate(names):
        copies.get_attr("sites", i)[0].change(name)
    return copies


def learner(copies: VecEnv, seed: int, logs: Path) -> PPO:
    """Return the trainer of a new policy, with a learning rate that decreases to zero."""
    torch.set_num_threads(1)
    return PPO(
        "MlpPolicy", copies, n_steps=2, batch_size=max(2, copies.num_envs // 4), n_epochs=4,
        learning_rate=_shrinking, target_kl=0.02, seed=seed, tensorboard_log=str(logs),
        policy_kwargs={"net_arch": HIDDEN, "log_std_init": EXPLORATION}, **COMMON,
    )  # fmt: skip


def _shrinking(left: float) -> float:
    """Return the learning rate for the remaining fraction of the episodes."""
    return 4e-4 * left


def _net(model: PPO) -> ActorCriticPolicy:
    assert isinstance(model.policy, ActorCriticPolicy)
    return model.policy


def learn(model: PPO, episodes: int, checkpoint: Path, tick: Callable[[int], None]) -> None:
    """Train up to a total number of episodes and save the trainer after every rollout."""
    if model.num_timesteps < episodes:
        kept = _Keep(checkpoint, tick)
        model.learn(
            episodes - model.num_timesteps, kept, reset_num_timesteps=False, tb_log_name="ppo"
        )


class _Moment:
    """State of a training besides the networks and the optimiser.

    It contains the state of the environments and of the random generators of torch and numpy. The
    latter is used by Stable-Baselines3 for its batches.
    """

    def __init__(self, model: PPO):
        self.torch, self.numpy = torch.get_rng_state(), np.random.get_state()  # noqa: NPY002
        env = model.get_env()
        self.copies = env.state if isinstance(env, Featured) else None

    def restore(self, copies: VecEnv) -> None:
        """Restore the state."""
        if isinstance(copies, Featured) and self.copies is not None:
            copies.restore(self.copies)
        torch.set_rng_state(self.torch)
        np.random.set_state(self.numpy)  # noqa: NPY002


def resume(checkpoint: Path, copies: VecEnv) -> PPO:
    """Return the trainer that was saved in a file, which continues as if it had not been stopped.

    With the same number of episodes, the result is identical bit for bit to that of an
    uninterrupted training. With more episodes, the learning rate is that for the new fraction of
    remaining episodes.
    """
    torch.set_num_threads(1)
    model = PPO.load(checkpoint, copies, device="cpu", force_reset=False)
    model.moment.restore(copies)  # type: ignore[attr-defined]  # kept by `_Keep`
    return model


class _Keep(BaseCallback):
    """Callback that saves the trainer before every rollout and reports the number of episodes."""

    def __init__(self, checkpoint: Path, tick: Callable[[int], None]):
        super().__init__()
        self.checkpoint, self.tick = checkpoint, tick

    def _on_step(self) -> bool:
        self.tick(self.num_timesteps)
        return True

    def _on_rollout_start(self) -> None:
        self._save()

    def _on_training_end(self) -> None:
        self._save()

    def _save(self) -> None:
        assert isinstance(self.model, PPO)
        self.model.moment = _Moment(self.model)  # type: ignore[attr-defined]
        with atomic(self.checkpoint) as part, part.open("wb") as file:
            self.model.save(file)


def export(model: PPO, mean: Floats, scale: Floats, notes: dict[str, str]) -> Network:
    """Return the policy of a trainer as a network that does not need torch."""
    policy = _net(model)
    hidden = policy.mlp_extractor.policy_net.children()
    linear = [module for module in hidden if isinstance(module, torch.nn.Linear)]
    layers = [
        (layer.weight.detach().numpy().copy(), layer.bias.detach().numpy().copy())
        for layer in (*linear, policy.action_net)
        if isinstance(layer, torch.nn.Linear)
    ]
    return Network(mean, scale, layers, notes)
