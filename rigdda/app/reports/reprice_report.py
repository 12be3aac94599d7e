"""Files and texts of `rigdda reprice`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import rigdda
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.app import value_origins
from rigdda.app.design_study import SHED
from rigdda.app.reports import design_report, findings, pictures
from rigdda.app.reports.tables import known_risks, write_risks, write_rows
from rigdda.app.reports.wording import before, number, order
from rigdda.app.reprice import BEST_OF_SEARCH, Change, Repriced
from rigdda.envs import Evaluation
from rigdda.envs.problem import can_fail

REPRICE_FILES = ("costs.csv", "site.toml", "layout.toml", "cost.png")


def write(done: Repriced, folder: Path) -> None:
    """Write the table, the site with its new values, the best layout and the pictures."""
    write_rows(folder / "costs.csv", rows(done))
    write_risks(folder, known_risks(done))
    value_origins.save(done.problem.site, folder / "site.toml", done.placeholders)
    rigdda.save_layout(done.chosen.evaluation.layout, folder / "layout.toml")
    points = [pictures.Point.of(case.name, case.evaluation) for case in done.cases]
    shed = pictures.Point(SHED, done.problem.site.shed(), 0.0, (0.0, 0.0))
    pictures.cost_against_risk(folder / "cost.png", [], [*points, shed])
    design_report.write_frontier(folder, done.problem, done.frontier)


def rows(done: Repriced) -> list[dict[str, Any]]:
    """Return one row for each layout; Z and its parts in EUR per metre of road and year.

    The share of the debris is that of the debris without the layout on the same releases [-].
    Probabilities are those of the design event with the largest upper bound. That of a failure is
    empty if no barrier can fail.
    """
    return [_row(done, case.name, case.evaluation) for case in done.cases]


def _row(done: Repriced, name: str, e: Evaluation) -> dict[str, Any]:
    whole = done.nothing.evaluation.debris
    row: dict[str, Any] = {
        "layout": name,
        "objective": e.objective,
        "objective_low": e.ci[0],
        "objective_high": e.ci[1],
        "capital": e.capital,
        "harm": e.harm,
        "repair": e.repair,
        "cost": e.cost,
        "debris_share": e.debris / whole if whole else math.nan,
        "targets": e.targets or "",
        "releases": e.releases,
        "verified": name != BEST_OF_SEARCH or done.verified,
        "meets_checks": not done.failed[name],
    }
    site = done.problem.site
    fallible = can_fail(site, e.layout)
    if any(event.design for event in site.events):
        one = TriedLayout.of(site, e)
        row |= {
            "reach": one.reach.probability,
            "reach_bound": one.level,
            "failure": one.failure.probability if fallible else math.nan,
            "failure_bound": one.failure.bound if fallible else math.nan,
        }
    return row


def changed(change: Change) -> str:
    """Return a change in words."""
    before = "default" if change.before is None else number(change.before)
    after = " ".join(filter(None, (number(change.after), change.unit)))
    return f"{change.path} = {after} (was {before})"


def answer(done: Repriced) -> findings.DesignAnswer:
    """Return what the first line of the answer needs."""
    site, chosen, nothing = done.problem.site, done.chosen.evaluation, done.nothing.evaluation
    return findings.DesignAnswer(
        layout="; ".join(order(barrier, site) for barrier in chosen.layout),
        bare=before(site),
        z=(chosen.objective, *chosen.ci),
        nothing=(nothing.objective, *nothing.ci),
        targets=chosen.targets,
        asked=findings.asked_words(done.problem.targets),
        required=done.required,
        failed=findings.in_words(done.failed[BEST_OF_SEARCH]),
        reaching=findings.reaching(chosen, site),
        verified=done.verified,
        cap=done.problem.max_cost,
        bare_targets=nothing.targets,
    )


def sentences(done: Repriced) -> list[str]:
    """Return what the answer says beyond its numbers."""
    cases = [(case.name, case.evaluation) for case in done.cases]
    found, chosen = done.cases[-2].evaluation, done.chosen.evaluation
    among = f"the choice among {done.tried:,} layouts that were evaluated"
    if chosen.layout == found.layout:
        line = f"the layout of the design, {done.cases[-2].name!r}, remains {among}"
    elif done.verified:
        line = f"{BEST_OF_SEARCH!r} is {among}; the design verified it"
    else:
        line = f"{BEST_OF_SEARCH!r} is {among}, but was not verified: Z is the mean of the "
        line += f"{chosen.releases:,} releases of the search by which it was chosen, and probably "
        line += "too low; the command rigdda design with site.toml searches and verifies again"
    lines = [line]
    if failed := done.failed[BEST_OF_SEARCH]:
        words = findings.failed_words(findings.in_words(failed))
        lines.append(f"{BEST_OF_SEARCH!r} fails its checks: {words}")
    lines += findings.over_the_cap(done.problem, cases)
    comparable = [(case.name, case.evaluation) for case in done.comparable]
    failing = [name for name, _ in cases[:-1] if done.failed[name]]
    if done.required:
        lines += findings.compared_only(failing)
    elif failing:
        lines.append(f"these layouts fail a check: {', '.join(map(repr, failing))}")
    lines.append(findings.no_layout_pays(done.problem.site, comparable))
    lines += findings.unreleased(done.problem.site, chosen)
    lines += findings.failing(done.problem.site, chosen)
    lines.append(findings.undecided(done.problem, chosen, "a new design with a larger --verify"))
    lines.append(findings.left_over(chosen))
    return [line for line in lines if line]
