"""What the command line shares: its output folder, progress bar, tables and error lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.console import RenderableType


class Stopped(Exception):
    """A job ended before its end; the message says what was kept, the code is for the shell."""

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code


def fail(message: str, code: int) -> int:
    """Write one line on standard error; return the exit code."""
    click.echo("rigdda: " + " ".join(message.split()), err=True)
    return code


def folder_for(out: Path | None, command: str, site: str) -> Path:
    """Return the folder to write into, which exists."""
    folder = out or Path("runs") / f"{command}-{site}"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def kept(folder: Path) -> Iterator[None]:
    """Say what is left in the folder if a simulation diverges or the user interrupts."""
    from rigdda import Diverged

    try:
        yield
    except (Diverged, KeyboardInterrupt) as error:
        if isinstance(error, Diverged) and error.run is not None:
            error.run.save(folder / "diverged.npz")
        names = ", ".join(sorted(file.name for file in folder.iterdir())) or "nothing"
        reason, code = ("interrupted", 130) if isinstance(error, KeyboardInterrupt) else (error, 1)
        raise Stopped(f"{reason}; kept in {folder}: {names}", code) from None


@contextmanager
def progress(total: int) -> Iterator[Callable[[int, str], None]]:
    """Show a progress bar on standard error if that is a terminal; yield how to move it."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Remaining())
    off = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=off) as bar:
        task = bar.add_task("starting", total=total)
        yield lambda done, words: bar.update(task, completed=done, description=words)


def show(table: RenderableType) -> None:
    """Print a rich table on standard output."""
    from rich.console import Console

    Console(markup=False, highlight=False).print(table)  # [m] is a unit, not a style
