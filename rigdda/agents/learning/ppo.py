"""Proximal policy optimisation with masked actions on `rigdda/BarrierForecast-v0`.

After Schulman et al. 2017 (arXiv:1707.06347) and, for the masks, Huang and Ontanon 2022
(arXiv:2006.14171). The whole algorithm is in `learn`, which samples episodes from the vectorised
environment like any agent. An episode has one step, so that the return is the reward. In place of a
critic, the baseline is the moving average of the reward of each site.
"""

from __future__ import annotations

from collections.abc import Callable

import gymnasium
import numpy as np
import torch

from rigdda.agents.designers.policy import prior
from rigdda.agents.learning.pointer import Pointer
from rigdda.agents.network import Network, scaled
from rigdda.envs.forecast_table import ForecastTable

ITERATIONS, BATCH, EPOCHS, PARTS = 150, 512, 4, 4
"""Number of iterations, episodes of an iteration, passes over them and minibatches of a pass."""
RATE, CLIP, ENTROPY, RECENT = 1e-3, 0.2, 0.01, 0.05
"""Learning rate, which falls linearly to 0, clip range of the probability ratio, weight of the
entropy, and weight of a new reward in the baseline of its site."""


def learn(
    policy: Pointer, table: ForecastTable, scaling: Network, seed: int, tick: Callable[[], None]
) -> None:
    """Train a policy on the training sites of a table.

    Parameters
    ----------
    policy : Pointer
        The policy, which is changed.
    table : ForecastTable
        The table of the environment.
    scaling : Network
        Network with the mean and the scale of the features.
    seed : int
        Seed of the sites, the actions and the minibatches.
    tick : callable
        Called after every iteration.
    """
    env = gymnasium.make_vec(
        "rigdda/BarrierForecast-v0", BATCH, vectorization_mode="vector_entry_point",
        site="train", table=table, layout_features=True,
    )  # fmt: skip
    generator = torch.Generator().manual_seed(seed)
    optimiser = torch.optim.Adam(policy.parameters(), lr=RATE)
    baseline: dict[str, float] = {}
    seen, infos = env.reset(seed=seed)
    for iteration in range(ITERATIONS):
        optimiser.param_groups[0]["lr"] = RATE * (1.0 - iteration / ITERATIONS)
        given = seen["layouts"].reshape(BATCH, len(table.layouts), -1)
        features = torch.tensor(scaled(given, scaling.mean, scaling.scale))
        score = torch.tensor(prior(given))
        mask, names = torch.tensor(infos["action_mask"] > 0), infos["site"]
        with torch.no_grad():
            before = policy(features, score, mask).log_softmax(dim=1)
            actions = torch.multinomial(before.exp(), 1, generator=generator)[:, 0]
            before = before.gather(1, actions[:, None])[:, 0]
        seen, rewards, _, _, infos = env.step(actions.numpy())
        usual = [baseline.setdefault(name, float(rewards[names == name].mean())) for name in names]
        advantage = torch.tensor(rewards - np.array(usual), dtype=torch.float32)
        advantage /= advantage.std() + 1e-8
        for name, reward in zip(names, rewards.tolist(), strict=True):
            baseline[name] += RECENT * (reward - baseline[name])
        for _ in range(EPOCHS):
            for part in torch.randperm(BATCH, generator=generator).chunk(PARTS):
                logp = policy(features[part], score[part], mask[part]).log_softmax(dim=1)
                ratio = (logp.gather(1, actions[part, None])[:, 0] - before[part]).exp()
                bounded = ratio.clamp(1.0 - CLIP, 1.0 + CLIP)
                gain = torch.minimum(ratio * advantage[part], bounded * advantage[part]).mean()
                safe = logp.masked_fill(~mask[part], 0.0)
                entropy = -(safe.exp() * mask[part] * safe).sum(dim=1).mean()
                optimiser.zero_grad()
                (-gain - ENTROPY * entropy).backward()
                optimiser.step()
        tick()
