"""The layout with the least forecast Z, without a simulation of any layout.

The forecast uses releases without barriers only, see `rigdda.agents.designers.forecast`.
"""

from __future__ import annotations

from rigdda.agents.designers.convex import unsearched
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress
from rigdda.agents.designers.race import forecast_pool
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem

REPORT_RELEASES = 64
"""Largest number of releases on which the layout is evaluated."""


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the layout with the least forecast Z among single barriers and pairs.

    At most a sixteenth of the budget is used for releases without barriers, and up to 64 releases
    for the evaluation of the layout.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger, menu = Ledger(problem, simulations, seed, progress, store), Menu(problem)
    surrogate = forecast_pool(ledger, menu, unsearched(problem, menu))
    best = surrogate.best(1)
    forecast = surrogate.value()[surrogate.place[best[0]]] if best else surrogate.bare
    layout = best[0] if best and (forecast < surrogate.bare or surrogate.has_targets) else ()
    found = ledger.evaluate(layout, "report", min(REPORT_RELEASES, ledger.left))
    return ledger.result(found, "start")
