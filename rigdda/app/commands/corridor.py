"""The command `rigdda corridor`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    RealNumber,
    checks_option,
    count_option,
    executor_option,
    finding,
    folder_for,
    note,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
)

if TYPE_CHECKING:
    from rigdda.agents.corridor.planning import CorridorPlan


@click.command(short_help="Plan the barriers of many slopes within one budget.")
@click.argument("file", metavar="CORRIDOR")
@click.option("--budget", "budgets", type=RealNumber(0.0, 1e12), multiple=True, metavar="EUR",
              help="Budget for construction. May be repeated.  [default: those of the "
              "file]")  # fmt: skip
@count_option("--releases", 200, 4_000, "Number of releases per section.")
@click.option("--robust", is_flag=True, help="Choose by the mean of the highest fifth of the "
              "estimates of the cost (conditional value at risk).")  # fmt: skip
@checks_option
@seed_option("Seed of the searches and of their releases.", SEED)
@out_option("corridor-NAME")
@executor_option
def corridor(
    file: str,
    budgets: tuple[float, ...],
    releases: int,
    robust: bool,
    checks: str,
    seed: int,
    out: Path | None,
) -> None:
    """Choose the barriers of all sections of CORRIDOR within a common budget.

    CORRIDOR is a TOML file or a built-in corridor (corridor-12, corridor-50). Every section is
    searched for layouts from the cheapest to the best, and an integer programme chooses one layout
    for each section and budget. The choice is compared with three simple rules: equal money for
    every metre of road, the worst section first, and the greatest saving per cost first.

    Writes budgets.csv, sections.csv, fronts.csv (all layouts), priorities.csv (what should be built
    next), the folder layouts, and pictures: gain.png (gain against budget) and strip.png (what is
    built where). The folder corridor-as-used keeps the corridor and its sites. An interrupted run
    continues where it stopped.
    """
    from msgspec.structs import replace

    import rigdda
    from rigdda.agents.corridor.planning import Planner
    from rigdda.app import site_check
    from rigdda.app.released import released
    from rigdda.app.reports import corridor_report as report
    from rigdda.envs import CorridorProblem
    from rigdda.model.corridor import site_files

    where = rigdda.Corridor.load(file)
    files = site_files(file)
    sections = tuple(replace(section, site=released(section.site)) for section in where.sections)
    where = replace(where, sections=sections)
    if budgets:
        where = replace(where, budgets=budgets)
    problem = CorridorProblem(where, checks=checks)
    folder = folder_for(out, f"corridor-{where.name}", *report.CORRIDOR_FILES)
    stored = folder / "evaluations"
    stored.mkdir(exist_ok=True)
    with recorded_run(folder), progress(releases * len(where.sections)) as tick:
        report.keep_corridor(where, folder)
        plan = Planner(problem, releases, seed, robust, stored, tick).plan()
        report.write(plan, folder)
    show_plan(plan)
    for path in files:
        if left := site_check.placeholders(str(path)):
            note(f"the site file {path} marks {len(left)} values as placeholders to replace")
    click.echo(
        f"{len(where.sections)} sections, {where.length:,.0f} m, {plan.releases:,} releases; "
        f"{', '.join(report.CORRIDOR_FILES)}, layouts "
        f"and {report.CORRIDOR_COPY} are in {folder}"
    )


def show_plan(plan: CorridorPlan) -> None:
    """Print what each budget achieves, what one of them builds, and the findings."""
    from rigdda.app.reports import corridor_report as report

    click.echo(
        "Costs are in thousand EUR, savings in thousand EUR per year. share: saving as a share\n"
        "of the saving with unlimited money; same, worst and ratio: this share with equal money\n"
        "for every metre, with the worst section first, and with the greatest saving per cost\n"
        "first; 1 EUR: what one more EUR would save each year."
    )
    if report.has_targets(plan):
        finding(
            "Money is spent on targets first, even where this saves nothing; the method of the "
            "greatest saving per cost (ratio) and the saving of one more EUR ignore targets."
        )
    if plan.problem.corridor.yearly_budget is not None:
        finding(
            "All methods keep the yearly budget, also with unlimited money. What one more EUR "
            "would save is not computed with a yearly budget."
        )
    show(report.table_of_budgets(plan))
    own = report.shown_budget(plan)
    click.echo(
        f"what a budget of {own.budget:,.0f} EUR builds; next: what would be built first with\n"
        "more money, see priorities.csv"
    )
    show(report.table_of_sections(plan, own))
    for one in plan.plans[:-1]:
        if doubtful := report.not_shown_to_save(plan, one):
            finding(
                f"with {one.budget:,.0f} EUR, it is not shown that the barriers of these sections "
                f"save more than they cost: {', '.join(doubtful)}"
            )
    for one in plan.plans:
        if missing := report.sections_that_miss(plan, one):
            money = f"with {one.budget:,.0f} EUR"
            if one is plan.unlimited:
                money = "even with unlimited money"
            finding(f"{money}, these sections may miss a target: {', '.join(missing)}")
