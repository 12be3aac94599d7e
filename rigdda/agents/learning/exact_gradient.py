"""Exact policy gradient: gradient ascent on the expected reward of a policy over a table.

An episode of `rigdda/BarrierForecast-v0` has one step, and a table contains the reward of every
layout on every site. The expected reward of a policy pi is therefore a sum,

    J = mean over sites s of sum over layouts a of pi(a | s) r(s, a),

of which the gradient needs no samples, no baseline and no critic. The whole algorithm is in
`learn`.
"""

from __future__ import annotations

from collections.abc import Callable

import torch

from rigdda.agents.learning.pointer import Pointer

STEPS = 400
"""Number of steps."""
RATE, DECAY, JITTER, ENTROPY = 3e-3, 0.01, 0.1, 0.01
"""Learning rate, which falls linearly to 0, weight decay, standard deviation of the noise added to
scaled features, and weight of the entropy."""


def learn(
    policy: Pointer,
    features: torch.Tensor,
    prior: torch.Tensor,
    mask: torch.Tensor,
    reward: torch.Tensor,
    seed: int,
    tick: Callable[[], None],
) -> None:
    """Train a policy on a table.

    Parameters
    ----------
    policy : Pointer
        The policy, which is changed.
    features : (S, A, F) tensor
        Scaled features.
    prior : (S, A) tensor
        Scores by the forecast.
    mask : (S, A) tensor of bool
        Layouts that can be built.
    reward : (S, A) tensor
        Rewards; entries outside the mask are not used.
    seed : int
        Seed of the noise.
    tick : callable
        Called after every step.
    """
    generator = torch.Generator().manual_seed(seed)
    optimiser = torch.optim.AdamW(policy.parameters(), lr=RATE, weight_decay=DECAY)
    for step in range(STEPS):
        optimiser.param_groups[0]["lr"] = RATE * (1.0 - step / STEPS)
        noise = JITTER * torch.randn(features.shape, generator=generator)
        logp = policy(features + noise, prior, mask).log_softmax(dim=1).masked_fill(~mask, 0.0)
        chance = logp.exp() * mask
        expected = (chance * reward).sum(dim=1).mean()
        entropy = -(chance * logp).sum(dim=1).mean()
        optimiser.zero_grad()
        (-expected - ENTROPY * entropy).backward()
        optimiser.step()
        tick()
