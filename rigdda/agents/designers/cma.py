"""CMA-ES (Hansen 2016, arXiv:1604.00772; pycma) on the decision vector.

The search simulates the layouts that an ensemble of releases without barriers suggests (see
`rigdda.agents.designers.convex`) and starts from the best of them.
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
from rigdda.envs.encoding import SLOT_NUMBERS, slot_size

Floats = NDArray[np.float64]

SIGMA = 0.25
"""Initial standard deviation: an eighth of the decision box, about the width of a bench."""
POPULATION = 8
"""Layouts per generation; small, because a budget allows about a hundred layouts."""
VERGE, PRESENT = -0.25, 0.5
"""Initial presence of an empty slot and of a slot with a barrier. Both are near enough to 0 that
layouts with one barrier more or less are tried."""


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
    """Yield the starting layouts, then generations of CMA-ES, restarted when it converges."""
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
        "seed": math.nan,  # do not seed the global generator of numpy
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
    """Return the vector of a layout, (size,), with empty slots just below the limit of presence.

    Their stations, sizes and kinds are drawn at random, so that every restart tries other ones.
    """
    vector = problem.encode(layout)
    slots = vector.reshape(-1, slot_size(problem.kinds))
    empty = slots[len(layout) :]
    empty[:, 0] = VERGE
    empty[:, 1:] = rng.uniform(-1.0, 1.0, empty[:, 1:].shape)
    slots[: len(layout), 0] = PRESENT
    slots[:, SLOT_NUMBERS:] *= 0.5  # smaller scores, so that other kinds are tried as well
    return vector
