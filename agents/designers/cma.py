"""CMA-ES (Hansen 2016, arXiv:1604.00772; pycma) on the decision vector, ask and tell.

It starts from the best in simulation of what one barrier-free ensemble suggests, see
`rigdda.agents.designers.convex`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda import Layout
from rigdda.agents.designers.convex import starts
from rigdda.agents.designers.protocol import (
    DesignResult,
    Ledger,
    Progress,
    Proposals,
    search,
    value,
)
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem
from rigdda.envs.encoding import NUMBERS, slot_size

Floats = NDArray[np.float64]

SIGMA = 0.25
"""Step at the start, an eighth of the decision box: stations are searched across a bench."""
POPULATION = 8
"""Layouts a generation: few, for budgets of a hundred layouts."""
VERGE, PRESENT = -0.25, 0.5
"""Presence of an empty slot and of a built one at the start: a barrier more or less is tried."""


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best layout that CMA-ES finds within the budget.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    return search(ledger, _propose(problem, starts(ledger), np.random.default_rng(seed)))


def _propose(problem: DesignProblem, first: list[Layout], rng: np.random.Generator) -> Proposals:
    """Yield the starts, then the generations of CMA-ES around the best; restart when it stops."""
    import cma

    best: tuple[float, Layout] = (math.inf, ())
    for layout in first:
        found = value(problem, (yield layout))
        best = min(best, (found, layout), key=lambda pair: pair[0])
    low, high = problem.bounds
    options = {
        "bounds": [low.tolist(), high.tolist()],
        "popsize": POPULATION,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": math.nan,  # numpy's global generator is left alone
        "verbose": -10,  # quiet, no files read or written
        "verb_log": 0,
    }
    while True:
        centre = _centre(problem, best[1], rng)
        strategy = cma.CMAEvolutionStrategy(centre, SIGMA, options)
        while not strategy.stop():
            vectors, values = strategy.ask(), []
            for vector in vectors:
                layout = problem.decode(vector)
                values.append(value(problem, (yield layout)))
                best = min(best, (values[-1], layout), key=lambda pair: pair[0])
            strategy.tell(vectors, values)


def _centre(problem: DesignProblem, layout: Layout, rng: np.random.Generator) -> Floats:
    """Return the vector of a layout, (size,), its empty slots on the verge of a barrier.

    Their stations, sizes and kinds are drawn at random, so that every restart tries others.
    """
    vector = problem.encode(layout)
    slots = vector.reshape(-1, slot_size(problem.kinds))
    empty = slots[len(layout) :]
    empty[:, 0] = VERGE
    empty[:, 1:] = rng.uniform(-1.0, 1.0, empty[:, 1:].shape)
    slots[: len(layout), 0] = PRESENT
    slots[:, NUMBERS:] *= 0.5  # scores of kinds: another may win
    return vector
