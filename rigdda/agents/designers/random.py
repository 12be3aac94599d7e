"""Random search with layouts drawn uniformly from the decision box, a baseline for all searches."""

from __future__ import annotations

import numpy as np

from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress, Proposals, search
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best of as many random layouts as the budget allows.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    return search(ledger, _propose(problem, np.random.default_rng(seed)))


def _propose(problem: DesignProblem, rng: np.random.Generator) -> Proposals:
    """Yield an endless sequence of random layouts."""
    low, high = problem.bounds
    while True:
        yield problem.decode(rng.uniform(low, high))
