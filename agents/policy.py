"""A trained policy: from what is seen of a site without barriers to its fences, with no search.

It starts from the engineering rule's fence, as far as that can be told from what is seen; the
network says what is better, as differences of the vector.

`rigdda train` makes it; the one that is shipped says by which command, with which seed and version.
Torch is not needed to use it.
"""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from agents.features import RULE, WIDTH, features
from agents.network import Network
from agents.protocol import Designer, DesignResult, Ledger, Progress
from agents.store import Store
from envs import DesignProblem
from envs.envelope import SEEDS
from envs.observation import observe
from rigdda import BadInput, Fence, Layout, check

KINDS = ("fence",)
"""What a policy builds."""
SLOTS = 3
"""Fences that it decides on."""
VERGE = (-0.4, -0.8, 0.0), (0.4, -0.8, 0.0)
"""Slots of the fences that are not built: at 0.4 m of the 4 m that sites allow by default."""
SHIPPED = Path(__file__).with_suffix(".safetensors")


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the layout of the shipped policy and its evaluation.

    At most 36 simulations are used: 4 to look at, 32 to evaluate.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 5, the seed out of range or fences are not among the kinds; if a
        simulation diverges.
    """
    return using(load(SHIPPED))(problem, simulations, seed, progress, store)


def using(network: Network) -> Designer:
    """Return the designer that builds what a network decides."""

    def design(
        problem: DesignProblem,
        simulations: int,
        seed: int = 0,
        progress: Progress | None = None,
        store: Store | None = None,
    ) -> DesignResult:
        ledger = Ledger(problem, simulations, seed, progress, store)
        if ledger.budget <= len(SEEDS):
            mend = (
                f"give at least {len(SEEDS) + 1}: the policy looks at {len(SEEDS)} releases first"
            )
            raise BadInput("simulations", simulations, mend)
        layout = decide(network, problem)
        ledger.used += len(SEEDS)
        return ledger.result(ledger.evaluate(layout, "final", min(32, ledger.left)))

    return design


def decide(network: Network, problem: DesignProblem) -> Layout:
    """Return what a network builds: of more fences than there are slots, the highest.

    Raises
    ------
    BadInput, Diverged
        If fences are not among the kinds; if a simulation diverges.
    """
    check.one_of("kind of the policy's barriers", *KINDS, problem.kinds)
    posed = pose(problem)
    seen = features(observe(posed, ()))
    layout = posed.decode(np.clip(anchor(seen) + network(seen), -1.0, 1.0))
    fences = [barrier for barrier in layout if isinstance(barrier, Fence)]
    kept = sorted(fences, key=lambda fence: -fence.height)[: problem.max_barriers]
    return tuple(sorted(kept, key=lambda fence: fence.x))


def anchor(seen: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the (9,) vector, for (F,) features, that a network's outputs are added to.

    The rule's fence, then none: two that are a little too low to be built, so that what is tried
    around them sometimes is.
    """
    return np.concatenate([seen[RULE], *VERGE])


def pose(problem: DesignProblem) -> DesignProblem:
    """Return a problem as policies are trained on it: of `SLOTS` fences."""
    weights = problem.risk_weight, problem.cost_weight, problem.cost_limit
    return DesignProblem(problem.site, SLOTS, KINDS, *weights)


@lru_cache(maxsize=4)
def load(path: str | os.PathLike[str]) -> Network:
    """Return the network of a file, read once.

    Raises
    ------
    BadInput
        If there is no such file, it is not a network or not one from these features to fences.
    """
    network = Network.load(path)
    sizes, wanted = network.sizes, (WIDTH, 3 * SLOTS)
    if not sizes or (sizes[0], sizes[-1]) != wanted:
        mend = f"name a network of {wanted[0]} features and {wanted[1]} outputs"
        raise BadInput("policy", str(path), mend)
    return network
