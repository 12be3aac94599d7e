"""The command `rigdda simulate`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    CHAINAGE,
    count_option,
    executor_option,
    folder_for,
    layout_option,
    note,
    out_option,
    progress,
    read_layout,
    recorded_run,
    remove_earlier,
    seed_option,
    show,
    warn_of_placeholders,
)
from rigdda.files import remove_unfinished


@click.command()
@click.argument("site")
@layout_option
@click.option(
    "--event",
    metavar="NAME",
    help="Simulate only this event.  [default: draw events by their rates]",
)
@count_option("--releases", 1, 100, "Number of releases.")
@click.option("--station", "at", type=CHAINAGE, multiple=True, metavar="X",
              help="Chainage of the site file, not of its survey, at which passing blocks are "
              "recorded [m]. May be repeated.  "
              "[default: the uphill edge of the road]")  # fmt: skip
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="Mechanical model. 'lumped' treats each block as a point; "
              "it is fast but cannot simulate barriers that stand on the ground.")  # fmt: skip
@seed_option("Seed of the first release. Later releases use the seeds that follow.")
@out_option("simulate-SITE")
@executor_option
def simulate(
    site: str,
    layout: str | None,
    event: str | None,
    releases: int,
    at: tuple[float, ...],
    model: str,
    seed: int,
    out: Path | None,
) -> None:
    """Simulate releases of SITE and report what reaches the road.

    SITE is the name of a built-in site or a TOML file. The energy of a hit is the kinetic energy
    of the block just before it touches the barrier. The energy that a barrier absorbs is the work
    that its forces do against all blocks.

    Writes, each as CSV and Parquet: stations and along_slope (energies, velocity, bounce height and
    passing rate, with quantiles and intervals), passages (every passage at a station), run_out,
    stopping and stops (where rock stops, also beyond the road). Also writes pictures (section.png,
    along_slope.png, run_out.png, and one for each station), outcomes.csv and run.npz (the first
    release). With --model lumped, writes points.csv only. A run that was interrupted continues
    where it stopped.
    """
    import rigdda
    from rigdda.app import simulate as job
    from rigdda.app.released import released
    from rigdda.app.reports import findings, simulation_report, stations, tables
    from rigdda.app.reports.stations import Passing
    from rigdda.passages import check_stations

    where, barriers = released(site), read_layout(layout)
    seeds = range(seed, seed + releases)
    if model == "lumped":
        if at:
            raise click.UsageError("--station is for --model blocks")
        points = rigdda.lumped(where, barriers, seeds, event)
        folder = folder_for(out, f"simulate-{where.name}", "points.csv")
        with recorded_run(folder, where):
            tables.write_points(folder / "points.csv", seeds, points)
            remove_earlier(folder, ["points.csv"])
        show(tables.points(points))
        note(findings.unfitted(where))
        note(findings.of_layout(where, barriers, event))
        warn_of_placeholders(site)
        click.echo(f"{releases} releases of points; points.csv is in {folder}")
        return
    where.realise(barriers, seed, event)  # report an impossible layout before making a folder
    asked = check_stations(where, at or (where.road.start,))
    files = simulation_report.files(asked.tolist())
    folder = folder_for(out, f"simulate-{where.name}", *files)
    with recorded_run(folder, where), progress(releases) as tick:
        lines = simulation_report.lines(where, asked)
        found = job.simulate(where, barriers, seeds, event, lines.tolist(), folder, tick)
        tick(releases, "tables and pictures")
        tables.write_outcomes(folder / "outcomes.csv", seeds, found.outcomes)
        found.run.save(folder / "run.npz")
        passing = Passing.of(where, barriers, event, found.passages)
        rows, rest = simulation_report.write(folder, passing, barriers, asked)
        remove_unfinished(folder)
        remove_earlier(folder, files)
    show(tables.outcomes(where, barriers, found.outcomes, stations.stopped(rest)))
    for line, table in stations.tables(rows):
        click.echo(line)
        show(table)
    click.echo("95 % intervals; ?: too few blocks for this end; height: of the centre of a block")
    if event is None:
        for line in stations.of_design_events(where, rows):
            click.echo(line)
    note(findings.of_layout(where, barriers, event))
    warn_of_placeholders(site)
    note(passing.of_mesh())
    note(stations.undecided(passing))
    note(stations.lower_bound(rest))
    if passing.not_drawn:
        names = ", ".join(passing.not_drawn)
        note(f"no release of {names} was drawn: name one with --event, or give more --releases")
    resumed = f", {found.resumed:,} from an interrupted run" if found.resumed else ""
    click.echo(f"{releases:,} releases{resumed}; tables and pictures are in {folder}")
