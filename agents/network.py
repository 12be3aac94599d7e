"""A small network in numpy: what a trained policy needs to decide, and the file it is kept in."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from rigdda import BadInput
from rigdda.files import atomic

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """Layers with tanh between them, on features that are scaled first.

    Parameters
    ----------
    mean, scale : (F,) arrays
        What is subtracted from the features, and what they are then divided by.
    layers : sequence of ((out, in) array, (out,) array)
        Weights and biases.
    notes : mapping of str to str
        Who made it and how.
    """

    mean: Floats
    scale: Floats
    layers: Sequence[tuple[Floats, Floats]]
    notes: Mapping[str, str]

    @property
    def sizes(self) -> list[int]:
        """Numbers that go into the first layer and that come out of each; [] if they do not fit."""
        sizes = [self.mean.size]
        for weight, bias in self.layers:
            if bias.shape != (bias.size,) or weight.shape != (bias.size, sizes[-1]):
                return []
            sizes.append(bias.size)
        return sizes if self.scale.shape == self.mean.shape == (self.mean.size,) else []

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite and every feature has a scale above 0."""
        arrays = [self.mean, self.scale, *(array for layer in self.layers for array in layer)]
        return all(np.isfinite(array).all() for array in arrays) and bool((self.scale > 0).all())

    def __call__(self, features: Floats) -> NDArray[np.float64]:
        """Return the outputs for (F,) features."""
        values = scaled(features, self.mean, self.scale).astype(np.float64)
        for weight, bias in self.layers[:-1]:
            values = np.tanh(weight @ values + bias)
        weight, bias = self.layers[-1]
        return weight @ values + bias

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the network with its notes as safetensors."""
        tensors = {"mean": self.mean, "scale": self.scale}
        for i, (weight, bias) in enumerate(self.layers):
            tensors |= {f"weight {i}": weight, f"bias {i}": bias}
        arrays = {k: np.ascontiguousarray(v, dtype=np.float32) for k, v in tensors.items()}
        with atomic(path) as part:
            part.write_bytes(_in_order(save(arrays, dict(self.notes))))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Network:
        """Read a network.

        Raises
        ------
        BadInput
            If there is no such file or it is not a network.
        """
        try:
            with safe_open(path, framework="numpy") as file:
                count = sum(key.startswith("weight") for key in file.keys())
                get = file.get_tensor
                layers = [(get(f"weight {i}"), get(f"bias {i}")) for i in range(count)]
                network = cls(get("mean"), get("scale"), layers, file.metadata() or {})
        except (OSError, SafetensorError) as error:
            mend = f"name a file that `rigdda train` wrote ({error})"
            raise BadInput("policy", str(path), mend) from None
        if not network.finite:
            mend = "name a file of finite numbers with scales above 0, as `rigdda train` writes"
            raise BadInput("policy", str(path), mend)
        return network


def scaled(features: Floats, mean: Floats, scale: Floats) -> Floats:
    """Return features of mean 0 and deviation 1 on the training sites, at most 3 in size."""
    return np.clip((features - mean) / scale, np.float32(-3.0), np.float32(3.0))


def _in_order(raw: bytes) -> bytes:
    """Return a safetensors file with its header in alphabetical order: else notes come in any."""
    size = int.from_bytes(raw[:8], "little")
    header = json.dumps(json.loads(raw[8 : 8 + size]), sort_keys=True).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + raw[8 + size :]
