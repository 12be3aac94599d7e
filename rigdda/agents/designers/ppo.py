"""Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347; Stable-Baselines3).

It searches on one problem. `rigdda.agents.learning.ppo` trains a policy for many sites.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from rigdda.agents.designers.protocol import DesignResult, Ledger, Plan, Progress, finish
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem

COMMON: dict[str, Any] = {"gamma": 1.0, "device": "cpu", "verbose": 0}
"""Options of the trainer."""


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
    `rigdda.agents.designers.policy`.

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
    model.set_logger(Logger(None, []))  # the default one creates a temporary folder
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
