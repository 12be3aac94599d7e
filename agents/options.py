"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rigdda.agents.limits import RELEASES

if TYPE_CHECKING:
    from rigdda import Layout

layout_option = click.option(
    "--layout", type=click.Path(), help="Barriers: a TOML or JSON file, as `design` writes."
)


class Folder(click.Path):
    """A folder, whose name is not empty: an unset variable of the shell would give this one."""

    def convert(
        self, value: Any, param: click.Parameter | None, context: click.Context | None
    ) -> Any:
        """Return the path."""
        if value == "":
            self.fail("name a folder", param, context)
        return super().convert(value, param, context)


def out_option(default: str) -> Callable[..., Any]:
    """Return the option --out, into runs/ by default."""
    return click.option(
        "--out",
        type=Folder(file_okay=False, path_type=Path),
        help=f"Folder to write into.  [default: runs/{default}]",
    )


def seed_option(words: str, most: int | None = None) -> Callable[..., Any]:
    """Return the option --seed with its help; searches and trainings take at most `limits.SEED`."""
    kind = click.IntRange(0, most)
    return click.option("--seed", type=kind, default=0, show_default=True, help=words)


def count_option(name: str, least: int, default: int, words: str) -> Callable[..., Any]:
    """Return an option that counts, releases for example."""
    kind = click.IntRange(least, RELEASES)
    return click.option(name, type=kind, default=default, show_default=True, help=words)


def read_layout(path: str | None) -> Layout:
    """Return the layout of a file, no barriers without one.

    Raises
    ------
    BadInput
        If the file is missing or not sound.
    """
    from rigdda import load_layout

    return () if path is None else load_layout(path)
