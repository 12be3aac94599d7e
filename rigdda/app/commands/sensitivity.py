"""The command `rigdda sensitivity`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    WholeNumber,
    count_option,
    executor_option,
    finding,
    folder_for,
    layout_option,
    out_option,
    posterior_option,
    progress,
    read_layout,
    recorded_run,
    seed_option,
    show,
    warn_of_placeholders,
)
from rigdda.files import remove_unfinished


@click.command()
@click.argument("site")
@layout_option
@click.option("--method", type=click.Choice(("morris", "sobol")), default="morris",
              show_default=True, help="Screening by the method of Morris, or indices of Sobol', "
              "which take several times as many releases.")  # fmt: skip
@click.option("--samples", type=WholeNumber(2), metavar="N",
              help="Number of trajectories (morris), or of points from which indices are computed "
              "(sobol), a power of two.  [default: 20 for morris, 64 for sobol]")  # fmt: skip
@count_option("--releases", 2, 200, "Number of releases at each point, over all events.")
@click.option("--parameters", "names", multiple=True, metavar="GROUP|PATH[=LOW:HIGH]",
              help="Inputs to vary: ground, sizes, rates, prices, or the path of a number in the "
              "site file. May be repeated.  [default: all four groups]")  # fmt: skip
@posterior_option
@seed_option("Seed of the points, of the bootstrap and of the first release.", SEED)
@out_option("sensitivity-SITE")
@executor_option
def sensitivity(
    site: str,
    layout: str | None,
    method: Literal["morris", "sobol"],
    samples: int | None,
    releases: int,
    names: tuple[str, ...],
    posterior: Path | None,
    seed: int,
    out: Path | None,
) -> None:
    """Find which uncertain numbers of SITE the results depend on.

    Varies block sizes, rates, prices, consequences and, within the ranges of the library, the
    ground. Measures how much each of these numbers changes Z and, for each design event, the
    probabilities that the road is reached and that a barrier fails. All points use the same
    releases. Prices and rates need no additional simulation.

    Writes sensitivity.csv (indices with intervals), samples.csv (inputs and outputs at each point)
    and tornado.png. A run that was interrupted continues where it stopped.
    """
    from rigdda.app.released import released
    from rigdda.app.reports import sensitivity_report
    from rigdda.app.uncertainty import parameters
    from rigdda.app.uncertainty import sensitivity as job

    where, barriers = released(site), read_layout(layout)
    where.realise(barriers)
    inputs = parameters.inputs(names, where, barriers, posterior)
    asked = job.plan(where, barriers, inputs, method, samples, releases, seed)
    folder = folder_for(out, f"sensitivity-{where.name}", *sensitivity_report.SENSITIVITY_FILES)
    with recorded_run(folder, where), progress(asked.size) as tick:
        found = job.run(asked, folder, tick)
        tick(asked.size, "tables and picture")
        sensitivity_report.write(folder, found)
        remove_unfinished(folder)
    for line, table in sensitivity_report.tables(found):
        click.echo(line)
        show(table)
    finding(sensitivity_report.explain(found))
    warn_of_placeholders(site)
    resumed = f", {found.resumed:,} from an interrupted run" if found.resumed else ""
    click.echo(
        f"{len(asked.sites):,} points with {len(asked.groups):,} simulated sites, {asked.size:,} "
        f"releases{resumed}; {', '.join(sensitivity_report.SENSITIVITY_FILES)} are in {folder}"
    )
