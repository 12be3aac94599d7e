"""The tables of a design: what each layout costs a year, and its chances in design events."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rigdda.agents.findings import design_events
from rigdda.agents.job import SHED, Study
from rigdda.agents.tables import empty_table
from rigdda.agents.wording import euros, percent, span
from rigdda.envs.intervals import Estimate

if TYPE_CHECKING:
    from rich.table import Table


def costs(study: Study) -> Table:
    """Return the table of what each layout costs, at most 80 characters wide.

    Money is in EUR per metre of road and year, but for the last column but one: EUR per metre.
    Debris is what comes onto the road, of what comes without barriers.
    """
    head = ("layout", "Z (95 %)", "capital", "harm", "repair", "to build", "debris")
    table = empty_table(head)
    whole = study.nothing.evaluation.debris
    for case in study.cases:
        e = case.evaluation
        table.add_row(
            case.name,
            f"{euros(e.objective)} ({span(e.ci)})",
            euros(e.capital),
            euros(e.harm),
            euros(e.repair),
            euros(e.cost),
            percent(e.debris / whole) if whole else "-",
        )
    site = study.problem.site
    annual = euros(site.shed())
    table.add_row(SHED, annual, annual, "0", "0", euros(site.prices.shed), "0 %")
    return table


def chances(study: Study) -> Table | None:
    """Return the table of what may happen in each design event; None if the site has none.

    Each probability with its one-sided 95 % upper bound.
    """
    events = design_events(study.problem.site)
    if not events:
        return None
    table = empty_table(("design event", "layout", "reaches road", "barrier fails", "of"))
    for event in events:
        for i, case in enumerate(study.cases):
            e = case.evaluation
            reach = e.reach[event]
            fails = _chance(e.failure[event]) if e.layout else "-"
            name = "" if i else event
            table.add_row(name, case.name, _chance(reach), fails, f"{reach.releases:,}")
        table.add_section()
    return table


def _chance(estimate: Estimate) -> str:
    """Return a probability with its upper bound in words."""
    if not estimate.releases:
        return "-"
    return f"{percent(estimate.probability)} (<= {percent(estimate.bound)})"
