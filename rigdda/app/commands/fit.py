"""The command `rigdda fit`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    count_option,
    executor_option,
    folder_for,
    note,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
    warn_of_placeholders,
)
from rigdda.files import remove_unfinished


@click.command()
@click.argument("site")
@click.argument("observed", type=click.Path(dir_okay=False, path_type=Path), nargs=-1,
                required=True)  # fmt: skip
@click.option("--parameters", "names", multiple=True, required=True, metavar="PATH[=LOW:HIGH]",
              help="Number of the site file to fit, such as surfaces.soil.restitution. May be "
              "repeated; more than two are rarely identified.")  # fmt: skip
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="Model that computes the run-outs.")  # fmt: skip
@count_option("--budget", 8, 160, "Largest number of parameter sets to try.")
@count_option("--releases", 10, 150, "Number of releases of each event for each parameter set.")
@seed_option("Seed of the search and of the first release.", SEED)
@out_option("fit-SITE")
@executor_option
def fit(
    site: str,
    observed: tuple[Path, ...],
    names: tuple[str, ...],
    model: Literal["blocks", "lumped"],
    budget: int,
    releases: int,
    seed: int,
    out: Path | None,
) -> None:
    """Fit numbers of SITE to the observations in OBSERVED, one or several CSV files.

    The columns of a file are event and one of: run_out_m, the chainage at which a block stopped;
    start_m, end_m and share, mass_t or volume_m3, the deposit in an interval of chainage; or
    station_m, quantity (such as velocity or height) and value, of blocks that pass a station.

    Prints the fitted numbers with 95 % intervals, or "not identified" if the interval is nearly as
    long as the given range. Also prints how well the fit predicts observations that were left out
    of it. Writes site.toml (SITE with the fitted numbers), fit.csv, fit.png and posterior.csv,
    which `design` and `sensitivity` can sample. A run that was interrupted continues where it
    stopped.
    """
    import rigdda
    from rigdda.app import value_origins
    from rigdda.app.reports import tables
    from rigdda.app.site_oddities import oddities
    from rigdda.app.uncertainty import fit as job
    from rigdda.app.uncertainty import observations
    from rigdda.app.uncertainty.parameters import parse

    where = rigdda.Site.load(site)
    seen, parameters = observations.read(observed, where), [parse(name) for name in names]
    values = job.values_to_fit(where, seen, parameters, releases, seed, model)
    files = ("site.toml", "fit.csv", "fit.png", "posterior.csv")
    folder = folder_for(out, f"fit-{where.name}", *files)
    with recorded_run(folder, where), progress(budget) as tick:
        found = job.fit(
            where, seen, parameters, budget, releases, seed, tick, model, folder, values
        )
        fitted = {one.path for one in parameters}
        marked = [mark for mark in value_origins.marks_of(site) if mark.path not in fitted]
        value_origins.save(found.site, folder / "site.toml", marked)
        job.write(folder / "fit.csv", found)
        job.draw(folder / "fit.png", found)
        tables.write_rows(folder / "posterior.csv", found.posterior.rows())
        remove_unfinished(folder)
    show(tables.fit(job.rows(found, found.observed)))
    before = {*oddities(where)}
    for line in oddities(found.site):
        if line not in before:
            note(f"the fitted site looks odd: {line}")
    warn_of_placeholders(site)
    click.echo(f"up to {budget} parameter sets; {', '.join(files)} are in {folder}")
