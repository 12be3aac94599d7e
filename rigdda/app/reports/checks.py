"""Tables of the checks of barriers and of what the engineering rule demands along a slope."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigdda.agents.designers import rule
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.rule import RuleAnswer
from rigdda.app.barrier_checks import BarrierCheck, LayoutChecks
from rigdda.app.design_study import DesignStudy
from rigdda.app.reports import demand_picture
from rigdda.app.reports.tables import empty_table, write_rows
from rigdda.envs import DesignProblem
from rigdda.envs.design_envelope import DesignEnvelope
from rigdda.envs.fence_checks import FenceCheck, demands

if TYPE_CHECKING:
    from rich.table import Table

FILES = ("checks.csv", "design_sheet.csv", "demand.csv", "demand.png")
"""Files of the checks."""

FOUND = "layout found"
"""Name of the layout of a designer in the design sheets."""


def write(done: DesignStudy, out: Path) -> None:
    """Write the checks of the layout found, the design sheets and the demand along the slope."""
    rows = [_row(check) for check in done.checks.table]
    write_rows(out / "checks.csv", rows, COLUMNS)
    write_rows(out / "design_sheet.csv", [*sheets(done.rule, done.checks)], SHEET)
    along = [*along_slope(done.problem, done.rule.envelope)]
    write_rows(out / "demand.csv", along, ALONG)
    layouts = {done.rule.name: done.rule.layout, done.chosen.name: done.chosen.evaluation.layout}
    demand_picture.write(out / "demand.png", done.problem, along, layouts)


COLUMNS = (
    "barrier", "x_m", "check", "demand", "capacity", "unit", "use", "limit", "satisfied", "note",
)  # fmt: skip
"""Columns of the table of checks."""


def _row(check: BarrierCheck) -> dict[str, Any]:
    """Return a check as a row of a CSV file."""
    return {
        "barrier": check.barrier,
        "x_m": check.x,
        "check": check.check,
        "demand": check.demand,
        "capacity": check.capacity,
        "unit": check.unit,
        "use": check.use,
        "limit": check.limit,
        "satisfied": check.satisfied,
        "note": check.note,
    }


SHEET = ("layout", "fence", "quantity", "symbol", "value", "unit", "basis")
"""Columns of the design sheets."""


def sheets(answer: RuleAnswer, checks: LayoutChecks) -> Iterator[dict[str, Any]]:
    """Yield the rows of the design sheets of the rule's fence and of the fences of a layout."""
    own = [] if answer.check is None else [answer.check]
    name = answer.name if answer.name == rule.NAME else "nearest to the rule"
    for layout, found in ((name, own), (FOUND, checks.fences)):
        for check in found:
            yield from _sheet(layout, check)


def _sheet(layout: str, check: FenceCheck) -> Iterator[dict[str, Any]]:
    """Yield the rows of the design sheet of a fence."""
    for row in check.rows():
        yield {"layout": layout, "fence": check.fence.label} | row._asdict()


ALONG = (
    "x_m", "covered", "event_energy", "passing", "velocity_m_s", "velocity_low_m_s",
    "velocity_high_m_s", "design_energy_kJ", "demanded_energy_kJ", "demanded_class_kJ",
    "event_height", "height_m", "height_low_m", "height_high_m", "needed_height_m",
    "classes_that_fit_kJ",
)  # fmt: skip
"""Columns of the table of the demand along the slope."""


def along_slope(problem: DesignProblem, envelope: DesignEnvelope) -> Iterator[dict[str, Any]]:
    """Yield the rows of the demand along the slope.

    `classes_that_fit_kJ` lists the classes of fences that satisfy the rule at the station, also in
    height and elongation, and may be built there.
    """
    menu, factors = Menu(problem), problem.site.rule
    for demand in demands(envelope, factors):
        hard, high = demand.hard, demand.high
        fit = [fence.rated for fence in rule.fences(menu, demand)]
        fit = fit if demand.covered >= rule.COVERED else []
        yield {
            "x_m": demand.x,
            "covered": demand.covered,
            "event_energy": hard.event.name,
            "passing": round(hard.passing),
            "velocity_m_s": hard.speed.value,
            "velocity_low_m_s": hard.speed.low,
            "velocity_high_m_s": hard.speed.high,
            "design_energy_kJ": 1e-3 * hard.energy(),
            "demanded_energy_kJ": hard.energy() * factors.energy / factors.rated(1),
            "demanded_class_kJ": demand.least_class or "none",
            "event_height": high.event.name,
            "height_m": high.height.value,
            "height_low_m": high.height.low,
            "height_high_m": high.height.high,
            "needed_height_m": high.needed_height(),
            "classes_that_fit_kJ": " ".join(
                map(str, fit if demand.covered >= rule.COVERED else [])
            ),
        }


def rule_words(answer: RuleAnswer) -> str:
    """Return in words what the rule asks for, or what stands in its place and why."""
    caveat = f"; {answer.caveat}" if answer.caveat else ""
    if answer.name == rule.NAME and answer.check is not None:
        check = answer.check
        uses = ", ".join(f"{name} {_figure(use)}" for name, use in check.uses.items())
        place = f"{check.fence.label}, at {check.fence.x:.1f} m"
        return f"rule (UNI 11211-4): {place}; utilisation: {uses}{caveat}"
    stands = "" if not answer.layout else f"; shown instead: {answer.layout[0].label}"
    return f"the rule (UNI 11211-4) gives no fence: {answer.reason}{caveat}{stands}"


def table(checks: LayoutChecks) -> Table:
    """Return the table of checks, at most 80 characters wide."""
    out = empty_table(("barrier", "demand", "capacity", "unit", "use", "at most", ""))
    last = ""
    for check in checks.table:
        head = f"{check.barrier}, at {check.x:.1f} m"
        if head != last:
            out.add_row(head)
            last = head
        cells = map(_figure, (check.demand, check.capacity))
        met = "" if check.satisfied else "NOT MET"
        out.add_row(
            f"  {check.check}", *cells, check.unit, _figure(check.use), _figure(check.limit), met
        )
    return out


def _figure(value: float) -> str:
    """Return a number with three figures, or in whole from 100."""
    if not math.isfinite(value):
        return "inf"
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def notes(checks: LayoutChecks) -> Iterator[str]:
    """Yield lines on checks that are not met and on barriers that nothing reaches."""
    for check in checks.table:
        if not check.satisfied:
            yield f"not met: {check.barrier}, {check.check}: {check.note}"
    for barrier in checks.idle:
        yield f"no block of the design events reaches the {barrier}"
