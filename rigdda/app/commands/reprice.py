"""The command `rigdda reprice`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    RealNumber,
    finding,
    folder_for,
    note_placeholders,
    out_option,
    recorded_run,
    show,
    show_risks,
)


@click.command(short_help="Evaluate a design again with other prices or rates.")
@click.argument("results", metavar="RESULTS", type=click.Path(path_type=Path))
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE",
              help="New value of a key of the site file, such as consequences.closure=20000. May "
              "be repeated.")  # fmt: skip
@click.option("--target", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that rock of a design event reaches the "
              "road.  [default: that of the design]")  # fmt: skip
@click.option("--failure", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that a barrier fails in a design event.  "
              "[default: that of the design]")  # fmt: skip
@click.option("--target-risk", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable individual risk of a commuter [1/year].  [default: that of "
              "the design]")  # fmt: skip
@click.option("--max-cost", type=RealNumber(min=0.0), metavar="EUR_PER_M",
              help="Largest capital cost of a layout in EUR per metre of road.  [default: that of "
              "the design]")  # fmt: skip
@out_option("reprice-RESULTS")
def reprice(
    results: Path,
    settings: tuple[str, ...],
    target: float | None,
    failure: float | None,
    target_risk: float | None,
    max_cost: float | None,
    out: Path | None,
) -> None:
    """Evaluate the design in the folder RESULTS again with other prices, rates, targets or caps.

    No layout is simulated: the outcomes of all releases of the design are evaluated with the new
    values. The last row of the table is the best of all layouts that the search evaluated; if the
    design required checks, only layouts whose barriers meet them are considered. Keys on which the
    motion of rock depends are refused.

    Writes costs.csv, site.toml (the site with the new values), layout.toml (the best layout),
    cost.png and, if a target is missed, frontier.csv and frontier.png. For a site with traffic, it
    also writes risk.csv.
    """
    from rigdda.app import reprice as job
    from rigdda.app.reports import design_report, findings, reprice_report, tables
    from rigdda.app.reports.wording import order, unchanged

    asked = job.other_targets(target, failure, target_risk)
    done = job.reprice(results, job.parse_all(settings), asked, max_cost)
    files = (*reprice_report.REPRICE_FILES, *design_report.FRONTIER_FILES, tables.RISKS)
    folder = folder_for(out, f"reprice-{results.resolve().name}", *files)
    if folder.resolve() == results.resolve():
        raise click.UsageError("--out is the folder of the design: name another folder")
    with recorded_run(folder, done.problem.site):
        reprice_report.write(done, folder)
    note_placeholders(len(done.placeholders))
    for change in done.changes:
        click.echo(reprice_report.changed(change))
    finding(findings.headline(reprice_report.answer(done)))
    click.echo()
    show(tables.costs(done))
    chances = tables.chances(done)
    if chances is not None:
        show(chances)
    show_risks(done)
    for line in findings.frontier(done, done.frontier, done.tried, False):
        finding(line)
    if done.frontier:
        show(design_report.frontier_table(done.problem.site, done.frontier))
    chosen, site = done.chosen.evaluation.layout, done.problem.site
    click.echo("layout:" if chosen else f"layout: {unchanged(site)}")
    for barrier in chosen:
        click.echo(f"  {order(barrier, site)}")
    for line in findings.existing_barriers(site, chosen):
        click.echo(f"  {line}")
    for line in reprice_report.sentences(done):
        finding(line)
    click.echo(f"no layout was simulated; the results are in {folder}")
