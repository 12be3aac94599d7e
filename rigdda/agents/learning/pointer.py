"""Pointer network: a score of each layout from its features, as a torch module.

The same small network scores every layout, so that it does not matter how many layouts there are,
in which order, or on which site (Vinyals et al. 2015, arXiv:1506.03134, choose among inputs in this
way). It is added to the score by the forecast (`rigdda.agents.designers.policy.prior`) and is zero
before the training, which therefore begins with a policy that follows the forecasts. Several
members that were trained with different seeds are averaged.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from rigdda.agents.network import Network

Floats = NDArray[np.float32]

HIDDEN = 64
"""Number of neurons of each of the two hidden layers."""


class Pointer(torch.nn.Module):
    """Network from (..., A, F) scaled features to the logits of a policy.

    Parameters
    ----------
    width : int
        Number of features F.
    seed : int
        Seed of the initial weights.
    """

    first: torch.nn.Linear
    second: torch.nn.Linear
    last: torch.nn.Linear

    def __init__(self, width: int, seed: int):
        super().__init__()
        generator = torch.Generator().manual_seed(seed)
        self.first = torch.nn.Linear(width, HIDDEN)
        self.second = torch.nn.Linear(HIDDEN, HIDDEN)
        self.last = torch.nn.Linear(HIDDEN, 1)
        for layer in self.layers:
            bound = float(layer.in_features) ** -0.5
            torch.nn.init.uniform_(layer.weight, -bound, bound, generator=generator)
            torch.nn.init.zeros_(layer.bias)
        torch.nn.init.zeros_(self.last.weight)

    @property
    def layers(self) -> tuple[torch.nn.Linear, ...]:
        """The linear layers."""
        return self.first, self.second, self.last

    def forward(
        self, features: torch.Tensor, prior: torch.Tensor, mask: torch.Tensor
    ) -> torch.Tensor:
        """Return the (..., A) logits; those of layouts that cannot be built are minus infinity.

        Parameters
        ----------
        features : (..., A, F) tensor
            Scaled features.
        prior : (..., A) tensor
            Scores by the forecast.
        mask : (..., A) tensor of bool
            Layouts that can be built.
        """
        values = torch.tanh(self.second(torch.tanh(self.first(features))))
        scores: torch.Tensor = prior + self.last(values)[..., 0]
        return scores.masked_fill(~mask, -torch.inf)


def export(
    members: Sequence[Pointer], mean: Floats, scale: Floats, notes: dict[str, str]
) -> Network:
    """Return one network of which the outputs are the scores of the members."""
    layers = []
    for k, own in enumerate(zip(*(member.layers for member in members), strict=True)):
        weights = [layer.weight.detach().numpy().astype(np.float32) for layer in own]
        bias = np.concatenate([layer.bias.detach().numpy() for layer in own])
        layers.append((np.concatenate(weights) if k == 0 else _diagonal(weights), bias))
    return Network(mean, scale, layers, notes)


def _diagonal(weights: Sequence[Floats]) -> Floats:
    """Return a block-diagonal matrix."""
    rows, columns = weights[0].shape
    out = np.zeros((len(weights) * rows, len(weights) * columns), dtype=np.float32)
    for k, weight in enumerate(weights):
        out[k * rows : (k + 1) * rows, k * columns : (k + 1) * columns] = weight
    return out
