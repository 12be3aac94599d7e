"""The command `rigdda open`."""

from __future__ import annotations

import importlib.util

import click

from rigdda.app.terminal import WholeNumber

INSTALL = "pip install 'rigdda[page]'"
"""How the extra is installed."""


@click.command("open", short_help="Show a site in the browser, with barriers that can be moved.")
@click.argument("target", required=False, metavar="[SITE | FILE | FOLDER]")
@click.option("--port", type=WholeNumber(1, 65535), metavar="P",
              help="Port of the page.  [default: a free one]")  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Only print the address of the page.")
def open_page(target: str | None, port: int | None, no_browser: bool) -> None:
    """Show a site in the browser: release rocks, drag barriers, see risk and cost.

    FILE is a site file. FOLDER is a folder with a site.toml, or an empty one into which a survey
    will be imported; the default is the current folder. A built-in SITE is copied to
    runs/page-SITE. The page can be reached from this machine only, and its address contains a
    random token. The command needs the extra `page`.
    """
    if any(importlib.util.find_spec(name) is None for name in ("panel", "bokeh", "tomlkit")):
        raise click.ClickException(f"the page needs the extra `page`: {INSTALL}")
    from rigdda.app.page.server import serve
    from rigdda.app.page.state import Project

    project = Project.open(target)
    serve(project, port, not no_browser, lambda address: click.echo(f"{address}\nCtrl-C ends it"))
