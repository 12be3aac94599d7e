"""Tables, layouts and pictures of a corridor plan."""

from __future__ import annotations

import re
from collections.abc import Sequence, Set
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import rigdda
from rigdda.agents.corridor.planning import OPTIMUM, BudgetPlan, CorridorPlan
from rigdda.agents.corridor.programme import RATIO
from rigdda.agents.designers.frontier import worst
from rigdda.app.reports.pictures import EVENTS, FONT, save
from rigdda.app.reports.tables import empty_table, write_rows
from rigdda.app.reports.wording import euros, percent, unchanged
from rigdda.barriers import KINDS, Built
from rigdda.display import ROAD
from rigdda.envs import Evaluation
from rigdda.envs.intervals import Mean
from rigdda.envs.problem import can_fail
from rigdda.rounding import Rounding

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.table import Table


CORRIDOR_FILES = (
    "budgets.csv",
    "sections.csv",
    "fronts.csv",
    "priorities.csv",
    "gain.png",
    "strip.png",
)
"""Files that `write` writes besides the folder `layouts`."""

CORRIDOR_COPY = "corridor-as-used"
"""Folder with the corridor and its sites as they were used, see `rigdda.Corridor.save`."""

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
    written = set()
    for i, own in enumerate(plan.plans[:-1]):
        folder = out / "layouts" / f"budget-{i + 1}"
        folder.mkdir(parents=True, exist_ok=True)
        for s, evaluation in enumerate(own.evaluation.sections):
            file = folder / f"section-{s + 1}.toml"
            rigdda.save_layout(evaluation.layout, file)
            written.add(file)
    _remove_earlier(out / "layouts", "budget-{}/section-{}.toml", written)
    draw_gain(out / "gain.png", plan)
    draw_strip(out / "strip.png", plan)


def keep_corridor(corridor: rigdda.Corridor, out: Path) -> None:
    """Write the corridor and its sites into the folder `CORRIDOR_COPY` of a results folder.

    Raises
    ------
    BadInput
        If a site cannot be represented in TOML.
    """
    folder = corridor.save(out / CORRIDOR_COPY).parent
    files = {folder / f"site-{s + 1}.toml" for s in range(len(corridor.sections))}
    _remove_earlier(folder, "site-{}.toml", files)


def _remove_earlier(folder: Path, form: str, written: Set[Path]) -> None:
    """Remove the numbered files that an earlier run wrote and the present run did not write.

    `form` is the name of these files, with {} for each number. Other files remain.
    """
    named = re.compile(re.escape(form).replace(r"\{\}", "[1-9][0-9]*"))
    for file in [*folder.glob(form.replace("{}", "*"))]:
        if named.fullmatch(file.relative_to(folder).as_posix()) and file not in written:
            file.unlink()
            if file.parent != folder and not any(file.parent.iterdir()):
                file.parent.rmdir()


def share(plan: CorridorPlan, gain: float) -> float | None:
    """Return a gain as a share of that of unlimited money [-], None if that is not positive."""
    whole = plan.unlimited.evaluation.gain
    return gain / whole if whole > 0.0 else None


