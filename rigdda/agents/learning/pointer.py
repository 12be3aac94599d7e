"""Pointer network: a score of each layout from its features, as a torch module.

The same small network scores every layout, so that it does not matter how many layouts there are,
in which order, or on which site (Vinyals et al. 2015, arXiv:1506.03134, choose among inputs in this
way). Several members that were trained with different seeds are averaged.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from rigdda.agents.network import Network

Floats = NDArray[np.float32]

HIDDEN = 64
"""Number of neurons of each of the two hidden layers."""


class Pointer(torch.nn.Module):
    """Network from (..., A, F) scaled features and a (..., A) mask to (..., A) logits.

    Parameters
    ----------
    width : int
        Number of features F.
    seed : int
        Seed of the initial weights.
    """

    def __init__(self, width: int, seed: int):
        super().__init__()
        generator = torch.Generator().manual_seed(seed)
        sizes = (width, HIDDEN, HIDDEN, 1)
        self.linear = torch.nn.ModuleList(
            torch.nn.Linear(a, b) for a, b in itertools.pairwise(sizes)
        )
        for layer in self.linear:
            bound = layer.in_features**-0.5
            torch.nn.init.uniform_(layer.weight, -bound, bound, generator=generator)
            torch.nn.init.zeros_(layer.bias)

    def forward(self, features: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
        """Return the logits; those of layouts that cannot be built are minus infinity."""
        values = features
        for layer in list(self.linear)[:-1]:
            values = torch.tanh(layer(values))
        scores = self.linear[-1](values)[..., 0]
        return scores.masked_fill(~mask, -torch.inf)


def export(
    members: Sequence[Pointer], mean: Floats, scale: Floats, notes: dict[str, str]
) -> Network:
    """Return one network of which the outputs are the scores of the members."""
    layers = []
    for k in range(3):
        own = [member.linear[k] for member in members]
        weights = [layer.weight.detach().numpy().astype(np.float32) for layer in own]  # type: ignore[union-attr, operator]
        bias = np.concatenate([layer.bias.detach().numpy() for layer in own])  # type: ignore[union-attr, operator]
        layers.append((np.concatenate(weights) if k == 0 else _diagonal(weights), bias))
    return Network(mean, scale, layers, notes)


def _diagonal(weights: Sequence[Floats]) -> Floats:
    """Return a block-diagonal matrix."""
    rows, columns = weights[0].shape
    out = np.zeros((len(weights) * rows, len(weights) * columns), dtype=np.float32)
    for k, weight in enumerate(weights):
        out[k * rows : (k + 1) * rows, k * columns : (k + 1) * columns] = weight
    return out
