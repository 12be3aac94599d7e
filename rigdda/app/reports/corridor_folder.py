"""Tables, layouts and pictures of a corridor plan."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import rigdda
from rigdda.agents.corridor.planning import OPTIMUM, BudgetPlan, CorridorPlan
from rigdda.app.reports.pictures import DPI, EVENTS, FONT, save
from rigdda.app.reports.tables import empty_table, write_rows
from rigdda.app.reports.wording import euros, percent
from rigdda.barriers import KINDS
from rigdda.display import ROAD
from rigdda.rounding import Rounding

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.table import Table

FILES = ("budgets.csv", "sections.csv", "fronts.csv", "priorities.csv", "gain.png", "strip.png")
"""Files that `write` writes besides the folder `layouts`."""

PRIORITIES = (
    "budget", "priority", "section", "instead_of", "build", "additional_cost",
    "waiting_costs_per_year", "saving_per_euro",
)  # fmt: skip
"""Columns of priorities.csv, which has no row if no step is left undone."""

PER_ROW = 60
"""Largest number of sections in the strip that are labelled."""


def write(plan: CorridorPlan, out: Path) -> None:
    """Write all tables, layouts and pictures of a plan into a folder."""
    write_rows(out / "budgets.csv", budget_rows(plan))
    write_rows(out / "sections.csv", section_rows(plan))
    write_rows(out / "fronts.csv", front_rows(plan))
    write_rows(out / "priorities.csv", priority_rows(plan), PRIORITIES)
    for i, own in enumerate(plan.plans[:-1]):
        folder = out / "layouts" / f"budget-{i + 1}"
        folder.mkdir(parents=True, exist_ok=True)
        for s, evaluation in enumerate(own.evaluation.sections):
            rigdda.save_layout(evaluation.layout, folder / f"section-{s + 1}.toml")
    draw_gain(out / "gain.png", plan)
    draw_strip(out / "strip.png", plan)


def share(plan: CorridorPlan, gain: float) -> float:
    """Return a gain as a share of that of unlimited money [-], 0 if that is not positive."""
    whole = plan.unlimited.evaluation.gain
    return gain / whole if whole > 0.0 else 0.0


def budget_rows(plan: CorridorPlan) -> list[dict[str, Any]]:
    """Return one row for each budget and method [EUR, EUR/year]."""
    rows = []
    for own in plan.plans:
        limit = "unlimited" if own is plan.unlimited else own.budget
        for name, found in {OPTIMUM: own.evaluation, **own.methods}.items():
            ahead = plan.problem.ahead(own.evaluation, found)
            rows.append(
                {
                    "budget": limit,
                    "method": name,
                    "spent": found.cost,
                    "gain": found.gain,
                    "gain_low": found.gain_ci[0],
                    "gain_high": found.gain_ci[1],
                    "share_of_unlimited": share(plan, found.gain),
                    "behind": ahead.value,
                    "behind_low": ahead.low,
                    "behind_high": ahead.high,
                    "objective": found.objective,
                    "objective_low": found.ci[0],
                    "objective_high": found.ci[1],
                    "annual_cost_of_barriers": found.annual,
                    "sections_built": sum(bool(e.layout) for e in found.sections),
                    "shadow_price": own.shadow_price if name == OPTIMUM else "",
                }
            )
    return rows


def section_rows(plan: CorridorPlan) -> list[dict[str, Any]]:
    """Return one row for each section and budget."""
    rows = []
    for own in plan.plans:
        limit = "unlimited" if own is plan.unlimited else own.budget
        for s, evaluation in enumerate(own.evaluation.sections):
            section, problem = plan.problem.corridor.sections[s], plan.problem.problems[s]
            nothing = problem.nothing.objective
            rows.append(
                {
                    "budget": limit,
                    "section": section.name,
                    "length": section.length,
                    "layout": words(evaluation.layout),
                    "cost": section.length * evaluation.cost,
                    "gain": section.length * (nothing - evaluation.objective),
                    "Z": evaluation.objective,
                    "Z_low": evaluation.ci[0],
                    "Z_high": evaluation.ci[1],
                    "Z_without_barriers": nothing,
                    "targets_missed_by": own.missed[s],
                }
            )
    return rows


def front_rows(plan: CorridorPlan) -> list[dict[str, Any]]:
    """Return one row for each option of each section, per metre of road."""
    rows = []
    for section, options in zip(plan.problem.corridor.sections, plan.fronts, strict=True):
        for option in options:
            value = option.value()
            rows.append(
                {
                    "section": section.name,
                    "layout": words(option.layout),
                    "cost": option.cost,
                    "Z": value.value,
                    "Z_low": value.low,
                    "Z_high": value.high,
                    "releases": option.releases,
                    "reported_Z": option.report.objective if option.report else "",
                }
            )
    return rows


def priority_rows(plan: CorridorPlan) -> list[dict[str, Any]]:
    """Return the next steps that each budget leaves undone, the best first."""
    rows = []
    for own in plan.plans[:-1]:
        for place, step in enumerate(own.following):
            options = plan.fronts[step.section]
            rows.append(
                {
                    "budget": own.budget,
                    "priority": place + 1,
                    "section": plan.problem.corridor.sections[step.section].name,
                    "instead_of": words(options[step.before].layout),
                    "build": words(options[step.after].layout),
                    "additional_cost": step.cost,
                    "waiting_costs_per_year": step.saving,
                    "saving_per_euro": step.saving / step.cost,
                }
            )
    return rows


def words(layout: rigdda.Layout) -> str:
    """Return a layout as text."""
    return "; ".join(barrier.label for barrier in layout) or "nothing"


def table_of_budgets(plan: CorridorPlan) -> Table:
    """Return the table of all budgets, in thousand EUR and thousand EUR per year."""
    out = empty_table(
        ("budget", "spent", "gain (95 %)", "share", "same", "worst", "ratio", "1 EUR")
    )
    for own in plan.plans:
        limit = "unlimited" if own is plan.unlimited else thousands(own.budget)
        found = own.evaluation
        simple = [percent(share(plan, e.gain)) for e in own.methods.values()]
        low, high = found.gain_ci
        out.add_row(
            limit,
            thousands(found.cost),
            f"{thousands(found.gain)} ({thousands(low, 'down')} to {thousands(high, 'up')})",
            percent(share(plan, found.gain)),
            *simple,
            f"{own.shadow_price:.2g}",
        )
    return out


def table_of_sections(plan: CorridorPlan, own: BudgetPlan) -> Table:
    """Return the table of the sections for one budget, in thousand EUR (per year)."""
    out = empty_table(("section", "m", "cost", "gain", "risk left", "next", "layout"))
    following = {step.section: place + 1 for place, step in enumerate(own.following)}
    for s, evaluation in enumerate(own.evaluation.sections):
        section, nothing = plan.problem.corridor.sections[s], plan.problem.problems[s].nothing
        gain = section.length * (nothing.objective - evaluation.objective)
        risk = section.length * (evaluation.harm + evaluation.repair)
        place = f"{following[s]}." if s in following else ""
        out.add_row(
            section.name, f"{section.length:g}", thousands(section.length * evaluation.cost),
            thousands(gain) if evaluation.layout else "0", thousands(risk), place,
            words(evaluation.layout),
        )  # fmt: skip
    return out


def thousands(value: float, rounding: Rounding = "nearest") -> str:
    """Return an amount of money in thousands: three significant figures below 100 thousand."""
    return euros(value / 1e3, rounding)


def shown_budget(plan: CorridorPlan) -> BudgetPlan:
    """Return the plan for the largest budget that limits what is built, or else the largest."""
    limited = [own for own in plan.plans[:-1] if own.shadow_price > 0.0]
    return (limited or plan.plans[:-1])[-1]


def sections_that_miss(plan: CorridorPlan, own: BudgetPlan) -> list[str]:
    """Return the names of the sections that may miss a target with a plan."""
    names = [section.name for section in plan.problem.corridor.sections]
    return [name for name, missed in zip(names, own.missed, strict=True) if missed > 0.0]


STYLES = {OPTIMUM: ("#1c5aa0", "o"), "same money per metre": ("#d0312d", "s"),
          "worst section first": ("#b8860b", "^"), "saving per cost": ("#009e73", "D")}  # fmt: skip
"""Colour and marker of each method."""


def draw_gain(path: Path, plan: CorridorPlan) -> None:
    """Draw the gain of each method against the budget, with 95 % bands."""
    import matplotlib.pyplot as plt

    budgets = np.array([own.budget for own in plan.plans[:-1]])
    with plt.rc_context(FONT):
        figure, axes = plt.subplots(figsize=(8.0, 5.0))
        for name, (colour, marker) in STYLES.items():
            found = [
                own.evaluation if name == OPTIMUM else own.methods[name] for own in plan.plans[:-1]
            ]
            gain = np.array([e.gain for e in found]) / 1e3
            if name == OPTIMUM:
                low, high = np.array([e.gain_ci for e in found]).T / 1e3
                axes.fill_between(budgets / 1e3, low, high, color=colour, alpha=0.15, linewidth=0)
            axes.plot(budgets / 1e3, gain, color=colour, marker=marker, markersize=5,
                      linewidth=2.0 if name == OPTIMUM else 1.2, label=name)  # fmt: skip
        whole = plan.unlimited.evaluation
        axes.axhline(whole.gain / 1e3, color="0.4", linestyle="--", linewidth=1.0)
        axes.annotate(f"unlimited money ({thousands(whole.cost)} thousand EUR)",
                      (0.01, whole.gain / 1e3), xycoords=("axes fraction", "data"),
                      xytext=(0, 4), textcoords="offset points", color="0.3")  # fmt: skip
        if len(budgets) > 1 and budgets[0] > 0.0 and budgets[-1] / budgets[0] > 8.0:
            axes.set_xscale("log")
            axes.set_xticks(budgets / 1e3, [f"{b / 1e3:,.0f}" for b in budgets])
            axes.minorticks_off()
        axes.set_xlabel("budget for construction [thousand EUR]")
        axes.set_ylabel("reduction of the annual cost [thousand EUR a year]")
        axes.set_title(f"{plan.problem.corridor.name}: what the budget brings")
        axes.legend(frameon=False, loc="lower right")
        axes.margins(y=0.12)
        save(figure, path)


def draw_strip(path: Path, plan: CorridorPlan) -> None:
    """Draw the corridor along the road: what each budget builds and which risk is left."""
    import matplotlib.pyplot as plt
    from matplotlib.patches import Patch

    corridor, plans = plan.problem.corridor, plan.plans[:-1]
    ends = np.cumsum([section.length for section in corridor.sections])
    starts, lengths = ends - plan.problem.lengths, plan.problem.lengths
    colours = {kind: EVENTS[i % len(EVENTS)] for i, kind in enumerate(KINDS)}
    with plt.rc_context(FONT):
        figure, (below, above) = plt.subplots(
            2, 1, figsize=(11.0, 2.6 + 0.42 * len(plans) + 2.4), sharex=True,
            height_ratios=(2.2, 0.4 + 0.42 * len(plans)),
        )  # fmt: skip
        above.set_xlim(0.0, ends[-1])
        before = np.array([problem.nothing.objective for problem in plan.problem.problems])
        below.bar(starts, before, lengths, align="edge", color="0.85", edgecolor="white",
                  linewidth=0.5, label="without barriers")  # fmt: skip
        shades = {(len(plans) - 1) // 2: 0.45, len(plans) - 1: 1.0}
        for own, shade in ((plans[i], shade) for i, shade in shades.items()):
            left = np.array([e.harm + e.repair for e in own.evaluation.sections])
            below.step(np.append(starts, ends[-1]), np.append(left, left[-1]), where="post",
                       color=ROAD, alpha=shade, linewidth=1.6,
                       label=f"risk left with {thousands(own.budget)} thousand EUR")  # fmt: skip
        below.set_ylabel("cost [EUR per m and year]")
        below.legend(frameon=False, fontsize=9, ncol=3, loc="lower left", bbox_to_anchor=(0, 1))
        for row, own in enumerate(plans):
            _row(above, row, own, starts.tolist(), lengths.tolist(), colours)
        above.set_yticks(range(len(plans)), [f"{thousands(own.budget)}" for own in plans])
        above.set_ylim(-0.6, len(plans) - 0.4)
        above.set_ylabel("budget [thousand EUR]")
        above.set_xlabel("distance along the road [m]")
        if len(corridor.sections) <= PER_ROW:
            names = above.secondary_xaxis("top")
            size = 8 if len(corridor.sections) <= 20 else 6
            names.set_xticks(0.5 * (starts + ends), [s.name for s in corridor.sections],
                             rotation=90 if len(corridor.sections) > 14 else 30, fontsize=size,
                             ha="center" if len(corridor.sections) > 14 else "left")  # fmt: skip
            names.tick_params(length=0)
        used = {b.kind for own in plans for e in own.evaluation.sections for b in e.layout}
        marks = [Patch(color=colours[kind], label=kind.replace("_", " "))
                 for kind in KINDS if kind in used]  # fmt: skip
        figure.legend(handles=marks, frameon=False, loc="lower center", ncol=len(marks) or 1)
        figure.suptitle(f"{corridor.name}: what is built where", y=0.99)
        figure.subplots_adjust(left=0.09, right=0.98, top=0.88, bottom=0.16, hspace=0.45)
        save(figure, path)


def _row(
    axes: Axes, row: int, own: BudgetPlan, starts: Sequence[float], lengths: Sequence[float],
    colours: dict[str, str],
) -> None:  # fmt: skip
    """Draw the barriers of all sections for one budget as coloured bars."""
    axes.axhline(row, color="0.9", linewidth=0.8, zorder=0)
    for start, length, evaluation in zip(starts, lengths, own.evaluation.sections, strict=True):
        kinds = [barrier.kind for barrier in evaluation.layout]
        for i, kind in enumerate(kinds):
            height = 0.76 / len(kinds)
            axes.bar(start + 0.03 * length, height, 0.94 * length, bottom=row - 0.38 + i * height,
                     align="edge", color=colours[kind], linewidth=0)  # fmt: skip


__all__ = ["DPI", "FILES", "table_of_budgets", "table_of_sections", "write"]
