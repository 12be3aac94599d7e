"""The command `rigdda check`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    finding,
    folder_for,
    out_option,
    recorded_run,
    seed_option,
    show,
    warn_of_placeholders,
)


@click.command(short_help="Check a site file, and draw the slope.")
@click.argument("site")
@seed_option("Seed of the releases that are tried.")
@out_option("check-SITE")
def check(site: str, seed: int, out: Path | None) -> None:
    """Draw SITE, describe what will be computed, and list values that look odd.

    SITE is the name of a built-in site or a TOML file. A few releases are simulated to estimate the
    time that others take. Writes site.png.
    """
    from rigdda.app import site_check, site_oddities, site_picture
    from rigdda.app.released import released

    where = released(site)
    folder = folder_for(out, f"check-{where.name}", "site.png")
    with recorded_run(folder, where):
        site_picture.draw(folder / "site.png", where)
        trials = site_check.try_releases(where, seed)
    for line in site_check.facts(where):
        click.echo(line)
    show(site_check.table(where, trials))
    click.echo(site_check.time_of(where, trials))
    warn_of_placeholders(site)
    odd = site_oddities.oddities(where, trials, site_oddities.written_events(site))
    for line in odd:
        finding(f"odd: {line}")
    words = f"{len(odd)} things look odd" if len(odd) != 1 else "1 thing looks odd"
    click.echo(f"{words if odd else 'nothing looks odd'}; site.png is in {folder}")
