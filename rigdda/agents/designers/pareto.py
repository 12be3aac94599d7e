"""Pareto front of the cost of barriers against the remaining risk by NSGA-II.

The algorithm is that of Deb et al. (2002, IEEE TEC 6, 182-197), as implemented in Optuna.

The search starts from the layouts that an ensemble of releases without barriers suggests (see
`rigdda.agents.designers.convex`) or from layouts that other designers found. Layouts that are
non-dominated in the search are evaluated again on other releases. Those that are non-dominated in
these releases form the front. Thus no layout is in the front because of favourable releases in the
search.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rigdda import Layout, check
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
    return _search(ledger, starts(ledger), 0)


def warm_started(
    problem: DesignProblem,
    layouts: Sequence[Layout],
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> ParetoResult:
    """Return the result of a search that starts from layouts which other designers found.

    These layouts are always evaluated again on other releases, whatever their evaluations in the
    search are.

    Raises
    ------
    BadInput
        If the budget is below 2, the seed is out of range, or the number of different layouts is
        not between 1 and `FINALISTS` / 2 - 1.
    Diverged
        If a simulation diverges.
    """
    different = list(dict.fromkeys(layouts))
    check.integer("number of different layouts", len(different), 1, FINALISTS // 2 - 1)
    ledger = Ledger(problem, simulations, seed, progress, store)
    ledger.starts |= set(different)
    return _search(ledger, different, len(different))


def _search(ledger: Ledger, first: list[Layout], known: int) -> ParetoResult:
    """Search from some starting layouts, of which the first `known` always reach the finals."""
    choose = partial(finalists, known=known)
    found = search(ledger, _propose(ledger.problem, first, ledger.seed), choose, FINALISTS)
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
    problem: DesignProblem, evaluations: Sequence[Evaluation], n: int, known: int = 0
) -> list[Evaluation]:
    """Return at most `n` finalists.

    These are the first `known` evaluations, the best of the front and others spread evenly over it.
    """
    kept = list(evaluations[: min(known, n)])
    seen, room = {e.layout for e in kept}, n - len(kept)
    found = [e for e in front(evaluations) if e.layout not in seen]
    if len(found) > room:
        best = min(range(len(found)), key=lambda i: score(problem, found[i]))
        spread = np.linspace(0, len(found) - 1, max(0, room - 1)).round().astype(int).tolist()
        found = [found[i] for i in sorted({best, *spread})[:room]]
    return kept + found


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