def budget_rows(plan: CorridorPlan) -> list[dict[str, Any]]:
    """Return one row for each budget and method [EUR, EUR/year].

    A cell is empty if its value is not defined: the share if the gain of unlimited money is not
    positive, and the shadow price of the simple methods or with a yearly budget.
    """
    rows = []
    for budget_plan in plan.plans:
        limit = "unlimited" if budget_plan is plan.unlimited else budget_plan.budget
        for name, evaluation in {OPTIMUM: budget_plan.evaluation, **budget_plan.methods}.items():
            ahead = plan.problem.ahead(budget_plan.evaluation, evaluation)
            part = share(plan, evaluation.gain)
            price = budget_plan.shadow_price if name == OPTIMUM else None
            rows.append(
                {
                    "budget": limit,
                    "method": name,
                    "spent": evaluation.cost,
                    "gain": evaluation.gain,
                    "gain_low": evaluation.gain_ci[0],
                    "gain_high": evaluation.gain_ci[1],
                    "share_of_unlimited": "" if part is None else part,
                    "behind": ahead.value,
                    "behind_low": ahead.low,
                    "behind_high": ahead.high,
                    "objective": evaluation.objective,
                    "objective_low": evaluation.ci[0],
                    "objective_high": evaluation.ci[1],
                    "annual_cost_of_barriers": evaluation.annual,
                    "sections_built": sum(bool(e.layout) for e in evaluation.sections),
                    "shadow_price": "" if price is None else price,
                    "sections_missing_targets": sum(x > 0.0 for x in budget_plan.missed[name]),
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
            nothing, gain = problem.nothing.objective, section_gain(plan, own, s)
            rows.append(
                {
                    "budget": limit,
                    "section": section.name,
                    "length": section.length,
                    "layout": words(evaluation.layout, section.site),
                    "cost": section.length * evaluation.cost,
                    "gain": gain.value,
                    "gain_low": gain.low,
                    "gain_high": gain.high,
                    "Z": evaluation.objective,
                    "Z_low": evaluation.ci[0],
                    "Z_high": evaluation.ci[1],
                    "Z_without_barriers": nothing,
                    **risk_columns(evaluation, section.site),
                    "targets_missed_by": own.missed[OPTIMUM][s],
                }
            )
    return rows


def risk_columns(evaluation: Evaluation, site: rigdda.Site) -> dict[str, float | None]:
    """Return the numbers to which targets refer, with upper ends of their intervals.

    They are estimated from the releases of the evaluation, whereas the amount by which a target is
    missed is judged by all releases of the layout, see `Option.missed`. They are the probabilities
    that rock of a design event reaches the road and that a barrier fails in it, for the design
    event with the largest one-sided 95 % upper bound, and the individual risk [1/year]. A number
    is None without design events, barriers that can fail, or traffic.
    """
    out: dict[str, float | None] = {}
    for name, seen in (("reach", evaluation.reach), ("failure", evaluation.failure)):
        chances = [seen[event.name] for event in site.events if event.design]
        if name == "failure" and not can_fail(site, evaluation.layout):
            chances = []
        greatest = worst(chances) if chances else None
        out[name] = greatest.probability if greatest and greatest.releases else None
        out[f"{name}_high"] = greatest.bound if greatest else None
    individual = evaluation.risk.individual if evaluation.risk is not None else None
    out["individual"] = individual.value if individual is not None else None
    out["individual_high"] = individual.high if individual is not None else None
    return out


def section_gain(plan: CorridorPlan, own: BudgetPlan, s: int) -> Mean:
    """Return the gain of a section with its 95 % interval [EUR/year], 0 without barriers."""
    evaluation, nothing = own.evaluation.sections[s], plan.problem.problems[s].nothing
    if not evaluation.layout:
        return Mean(0.0, 0.0, 0.0)
    length = plan.problem.corridor.sections[s].length
    before = Mean(nothing.objective, *nothing.ci).times(length)
    after = Mean(evaluation.objective, *evaluation.ci).times(length)
    return before.minus(after)


def front_rows(plan: CorridorPlan) -> list[dict[str, Any]]:
    """Return one row for each option of each section, per metre of road."""
    rows = []
    for section, options in zip(plan.problem.corridor.sections, plan.fronts, strict=True):
        for option in options:
            value = option.value()
            rows.append(
                {
                    "section": section.name,
                    "layout": words(option.layout, section.site),
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
            section = plan.problem.corridor.sections[step.section]
            rows.append(
                {
                    "budget": own.budget,
                    "priority": place + 1,
                    "section": section.name,
                    "instead_of": words(options[step.before].layout, section.site),
                    "build": words(options[step.after].layout, section.site),
                    "additional_cost": step.cost,
                    "waiting_costs_per_year": step.saving,
                    "saving_per_euro": step.saving / step.cost,
                }
            )
    return rows


def words(layout: rigdda.Layout, site: rigdda.Site) -> str:
    """Return a layout as text: kinds, sizes and chainages as `rigdda design` prints them."""
    return "; ".join(_placed(barrier, site) for barrier in layout) or unchanged(site)


def _placed(barrier: rigdda.Barrier, site: rigdda.Site) -> str:
    """Return kind, sizes and chainage of a barrier as text."""
    if not isinstance(barrier, Built):
        return barrier.label_and_place
    sizes, _ = barrier.order(site.road.start)
    return ", ".join(filter(None, (barrier.label, sizes, f"at x = {barrier.x:.1f} m")))


def table_of_budgets(plan: CorridorPlan) -> Table:
    """Return the table of all budgets, in thousand EUR and thousand EUR per year.

    A dash is a value that is not defined, see `budget_rows`.
    """
    out = empty_table(
        ("budget", "spent", "gain (95 %)", "share", "same", "worst", "ratio", "1 EUR")
    )
    for budget_plan in plan.plans:
        limit = "unlimited" if budget_plan is plan.unlimited else thousands(budget_plan.budget)
        best = budget_plan.evaluation
        parts = [share(plan, e.gain) for e in (best, *budget_plan.methods.values())]
        price = budget_plan.shadow_price
        low, high = best.gain_ci
        out.add_row(
            limit,
            thousands(best.cost),
            f"{thousands(best.gain)} ({thousands(low, 'down')} to {thousands(high, 'up')})",
            *("-" if part is None else percent(part) for part in parts),
            "-" if price is None else f"{price:.2g}",
        )
    return out


def table_of_sections(plan: CorridorPlan, own: BudgetPlan) -> Table:
    """Return the table of the sections for one budget, in thousand EUR (per year)."""
    out = empty_table(("section", "m", "cost", "gain", "risk left", "next", "layout"))
    following = {step.section: place + 1 for place, step in enumerate(own.following)}
    for s, evaluation in enumerate(own.evaluation.sections):
        section, gain = plan.problem.corridor.sections[s], section_gain(plan, own, s).value
        risk = section.length * (evaluation.harm + evaluation.repair)
        place = f"{following[s]}." if s in following else ""
        out.add_row(
            section.name, f"{section.length:g}", thousands(section.length * evaluation.cost),
            thousands(gain), thousands(risk), place,
            words(evaluation.layout, section.site),
        )  # fmt: skip
    return out


def thousands(value: float, rounding: Rounding = "nearest") -> str:
    """Return an amount of money in thousands: three significant figures below 100 thousand."""
    return euros(value / 1e3, rounding)


def shown_budget(plan: CorridorPlan) -> BudgetPlan:
    """Return the plan for one budget, of which all sections are printed.

    It is the largest budget that builds something and leaves a step undone that would pay. If there
    is none, it is the largest budget.
    """
    limited = [own for own in plan.plans[:-1] if own.evaluation.cost > 0.0 and own.following]
    return (limited or plan.plans[:-1])[-1]


def sections_that_miss(plan: CorridorPlan, own: BudgetPlan) -> list[str]:
    """Return the names of the sections that may miss a target with a plan."""
    names = [section.name for section in plan.problem.corridor.sections]
    return [name for name, by in zip(names, own.missed[OPTIMUM], strict=True) if by > 0.0]


def has_targets(plan: CorridorPlan) -> bool:
    """Return whether a section has a target."""
    sections = plan.problem.corridor.sections
    return any(value is not None for s in sections for value in s.targets.values())


def not_shown_to_save(plan: CorridorPlan, own: BudgetPlan) -> list[str]:
    """Return the sections whose barriers may cost more than they save, with their gains as text.

    Their 95 % interval of the gain, from releases that did not affect any choice, is not entirely
    positive.
    """
    found = []
    for s, section in enumerate(plan.problem.corridor.sections):
        gain = section_gain(plan, own, s)
        if own.evaluation.sections[s].layout and gain.low <= 0.0:
            ends = f"{euros(gain.low, 'down')} to {euros(gain.high, 'up')}"
            found.append(f"{section.name} ({euros(gain.value)} EUR per year, {ends})")
    return found


STYLES = {OPTIMUM: ("#1c5aa0", "o"), "same money per metre": ("#d0312d", "s"),
          "worst section first": ("#b8860b", "^"), RATIO: ("#009e73", "D")}  # fmt: skip
"""Colour and marker of each method."""


def draw_gain(path: Path, plan: CorridorPlan) -> None:
    """Draw the gain of each method against the budget, with 95 % bands."""
    import matplotlib.pyplot as plt

    budgets = np.array([each.budget for each in plan.plans[:-1]])
    with plt.rc_context(FONT):
        figure, axes = plt.subplots(figsize=(8.0, 5.0))
        for name, (colour, marker) in STYLES.items():
            evaluations = [
                each.evaluation if name == OPTIMUM else each.methods[name]
                for each in plan.plans[:-1]
            ]
            gain = np.array([e.gain for e in evaluations]) / 1e3
            if name == OPTIMUM:
                low, high = np.array([e.gain_ci for e in evaluations]).T / 1e3
                axes.fill_between(budgets / 1e3, low, high, color=colour, alpha=0.15, linewidth=0)
            label = f"{name} (ignores targets)" if has_targets(plan) and name == RATIO else name
            axes.plot(budgets / 1e3, gain, color=colour, marker=marker, markersize=5,
                      linewidth=2.0 if name == OPTIMUM else 1.2, label=label)  # fmt: skip
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
                  linewidth=0.5, label="without new barriers")  # fmt: skip
        shades = {(len(plans) - 1) // 2: 0.45, len(plans) - 1: 1.0}
        for each, shade in ((plans[i], shade) for i, shade in shades.items()):
            left = np.array([e.harm + e.repair for e in each.evaluation.sections])
            below.step(np.append(starts, ends[-1]), np.append(left, left[-1]), where="post",
                       color=ROAD, alpha=shade, linewidth=1.6,
                       label=f"risk left with {thousands(each.budget)} thousand EUR")  # fmt: skip
        below.set_ylabel("cost [EUR per m and year]")
        below.legend(frameon=False, fontsize=9, ncol=3, loc="lower left", bbox_to_anchor=(0, 1))
        for row, each in enumerate(plans):
            _row(above, row, each, starts.tolist(), lengths.tolist(), colours)
        above.set_yticks(range(len(plans)), [f"{thousands(each.budget)}" for each in plans])
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
        used = {b.kind for each in plans for e in each.evaluation.sections for b in e.layout}
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


__all__ = ["CORRIDOR_FILES", "table_of_budgets", "table_of_sections", "write"]
