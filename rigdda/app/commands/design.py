"""The command `rigdda design`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rigdda.agents.designers import DEFAULT, DESIGNERS
from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    CHAINAGE,
    RealNumber,
    WholeNumber,
    checks_option,
    count_option,
    executor_option,
    finding,
    folder_for,
    interim,
    out_option,
    posterior_option,
    progress,
    recorded_run,
    seed_option,
    show,
    show_risks,
    warn_of_placeholders,
)
from rigdda.files import remove_results, remove_unfinished

if TYPE_CHECKING:
    from rigdda.agents.designers.store import Store
    from rigdda.app.design_study import DesignStudy
    from rigdda.app.uncertainty.ground_band import Band
    from rigdda.app.uncertainty.parameters import Posterior
    from rigdda.envs import DesignProblem


BUDGET = 20_000
"""Default limit of the releases of a search."""


RELEASES = 3_000
"""Default limit of the releases for the verification of a layout; with all of them, Z is known to a
few per cent."""


PRECISION = 0.02
"""Default precision of a design relative to Z [-]."""


CASES = 5
"""Greatest number of layouts that are verified: no barrier, the rule, the constant, the layout
without required checks and the result."""


Kinds = tuple[str, ...] | None


def _kinds(_: click.Context, __: click.Parameter, value: str | None) -> Kinds:
    """Return the names in a list that is separated by commas or spaces."""
    return None if value is None else tuple(value.replace(",", " ").split())


@click.command()
@click.argument("site")
@click.option("--designer", type=click.Choice(DESIGNERS), default=DEFAULT, show_default=True,
              help="Search method.")  # fmt: skip
@click.option("--kinds", callback=_kinds, metavar="KIND,...",
              help="Allowed kinds of barrier: fence, ditch, embankment, gravity_wall, mesh, wall, "
              "removal (of a removable existing barrier).  [default: all except wall]")  # fmt: skip
@click.option("--target", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that rock of a design event reaches the "
              "road.")  # fmt: skip
@click.option("--failure", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that a barrier fails in a design "
              "event.")  # fmt: skip
@click.option("--target-risk", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable individual risk of a commuter [1/year]. The site must have "
              "a table [traffic].")  # fmt: skip
@click.option("--max-cost", type=RealNumber(min=0.0), metavar="EUR_PER_M",
              help="Largest capital cost of a layout in EUR per metre of road.")  # fmt: skip
@click.option("--zone", type=CHAINAGE, nargs=2, metavar="A B",
              help="Place barriers between the chainages A and B [m] of the site file, not of "
              "its survey.  [default: the zone of the site]")  # fmt: skip
@click.option("--precision", type=RealNumber(0.0, 0.5), default=PRECISION, show_default=True,
              metavar="P", help="Precision of the answer relative to Z. The verification ends when "
              "the order of the layouts is clear or Z is known to within P; the search ends when "
              "another 1,000 releases are expected to lower Z by less than P/2. With 0, or with a "
              "target, all releases of --budget and --verify are used.")  # fmt: skip
@count_option("--budget", 2, BUDGET, "Largest number of releases of the search.")
@checks_option
@count_option("--verify", 10, RELEASES, "Largest number of new releases for verifying each layout.")
@click.option("--ground-samples", "grounds", type=WholeNumber(0, 1000), default=6,
              show_default=True, help="Number of grounds within the plausible range on which the "
              "layouts are compared at the end; 0 for none.")  # fmt: skip
@posterior_option
@seed_option("Seed of the search and of its releases.", SEED)
@out_option("design-SITE")
@executor_option
def design(
    site: str,
    designer: str,
    kinds: Kinds,
    target: float | None,
    failure: float | None,
    target_risk: float | None,
    max_cost: float | None,
    zone: tuple[float, float] | None,
    precision: float,
    budget: int,
    checks: str,
    verify: int,
    grounds: int,
    posterior: Path | None,
    seed: int,
    out: Path | None,
) -> None:
    """Find the best layout of barriers for SITE and verify it.

    SITE is the name of a built-in site or a TOML file. The layout is verified on releases that the
    search did not use. The best layout has the least cost Z of those whose barriers meet their
    checks; a second search with at most half of the budget shows what this condition costs. Z is
    the sum of capital and upkeep, expected harm on the road and expected repair, in EUR per metre
    of road and year. At the end, the layouts are compared on other grounds within the plausible
    range.

    A first answer appears within seconds and improves during the search. The search and the
    verification stop when more releases would hardly change the answer (--precision).

    If the layout misses a target, the cheapest layout for each level of P(reach) is reported and
    written to frontier.csv and frontier.png.

    Writes layout.toml, evaluations.csv, section.png, cost.png and episode.rrd. The comparison on
    other grounds is in band.csv and band.png, the checks of the barriers are in checks.csv and
    design_sheet.csv, and the demand of the engineering rule along the slope is in demand.csv and
    demand.png. For a site with traffic, risk.csv contains the risk to life. The outcomes of all
    releases are kept for `rigdda reprice`.

    An interrupted run continues from evaluations.jsonl. A folder that contains the design of
    another problem (problem.json) is refused.
    """
    from rigdda.agents.designers.store import PROBLEM_FILE, record_problem
    from rigdda.app import design as job
    from rigdda.app import value_origins
    from rigdda.app.reports import design_report as report
    from rigdda.app.reports.tables import RISKS
    from rigdda.app.uncertainty.parameters import read_posterior

    if posterior is not None and not grounds:
        words = "--posterior is for the comparison on other grounds: leave it out, or give "
        raise click.UsageError(f"{words}--ground-samples above 0")
    problem = _pose(site, kinds, (target, failure, target_risk), max_cost, zone, checks)
    fitted = None if posterior is None else read_posterior(posterior, problem.site)
    optional = *report.BAND_FILES, *report.FRONTIER_FILES, RISKS
    files = *report.DESIGN_FILES, *optional, PROBLEM_FILE
    folder = folder_for(out, f"design-{problem.site.name}", *files)
    with recorded_run(folder, problem.site):
        record_problem(folder, problem, *report.DESIGN_FILES)
        remove_results(folder, report.BAND_FILES)
        total = job.search_budget(problem, designer, budget) + CASES * verify
        with interim(total) as (tick, show_interim):
            done, store = job.design(
                problem, designer, budget, seed, verify, folder, tick, precision,
                lambda cases: show_interim(
                    report.interim_line(cases), report.interim_table(cases)
                ),
                value_origins.marks_of(site),
            )  # fmt: skip
            tick(total, "pictures")
            report.write_design(done, folder, seed)
        band = _on_other_grounds(done, grounds, fitted, seed, folder) if grounds else None
    _tell(done, store, folder)
    if band is not None:
        _tell_band(band, folder)
    warn_of_placeholders(site)


def _pose(
    site: str,
    kinds: Kinds,
    targets: tuple[float | None, float | None, float | None],
    max_cost: float | None,
    zone: tuple[float, float] | None,
    checks: str,
) -> DesignProblem:
    """Return the design problem that the options describe.

    `targets` are the greatest acceptable probabilities of reach and failure and individual risk.
    """
    from rigdda.app.released import released
    from rigdda.envs import DesignProblem
    from rigdda.envs.problem import Targets

    asked: dict[str, Any] = {
        "kinds": kinds, "zone": zone or None, "max_cost": max_cost, "checks": checks,
    }  # fmt: skip
    if any(target is not None for target in targets):
        asked["targets"] = Targets(*targets)
    return DesignProblem(released(site), **asked)


def _on_other_grounds(
    done: DesignStudy, grounds: int, fitted: Posterior | None, seed: int, folder: Path
) -> Band:
    """Compare the layouts on other grounds and write the files of the comparison."""
    from rigdda.app.reports import design_report as report
    from rigdda.app.uncertainty import ground_band

    with progress(grounds) as tick:
        band = ground_band.assess(done, grounds, fitted, seed, folder, tick)
    report.write_band(folder, band)
    remove_unfinished(folder)
    return band


def _tell_band(band: Band, folder: Path) -> None:
    """Print the comparison on other grounds."""
    from rigdda.app.reports import design_report as report

    click.echo(
        f"on {len(band.samples)} other grounds ({band.source}), {band.releases} releases of "
        "each layout on each;\nP(reach): of the design event that reaches the road most often"
    )
    show(report.band_table(band))
    for line in filter(None, (report.band_verdict(band), report.band_on_target(band))):
        finding(line)
    click.echo(f"{', '.join(report.BAND_FILES)} are in {folder}")


def _tell(done: DesignStudy, store: Store, folder: Path) -> None:
    """Print the tables, the layout to order, its limits and the computing effort."""
    from rigdda.app.reports import design_report as report
    from rigdda.app.reports import findings, tables
    from rigdda.app.reports.wording import order, unchanged

    chosen, result = done.chosen.evaluation, done.result
    click.echo(f"{findings.headline(findings.answer(done))}\n")
    click.echo(
        "Z, capital, harm and repair are in EUR per metre of road and year; to build is in EUR\n"
        "per metre; debris: rock on the road, relative to the first layout"
    )
    show(tables.costs(done))
    chances = tables.chances(done)
    if chances is not None:
        click.echo("probabilities in each design event, with 95 % upper bounds in brackets")
        show(chances)
    else:
        click.echo("the site has no design events (design = true)")
    show_risks(done)
    for line in findings.frontier(done, done.frontier, len(result.tried), done.replaced):
        finding(line)
    if done.frontier:
        show(report.frontier_table(done.problem.site, done.frontier))
    kept = result.origin == "start" and findings.was_searched(done) and len(result.tried) > 1
    from_start = " (a starting layout of the search)" if kept else ""
    site = done.problem.site
    click.echo(f"layout{from_start}:" if chosen.layout else f"layout: {unchanged(site)}")
    for barrier in chosen.layout:
        click.echo(f"  {order(barrier, site)}")
    for line in findings.existing_barriers(site, chosen.layout):
        click.echo(f"  {line}")
    finding(report.rule_words(done.rule))
    if done.checks.table:
        click.echo("checks of this layout (checks.csv, design_sheet.csv)")
        show(report.check_table(done.checks))
    for line in report.check_notes(done.checks):
        finding(line)
    for line in findings.of_design(done):
        finding(line)
    resumed = f"; {store.resumed:,} releases from an earlier run" if store.resumed else ""
    files = [*report.DESIGN_FILES, *(report.FRONTIER_FILES if done.frontier else ())]
    files += [tables.RISKS] if site.traffic is not None else []
    click.echo(
        f"search: {result.simulations:,} releases, {result.seconds:.0f} s of processor time; "
        f"verification: {chosen.releases:,} new releases of each layout{resumed}\n"
        f"{', '.join(files)} are in {folder}"
    )
