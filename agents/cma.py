"""CMA-ES (Hansen 2016, arXiv:1604.00772; pycma) on the decision vector, ask and tell.

It starts from the best in simulation of what one barrier-free ensemble suggests: the engineering
rule, the optima of `convex`, and no barrier at all.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agents import convex
from agents.crossings import ensemble_for
from agents.protocol import DesignResult, Ledger, Progress, Proposals, search
from agents.rule import rule
from agents.store import Store
from envs import DesignProblem
from envs.encoding import MIN_HEIGHT, NUMBERS
from rigdda import Layout

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
        If the budget is below 2 or the seed below 0; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    ensemble = ensemble_for(ledger)
    starts = [*convex.candidates(problem, ensemble), rule(problem.site, ensemble), ()]
    proposals = _propose(problem, list(dict.fromkeys(starts)), np.random.default_rng(seed))
    return search(ledger, proposals)


def _propose(problem: DesignProblem, starts: list[Layout], rng: np.random.Generator) -> Proposals:
    """Yield the starts, then the generations of CMA-ES around the best; restart when it stops."""
    import cma

    best: tuple[float, Layout] = (math.inf, ())
    for layout in starts:
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
    """Return the vector of a layout, (3 max_barriers,), its empty slots on the verge of a wall.

    Their stations are drawn at random, so that every restart tries walls in other places.
    """
    vector = problem.encode(layout)
    empty = vector.reshape(-1, NUMBERS)[len(layout) :]
    verge = 2.0 * MIN_HEIGHT / problem.site.barrier_zone.max_height - 1.0
    empty[:, 0] = rng.uniform(-1.0, 1.0, len(empty))
    empty[:, 1:] = max(-1.0, verge - 0.02), -1.0
    return vector
