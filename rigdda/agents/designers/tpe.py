"""Tree-structured Parzen estimator (Bergstra et al. 2011, NeurIPS 24; Optuna).

The decision vector is passed to Optuna as numbers in [-1, 1] and, if there are several kinds of
barrier, a categorical choice. The first layouts are those that an ensemble of releases without
barriers suggests (see `rigdda.agents.designers.convex.starts`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution

NAMES = ("presence", "station", "height", "size")
"""Numbers of a slot, as in `rigdda.envs.encoding`."""


def decision_space(problem: DesignProblem) -> dict[str, BaseDistribution]:
    """Return the distributions of the parameters by name; names end with the number of the slot."""
    from optuna.distributions import CategoricalDistribution, FloatDistribution

    out: dict[str, BaseDistribution] = {}
    for i in range(problem.max_barriers):
        out |= {f"{name} {i}": FloatDistribution(-1.0, 1.0) for name in NAMES}
        if len(problem.kinds) > 1:
            out[f"kind {i}"] = CategoricalDistribution(problem.kinds)
    return out


def vector(problem: DesignProblem, parameters: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the decision vector (size,) for the given parameters."""
    slots = np.full((problem.max_barriers, slot_size(problem.kinds)), -1.0)
    for i, slot in enumerate(slots):
        slot[:SLOT_NUMBERS] = [parameters[f"{name} {i}"] for name in NAMES]
        if len(problem.kinds) > 1:
            slot[SLOT_NUMBERS + problem.kinds.index(parameters[f"kind {i}"])] = 1.0
    return slots.ravel()


def parameters(problem: DesignProblem, layout: Layout) -> dict[str, Any]:
    """Return the parameters of a layout; `vector` and `decode` are the inverse."""
    out: dict[str, Any] = {}
    slots = problem.encode(layout).reshape(problem.max_barriers, -1)
    for i, slot in enumerate(slots):
        out |= {f"{name} {i}": float(slot[j]) for j, name in enumerate(NAMES)}
        if len(problem.kinds) > 1:
            out[f"kind {i}"] = problem.kinds[int(np.argmax(slot[SLOT_NUMBERS:]))]
    return out


DRAWN = 10
"""Number of layouts, including the starting layouts, before the estimator is used: the default of
Optuna."""


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best layout that the estimator finds within the budget.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    return search(ledger, _propose(problem, starts(ledger), ledger.seed))


def _propose(problem: DesignProblem, first: list[Layout], seed: int) -> Proposals:
    """Yield the starting layouts, then an endless sequence of samples of the estimator."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    sampler = optuna.samplers.TPESampler(n_startup_trials=DRAWN, multivariate=True, seed=seed)
    study = optuna.create_study(sampler=sampler)
    for layout in first:
        study.enqueue_trial(parameters(problem, layout))
    space = decision_space(problem)
    while True:
        trial = study.ask(space)
        evaluation = yield problem.decode(vector(problem, trial.params))
        study.tell(trial, value(problem, evaluation))
