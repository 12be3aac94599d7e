"""A trained policy: from what is seen of a site without barriers to its layout, with no search.

`rigdda train` makes it and `rigdda evaluate --policy FILE` tries it; none is shipped. Torch is not
needed to use it.
"""

from __future__ import annotations

import os
from functools import lru_cache

import numpy as np
from msgspec.structs import replace

from rigdda import BadInput, Layout
from rigdda.agents.features import WIDTH, features
from rigdda.agents.network import Network
from rigdda.agents.protocol import Designer, DesignResult, Ledger, Progress
from rigdda.agents.store import Store
from rigdda.envs import DesignProblem
from rigdda.envs.observation import observe
from rigdda.envs.site_sampling import KINDS, Slots

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
    seen = features(observe(posed, problem.nothing, np.zeros(0)))
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
