"""The front of what barriers cost against what is left, by NSGA-II.

Deb et al. (2002, IEEE TEC 6, 182-197), as Optuna has it.

It starts from what one barrier-free ensemble suggests, see `rigdda.agents.designers.convex`, or
from layouts that other designers found. What nothing dominates in the search is evaluated again on
other releases, and what nothing dominates there is the front: so no layout is in it because it was
lucky in the search.
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
"""Layouts of the search's front that are evaluated again, at most."""
POPULATION = 16
"""Layouts a generation."""


@dataclass(frozen=True, slots=True)
class ParetoResult(DesignResult):
    """What the search found: the layout of least objective, and the front it was chosen from.

    Parameters
    ----------
    front : tuple of Evaluation
        Layouts of which none is both cheaper and safer than another, the cheapest first, evaluated
        on releases that the search did not see; by the search's own with a budget that does not pay
        for finals, see `searching.Plan`: then some are in it by luck.
    """

    front: tuple[Evaluation, ...]


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> ParetoResult:
    """Return the layout of least objective and the front that NSGA-II finds within the budget.

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
    """Return the same from layouts that other designers found, instead of an ensemble.

    They are evaluated again on other releases whatever the few of the search say of them.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if there are no layouts, or half as many
        as `FINALISTS` or more; if a simulation diverges.
    """
    different = list(dict.fromkeys(layouts))
    check.integer("number of different layouts", len(different), 1, FINALISTS // 2 - 1)
    ledger = Ledger(problem, simulations, seed, progress, store)
    ledger.starts |= set(different)
    return _search(ledger, different, len(different))


def _search(ledger: Ledger, first: list[Layout], known: int) -> ParetoResult:
    """Return what the search from some layouts finds, of which the first few are in the finals."""
    choose = partial(finalists, known=known)
    found = search(ledger, _propose(ledger.problem, first, ledger.seed), choose, FINALISTS)
    ends = found.history.stage("final") or found.history.stage("search")
    own = {name: getattr(found, name) for name in DesignResult.__dataclass_fields__}
    return ParetoResult(**own, front=front(entry.evaluation for entry in ends))


def residual(evaluation: Evaluation) -> float:
    """Return harm and repair, what Z has beside the cost of barriers [EUR per m and year]."""
    return evaluation.harm + evaluation.repair


def front(evaluations: Iterable[Evaluation]) -> tuple[Evaluation, ...]:
    """Return those of which none other is as cheap and as safe, the cheapest first."""
    kept: list[Evaluation] = []
    for e in sorted(evaluations, key=lambda e: (e.capital, residual(e))):
        if not kept or residual(e) < residual(kept[-1]):
            kept.append(e)
    return tuple(kept)


def finalists(
    problem: DesignProblem, evaluations: Sequence[Evaluation], n: int, known: int = 0
) -> list[Evaluation]:
    """Return at most `n`: the first `known`, of the front the best objective and an even spread."""
    kept = list(evaluations[: min(known, n)])
    seen, room = {e.layout for e in kept}, n - len(kept)
    found = [e for e in front(evaluations) if e.layout not in seen]
    if len(found) > room:
        best = min(range(len(found)), key=lambda i: score(problem, found[i]))
        spread = np.linspace(0, len(found) - 1, max(0, room - 1)).round().astype(int).tolist()
        found = [found[i] for i in sorted({best, *spread})[:room]]
    return kept + found


def _propose(problem: DesignProblem, first: list[Layout], seed: int) -> Proposals:
    """Yield the starts, then the generations of NSGA-II, without end."""
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
