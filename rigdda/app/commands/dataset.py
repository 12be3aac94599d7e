"""The command `rigdda dataset`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    count_option,
    counted,
    executor_option,
    folder_for,
    out_option,
    progress,
    recorded_run,
    seed_option,
)
from rigdda.model.site_names import SPLITS


@click.command(short_help="Write the outcomes of many layouts on many sites as Parquet.")
@click.option("--split", type=click.Choice(SPLITS), default="train",
              show_default=True, help="Split of the generated sites to use.")  # fmt: skip
@count_option(
    "--sites",
    1,
    12,
    "Number of sites. Six sites contain each family of the first version once, and nine "
    "contain each family with wide ranges once.",
)
@count_option("--layouts", 1, 32, "Number of layouts of each site.")
@count_option("--releases", 1, 100, "Number of releases of each layout, over all events.")
@seed_option("Seed of the layouts and of the releases.", SEED)
@out_option("dataset-SPLIT")
@executor_option
def dataset(
    split: str, sites: int, layouts: int, releases: int, seed: int, out: Path | None
) -> None:
    """Simulate many layouts on many sites and write the outcomes as Parquet.

    The layouts are no barrier, constants, single barriers of the catalogue, random layouts and
    neighbours of these. Writes for each site outcomes/SITE.parquet, with one row per release (site,
    layout, event, seed and outcome), and sites/SITE.parquet, with data on the site. An
    interrupted run continues with the next site. A larger --sites extends a data set.
    """
    from rigdda.app import dataset as job

    recipe = job.Recipe(split, layouts, releases, seed)
    names = recipe.names(sites)
    folder = folder_for(out, f"dataset-{split}", job.RECIPE)
    with recorded_run(folder), progress(len(names)) as tick:
        rows = job.write(recipe, sites, folder, tick)
    click.echo(f"{rows:,} releases on {counted(len(names), 'site')} of {split}; outcomes and "
               "sites are in "
               f"{folder}")  # fmt: skip
