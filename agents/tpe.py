"""Tree-structured Parzen estimator (Bergstra et al. 2011, NeurIPS 24; Optuna), ask and tell.

It is told first what one barrier-free ensemble suggests, see `rigdda.agents.starts`.
"""

from __future__ import annotations

from rigdda import Layout
from rigdda.agents import trials
from rigdda.agents.protocol import DesignResult, Ledger, Progress, Proposals
from rigdda.agents.ranking import value
from rigdda.agents.searching import search
from rigdda.agents.starts import starts
from rigdda.agents.store import Store
from rigdda.envs import DesignProblem

DRAWN = 10
"""Layouts, the starts among them, before the estimator is trusted: Optuna's default."""


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
    """Yield the starts, then what the estimator samples, without end."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    sampler = optuna.samplers.TPESampler(n_startup_trials=DRAWN, multivariate=True, seed=seed)
    study = optuna.create_study(sampler=sampler)
    for layout in first:
        study.enqueue_trial(trials.parameters(problem, layout))
    space = trials.space(problem)
    while True:
        trial = study.ask(space)
        evaluation = yield problem.decode(trials.vector(problem, trial.params))
        study.tell(trial, value(problem, evaluation))
