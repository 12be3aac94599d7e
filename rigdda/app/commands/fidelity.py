"""The command `rigdda fidelity`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    count_option,
    folder_for,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
)


@click.command()
@click.argument("site")
@count_option("--releases", 10, 2000, "Number of releases of each layout at each fidelity.")
@seed_option("Seed of the releases.", SEED)
@out_option("fidelity-SITE")
def fidelity(site: str, releases: int, seed: int, out: Path | None) -> None:
    """Measure the bias and the speed-up of fidelity "fast".

    Compares Z and the processor time of a release without barriers, with the constant layout and
    with the layout of the engineering rule. Writes fidelity.csv.
    """
    from rigdda.app import fidelity_bias
    from rigdda.app.released import released

    where = released(site)
    folder = folder_for(out, f"fidelity-{where.name}", "fidelity.csv")
    with recorded_run(folder, where), progress(6 * releases) as tick:
        found = fidelity_bias.compare(where, releases, seed, tick)
        fidelity_bias.write(folder / "fidelity.csv", where, found)
    show(fidelity_bias.table(found))
    click.echo(f"{releases} releases of each; fidelity.csv is in {folder}")
