"""Small neural networks that are evaluated with numpy and stored in safetensors files.

Policies, the value network and the agent for corridors use them, so that none of them needs torch.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from rigdda import BadInput
from rigdda.envs.forecast_table import header_sorted
from rigdda.envs.observation import FIELDS
from rigdda.files import atomic

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """A network of linear layers with tanh between them and scaled features as input.

    Parameters
    ----------
    mean, scale : (F,) arrays
        The mean is subtracted from the features, which are then divided by the scale.
    layers : sequence of ((out, in) array, (out,) array)
        Weights and biases of the layers.
    notes : mapping of str to str
        Notes on how the network was trained.
    """

    mean: Floats
    scale: Floats
    layers: Sequence[tuple[Floats, Floats]]
    notes: Mapping[str, str]

    @property
    def sizes(self) -> list[int]:
        """Number of features and of outputs of each layer, or [] if the shapes do not match."""
        sizes = [self.mean.size]
        for weight, bias in self.layers:
            if bias.shape != (bias.size,) or weight.shape != (bias.size, sizes[-1]):
                return []
            sizes.append(bias.size)
        return sizes if self.scale.shape == self.mean.shape == (self.mean.size,) else []

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite and all scales are positive."""
        arrays = [self.mean, self.scale, *(array for layer in self.layers for array in layer)]
        return all(np.isfinite(array).all() for array in arrays) and bool((self.scale > 0).all())

    def __call__(self, features: Floats) -> NDArray[np.float64]:
        """Return the outputs of the network for (..., F) features."""
        values = scaled(features, self.mean, self.scale).astype(np.float64)
        for weight, bias in self.layers[:-1]:
            values = np.tanh(values @ weight.T + bias)
        weight, bias = self.layers[-1]
        return values @ weight.T + bias

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the network and its notes to a safetensors file."""
        tensors = {"mean": self.mean, "scale": self.scale}
        for i, (weight, bias) in enumerate(self.layers):
            tensors |= {f"weight {i}": weight, f"bias {i}": bias}
        arrays = {k: np.ascontiguousarray(v, dtype=np.float32) for k, v in tensors.items()}
        with atomic(path) as part:
            part.write_bytes(header_sorted(save(arrays, dict(self.notes))))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Network:
        """Read a network from a file.

        Raises
        ------
        BadInput
            If there is no such file or if it does not contain a valid network.
        """
        if os.path.isdir(path):
            hint = "this is a folder: name the file in it that `rigdda train` wrote"
            raise BadInput("policy", str(path), hint)
        try:
            with safe_open(path, framework="numpy") as file:
                count = sum(key.startswith("weight") for key in file.keys())
                get = file.get_tensor
                layers = [(get(f"weight {i}"), get(f"bias {i}")) for i in range(count)]
                network = cls(get("mean"), get("scale"), layers, file.metadata() or {})
        except (OSError, SafetensorError) as error:
            hint = f"name a file that `rigdda train` wrote ({error})"
            if zipfile.is_zipfile(path):
                hint = (
                    "this is a model of Stable-Baselines3: evaluate it as an entry of `rigdda exam`"
                )
            raise BadInput("policy", str(path), hint) from None
        if not network.finite:
            hint = "name a file with finite numbers and positive scales, as `rigdda train` writes"
            raise BadInput("policy", str(path), hint)
        return network


def scaled(features: Floats, mean: Floats, scale: Floats) -> Floats:
    """Return features with mean 0 and deviation 1 on the training sites, clipped to [-3, 3]."""
    return np.clip((features - mean) / scale, np.float32(-3.0), np.float32(3.0))


def scaling(seen: Floats) -> tuple[Floats, Floats]:
    """Return the mean and the standard deviation of (n, F) features.

    The standard deviation of a feature that does not vary is replaced by 1.
    """
    scale = seen.std(axis=0)
    return seen.mean(axis=0), np.where(scale > 1e-6, scale, 1.0).astype(np.float32)


NAMES = tuple(FIELDS)
"""Arrays of an observation, in the order in which they are concatenated."""

WIDTH = sum(FIELDS[name].size for name in NAMES)
"""Number of features."""


def features(seen: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
    """Return the (WIDTH,) features of one observation of `BarrierDesign`."""
    return np.concatenate([seen[name] for name in NAMES]).astype(np.float32)
