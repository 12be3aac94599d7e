"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


def out_option(default: str) -> Callable[..., Any]:
    """Return the option --out, into runs/ by default."""
    return click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        help=f"Folder to write into.  [default: runs/{default}]",
    )


def seed_option(words: str) -> Callable[..., Any]:
    """Return the option --seed with its help."""
    return click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help=words)


def count_option(name: str, least: int, default: int, words: str) -> Callable[..., Any]:
    """Return an option that counts, releases for example."""
    return click.option(
        name, type=click.IntRange(least), default=default, show_default=True, help=words
    )
