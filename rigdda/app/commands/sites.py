"""The command `rigdda sites`."""

from __future__ import annotations

import click

from rigdda.app.terminal import (
    show,
)


@click.command()
def sites() -> None:
    """List the built-in sites, their events and barrier zones."""
    import rigdda
    from rigdda.app.reports import tables

    show(tables.sites(map(rigdda.Site.load, rigdda.sites.names())))
