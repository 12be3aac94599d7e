"""CMA-ES (Hansen 2016, arXiv:1604.00772; pycma) on the decision vector, ask and tell.

It starts from the best in simulation of what one barrier-free ensemble suggests, see
`agents.starts`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agents.crossings import ensemble_for
from agents.policy import SHIPPED, decide, load
from agents.protocol import DesignResult, Ledger, Progress, Proposals, search
from agents.starts import starts
from agents.store import Store
from envs import DesignProblem
from envs.encoding import MIN_HEIGHT, slot_size
from envs.envelope import SEEDS
from rigdda import Layout, check

Floats = NDArray[np.float64]

SIGMA = 0.25
"""Step at the start, an eighth of the decision box: stations are searched across a bench."""
POPULATION = 6
"""Layouts a generation: few, for budgets of some tens of layouts."""


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
    first = starts(problem, ensemble_for(ledger))
    return search(ledger, _propose(problem, first, np.random.default_rng(seed)))


def warm_started(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best layout that CMA-ES finds from the shipped policy's, without an ensemble.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 6 or the seed out of range; if fences are not among the kinds;
        if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    check.integer("simulations", simulations, len(SEEDS) + 2)
    first = [decide(load(SHIPPED), problem), ()]
    ledger.used += len(SEEDS)
    return search(ledger, _propose(problem, first, np.random.default_rng(seed)))


def _propose(problem: DesignProblem, first: list[Layout], rng: np.random.Generator) -> Proposals:
    """Yield the starts, then the generations of CMA-ES around the best; restart when it stops."""
    import cma

    best: tuple[float, Layout] = (math.inf, ())
    for layout in first:
        best = min(best, ((yield layout).objective, layout), key=lambda pair: pair[0])
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
                values.append((yield layout).objective)
                best = min(best, (values[-1], layout), key=lambda pair: pair[0])
            strategy.tell(vectors, values)


def _centre(problem: DesignProblem, layout: Layout, rng: np.random.Generator) -> Floats:
    """Return the vector of a layout, (size,), its empty slots on the verge of a barrier.

    Their stations and kinds are drawn at random, so that every restart tries others.
    """
    vector = problem.encode(layout)
    empty = vector.reshape(-1, slot_size(problem.kinds))[len(layout) :]
    verge = 2.0 * MIN_HEIGHT / problem.site.barrier_zone.max_height - 1.0
    empty[:, 0] = rng.uniform(-1.0, 1.0, len(empty))
    empty[:, 1:3] = max(-1.0, verge - 0.02), -1.0
    empty[:, 3:] = rng.uniform(-1.0, 1.0, empty[:, 3:].shape)
    return vector
