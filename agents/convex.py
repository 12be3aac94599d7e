"""Stations and sizes by mixed-integer linear programming on one barrier-free ensemble.

The cheapest layouts are sought that keep the CVaR of what passes below a ladder of limits, see
`agents.programme`, as a catalogue of barriers estimates it, see `agents.catalogue`: for both bounds
of what a barrier holds. The estimate does not know what a barrier does to the flow further down, so
the simulation has the last word, and the engineering rule's barrier is tried beside the optima.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from agents.catalogue import tabulate
from agents.crossings import Ensemble, ensemble_for
from agents.programme import Choice, choose
from agents.protocol import DesignResult, Ledger, Progress, Proposals, search
from agents.rule import kind_for, rule
from agents.store import Store
from envs import DesignProblem
from rigdda import Layout

LADDER = (0.8, 0.5, 0.3, 0.15, 0.05)
"""Limits of CVaR, as shares of that without barriers."""


@dataclass(frozen=True, slots=True)
class ConvexResult(DesignResult):
    """The layout that does best in simulation, and all optima that were simulated.

    Parameters
    ----------
    choices : tuple of Choice
        Optima of the programme, each with the bound of its relaxation, the loosest limit first.
    """

    choices: tuple[Choice, ...]


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> ConvexResult:
    """Return the programme's layout that does best in simulation.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2, the seed out of range or neither fences nor walls are among the
        kinds; if a simulation diverges.
    """
    kind = kind_for(problem)
    ledger = Ledger(problem, simulations, seed, progress, store)
    ensemble = ensemble_for(ledger)
    choices = optima(problem, ensemble)
    layouts = [*(choice.layout for choice in choices), rule(problem.site, ensemble, kind)]
    found = search(ledger, _propose(layouts))
    best = (found.layout, found.evaluation, found.history, found.simulations)
    return ConvexResult(*best, choices=choices)


def _propose(layouts: list[Layout]) -> Proposals:
    """Yield the layouts and, so that the result is never worse, no barrier."""
    for layout in dict.fromkeys([*layouts, ()]):  # noqa: UP028, a list cannot be sent values
        yield layout


def optima(problem: DesignProblem, ensemble: Ensemble) -> tuple[Choice, ...]:
    """Return the optima of different layouts over both bounds and the ladder."""
    if not {"fence", "wall"} & set(problem.kinds):
        return ()
    catalogues = [tabulate(problem, ensemble, locked) for locked in (True, False)]
    found: dict[Layout, Choice] = {}
    for limit, catalogue in product(LADDER, catalogues):
        choice = choose(catalogue, problem.max_barriers, limit)
        if choice is not None:
            found.setdefault(choice.layout, choice)
    return tuple(found.values())
