"""A trained policy, which maps the observation of a site without barriers to a layout.

The policy is a small neural network, evaluated with numpy and stored in a safetensors file. It
designs a layout without a search.
"""

from __future__ import annotations

import json
import os
import zipfile
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
from rigdda.envs.site_sampling import SAMPLED_KINDS, Slots
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
            part.write_bytes(_in_order(save(arrays, dict(self.notes))))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Network:
        """Read a network from a file.

        Raises
        ------
        BadInput
            If there is no such file or if it does not contain a valid network.
        """
        if os.path.isdir(path):
            mend = "this is a folder: name the file in it that `rigdda train` wrote"
            raise BadInput("policy", str(path), mend)
        try:
            with safe_open(path, framework="numpy") as file:
                count = sum(key.startswith("weight") for key in file.keys())
                get = file.get_tensor
                layers = [(get(f"weight {i}"), get(f"bias {i}")) for i in range(count)]
                network = cls(get("mean"), get("scale"), layers, file.metadata() or {})
        except (OSError, SafetensorError) as error:
            mend = f"name a file that `rigdda train` wrote ({error})"
            if zipfile.is_zipfile(path):
                mend = (
                    "this is a model of Stable-Baselines3: evaluate it as an entry of `rigdda exam`"
                )
            raise BadInput("policy", str(path), mend) from None
        if not network.finite:
            mend = "name a file with finite numbers and positive scales, as `rigdda train` writes"
            raise BadInput("policy", str(path), mend)
        return network


def scaled(features: Floats, mean: Floats, scale: Floats) -> Floats:
    """Return features with mean 0 and deviation 1 on the training sites, clipped to [-3, 3]."""
    return np.clip((features - mean) / scale, np.float32(-3.0), np.float32(3.0))


def _in_order(raw: bytes) -> bytes:
    """Return a safetensors file with a sorted header, so that the bytes are reproducible."""
    size = int.from_bytes(raw[:8], "little")
    header = json.dumps(json.loads(raw[8 : 8 + size]), sort_keys=True).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + raw[8 + size :]


NAMES = tuple(FIELDS)
"""Arrays of an observation, in the order in which they are concatenated."""

FEATURES = sum(FIELDS[name].size for name in NAMES)
"""Number of features."""


def features(seen: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
    """Return the (FEATURES,) features of one observation of `BarrierDesign`."""
    return np.concatenate([seen[name] for name in NAMES]).astype(np.float32)


SLOTS = Slots(SAMPLED_KINDS, 3)
"""Slots for the barriers that a policy decides on."""

MOST_FINAL_RELEASES = 64
"""Largest number of releases on which the designer evaluates its layout."""


def _anchor() -> np.ndarray:
    """Return numbers for one barrier near the lower end of the zone and two that are nearly built.

    A barrier is built if its first number, the presence, is positive.
    """
    numbers = np.zeros((SLOTS.count, SLOTS.width))
    numbers[:, 0] = 0.4, -0.4, -0.4
    numbers[:, 1] = 0.6, -0.2, 0.2
    return numbers.ravel()


ANCHOR = _anchor()
"""Decision to which the outputs of a network are added, (SLOTS.size,); trainings start from it."""


def using(network: Network) -> Designer:
    """Return a designer that builds the layout which a network decides.

    The designer needs at least 2 releases and evaluates the layout on up to 64 of its releases.
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
        return ledger.result(
            ledger.evaluate(layout, "report", min(MOST_FINAL_RELEASES, ledger.left))
        )

    return design


def decide(network: Network, problem: DesignProblem) -> Layout:
    """Return the layout of a network, within the slots and the kinds that a problem allows.

    Raises
    ------
    BadInput
        If the problem allows no kind of barrier that policies build.
    Diverged
        If a simulation for the observation diverges.
    """
    kinds = [kind for kind in problem.kinds if kind in SLOTS.kinds]
    if not kinds:
        mend = "allow a kind that policies build: " + ", ".join(SLOTS.kinds)
        raise BadInput("kinds", problem.kinds, mend)
    site = replace(problem.site, barrier_zone=problem.zone)  # the observation covers this zone
    slots = min(problem.max_barriers, SLOTS.count)
    unlimited = DesignProblem(site, slots, kinds, max_cost=problem.max_cost)
    seen = features(observe(unlimited))
    numbers = np.clip(ANCHOR + network(seen), -1.0, 1.0)
    return SLOTS.decode(unlimited, numbers[: unlimited.max_barriers * SLOTS.width])


@lru_cache(maxsize=4)
def load(path: str | os.PathLike[str]) -> Network:
    """Return the network in a file; the file is read once.

    Raises
    ------
    BadInput
        If there is no such file, or if it does not contain a network from the features of an
        observation to a layout.
    """
    network = Network.load(path)
    sizes, wanted = network.sizes, (FEATURES, SLOTS.size)
    if not sizes or (sizes[0], sizes[-1]) != wanted:
        mend = "this is no policy of this version: name a file policy.safetensors that "
        mend += "`rigdda train` wrote"
        raise BadInput("policy", str(path), mend)
    return network
