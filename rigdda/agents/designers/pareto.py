"""Pareto front of the cost of barriers against the remaining risk by NSGA-II.

The algorithm is that of Deb et al. (2002, IEEE TEC 6, 182-197), as implemented in Optuna.

The search starts from the layouts that an ensemble of releases without barriers suggests (see
`rigdda.agents.designers.convex`). Layouts that are non-dominated in the search are evaluated again
on other releases. Those that are non-dominated in these releases form the front. Thus no layout is
in the front because of favourable releases in the search.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rigdda import Layout
from rigdda.agents.designers import tpe
from rigdda.agents.designers.convex import starts
from rigdda.agents.designers.protocol import (
    DesignResult,
    Ledger,
    Progress,
    Proposals,
    score,
    search,
)
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem, Evaluation

FINALISTS = 12
"""Largest number of layouts of the front of the search that are evaluated again."""
POPULATION = 16
"""Layouts per generation."""


@dataclass(frozen=True, slots=True)
class ParetoResult(DesignResult):
    """Result of the search: the layout with the least objective and the Pareto front.

    Parameters
    ----------
    front : tuple of Evaluation
        Evaluations of the non-dominated layouts, the cheapest first, on releases that the search
        did not use. If the budget is too small for finals (see `protocol.Plan`), the evaluations of
        the search are used; then some layouts may be in the front by chance.
    """

    front: tuple[Evaluation, ...]


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> ParetoResult:
    """Return the layout with the least objective and the front that NSGA-II finds in the budget.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    found = search(ledger, _propose(problem, starts(ledger), seed), finalists, FINALISTS)
    ends = found.history.stage("final") or found.history.stage("search")
    own = {name: getattr(found, name) for name in DesignResult.__dataclass_fields__}
    return ParetoResult(**own, front=front(entry.evaluation for entry in ends))


def residual(evaluation: Evaluation) -> float:
    """Return the sum of harm and repair, which is Z without capital [EUR per m and year]."""
    return evaluation.harm + evaluation.repair


def front(evaluations: Iterable[Evaluation]) -> tuple[Evaluation, ...]:
    """Return the non-dominated evaluations, the cheapest first."""
    kept: list[Evaluation] = []
    for e in sorted(evaluations, key=lambda e: (e.capital, residual(e))):
        if not kept or residual(e) < residual(kept[-1]):
            kept.append(e)
    return tuple(kept)


def finalists(
    problem: DesignProblem, evaluations: Sequence[Evaluation], n: int
) -> list[Evaluation]:
    """Return at most `n` finalists: the best of the front, then others spread evenly over it."""
    found = front(evaluations)
    best = min(range(len(found)), key=lambda i: score(problem, found[i]))
    others = [i for i in range(len(found)) if i != best]
    if len(found) > n:
        spread = np.linspace(0, len(found) - 1, max(0, n - 1)).round().astype(int).tolist()
        others = [i for i in spread if i != best]
    return [found[i] for i in [best, *others][:n]]


def _propose(problem: DesignProblem, first: list[Layout], seed: int) -> Proposals:
    """Yield the starting layouts, then an endless sequence of generations of NSGA-II."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    sampler = optuna.samplers.NSGAIISampler(population_size=POPULATION, seed=seed)
    study = optuna.create_study(directions=["minimize", "minimize"], sampler=sampler)
    for layout in first:
        study.enqueue_trial(tpe.parameters(problem, layout))
    space = tpe.decision_space(problem)
    while True:
        trial = study.ask(space)
        evaluation = yield problem.decode(tpe.vector(problem, trial.params))
        study.tell(trial, (evaluation.capital, residual(evaluation)))
