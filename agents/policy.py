"""A trained policy: from what is seen of a site without barriers to its layout, with no search.

It is a small network in numpy, kept in a safetensors file.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from rigdda import BadInput, Layout
from rigdda.agents.designers.protocol import Designer, DesignResult, Ledger, Progress
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem
from rigdda.envs.observation import FIELDS, observe
from rigdda.envs.site_sampling import KINDS, Slots
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


NAMES = tuple(FIELDS)
"""Arrays of an observation, in the order in which they are put together."""

WIDTH = sum(FIELDS[name].size for name in NAMES)
"""Number of features."""


def features(seen: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
    """Return the (WIDTH,) features of one observation of `BarrierDesign`."""
    return np.concatenate([seen[name] for name in NAMES]).astype(np.float32)


SLOTS = Slots(KINDS, 3)
"""Barriers that a policy decides on, of any kind that a problem allows."""

FINAL = 64
"""Releases on which the designer tells what its layout is worth, if it has so many."""


def _anchor() -> np.ndarray:
    """Return one barrier near the zone's lower end; two more a little short of being built."""
    numbers = np.zeros((SLOTS.count, SLOTS.width))
    numbers[:, 0] = 0.4, -0.4, -0.4
    numbers[:, 1] = 0.6, -0.2, 0.2
    return numbers.ravel()


ANCHOR = _anchor()
"""What a network's outputs are added to, (SLOTS.size,): from here all is tried in a training."""


def using(network: Network) -> Designer:
    """Return the designer that builds what a network decides.

    It needs 2 releases at least; all it has, up to 64, tell what the layout is worth.
    """

    def design(
        problem: DesignProblem,
        simulations: int,
        seed: int = 0,
        progress: Progress | None = None,
        store: Store | None = None,
    ) -> DesignResult:
        ledger = Ledger(problem, simulations, seed, progress, store)
        layout = decide(network, problem)
        return ledger.result(ledger.evaluate(layout, "report", min(FINAL, ledger.left)))

    return design


def decide(network: Network, problem: DesignProblem) -> Layout:
    """Return what a network builds, as far as a problem has slots for it and allows its kinds.

    Raises
    ------
    BadInput, Diverged
        If a problem allows no kind that policies build; if a simulation of what is seen diverges.
    """
    kinds = [kind for kind in problem.kinds if kind in SLOTS.kinds]
    if not kinds:
        mend = "allow a kind that policies build: " + ", ".join(SLOTS.kinds)
        raise BadInput("kinds", problem.kinds, mend)
    site = replace(problem.site, barrier_zone=problem.zone)  # what is seen is seen across it
    posed = DesignProblem(site, min(problem.max_barriers, SLOTS.count), kinds)
    seen = features(observe(posed))
    numbers = np.clip(ANCHOR + network(seen), -1.0, 1.0)
    return SLOTS.decode(posed, numbers[: posed.max_barriers * SLOTS.width])


@lru_cache(maxsize=4)
def load(path: str | os.PathLike[str]) -> Network:
    """Return the network of a file, read once.

    Raises
    ------
    BadInput
        If there is no such file, it is not a network or not one from these features to layouts.
    """
    network = Network.load(path)
    sizes, wanted = network.sizes, (WIDTH, SLOTS.size)
    if not sizes or (sizes[0], sizes[-1]) != wanted:
        mend = f"name a network of {wanted[0]} features and {wanted[1]} outputs"
        raise BadInput("policy", str(path), mend)
    return network
