"""Barriers by mixed-integer linear programming on one barrier-free ensemble.

The best choices of one, two and three barriers are sought, see `rigdda.agents.programme`, as a
catalogue estimates them, see `rigdda.agents.catalogue`. The estimate does not know what a barrier
does to the flow further down, so the simulation has the last word, and the engineering rule's
barrier is tried beside the optima.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rigdda import Layout
from rigdda.agents.catalogue import Catalogue, whole
from rigdda.agents.crossings import Ensemble, ensemble_for
from rigdda.agents.menu import Menu
from rigdda.agents.programme import Choice, choose
from rigdda.agents.protocol import DesignResult, Ledger, Progress, Proposals
from rigdda.agents.rule import rule
from rigdda.agents.searching import search
from rigdda.agents.store import Store
from rigdda.envs import DesignProblem

CAREFUL = (1.0, 0.8, 0.5)
"""Shares of the estimated reliefs that count."""
TABLE = 120
"""Barriers of the catalogue that the programme chooses from: the best of every kind at every place,
by what they are worth alone."""


@dataclass(frozen=True, slots=True)
class ConvexResult(DesignResult):
    """The layout that does best in simulation, and all optima that were simulated.

    Parameters
    ----------
    choices : tuple of Choice
        Optima of the programme, each with the bound of its relaxation.
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
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger, menu = Ledger(problem, simulations, seed, progress, store), Menu(problem)
    ensemble = ensemble_for(ledger, menu.stations)
    choices = optima(problem, ensemble, menu)
    layouts = [*(choice.layout for choice in choices), rule(problem, ensemble, menu)]
    ledger.starts |= set(layouts)
    found = search(ledger, _propose(layouts))
    own = {name: getattr(found, name) for name in DesignResult.__dataclass_fields__}
    return ConvexResult(**own, choices=choices)


def _propose(layouts: list[Layout]) -> Proposals:
    """Yield the layouts and, so that the result is never worse, no barrier."""
    for layout in dict.fromkeys([*layouts, ()]):  # noqa: UP028, a list cannot be sent values
        yield layout


def optima(problem: DesignProblem, ensemble: Ensemble, menu: Menu) -> tuple[Choice, ...]:
    """Return the optima of different layouts, of few barriers first."""
    catalogue = promising(whole(problem, ensemble, menu))
    found: dict[Layout, Choice] = {}
    for slots, share in _ladder(problem):
        choice = choose(catalogue, slots, share)
        if problem.fits(choice.layout):
            found.setdefault(choice.layout, choice)
    return tuple(found.values())


def _ladder(problem: DesignProblem) -> Iterator[tuple[int, float]]:
    """Yield how many barriers may be built and what share of reliefs counts."""
    for slots in range(1, min(problem.max_barriers, 3) + 1):
        for share in CAREFUL:
            yield slots, share


def promising(catalogue: Catalogue) -> Catalogue:
    """Return the barriers of a catalogue that come into question.

    Of every kind, the best at every station, as many of the best of these as of another kind.
    """
    best: dict[tuple[str, float], int] = {}
    order = np.argsort(catalogue.objective, kind="stable").tolist()
    for j in order:
        barrier = catalogue.barriers[j]
        best.setdefault((barrier.kind, 0.0 if barrier.kind == "mesh" else barrier.x), j)
    kinds: dict[str, list[int]] = {}
    for (kind, _), j in best.items():
        kinds.setdefault(kind, []).append(j)
    each = TABLE // max(1, len(kinds))
    chosen = [j for group in kinds.values() for j in group[:each]]
    return catalogue.take(sorted(chosen))
