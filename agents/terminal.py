"""What the command line shares: options, output folder, progress bar, tables and error lines."""

from __future__ import annotations

import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from rigdda.agents.limits import RELEASES

if TYPE_CHECKING:
    from rigdda import Layout

layout_option = click.option(
    "--layout",
    type=click.Path(),
    help="Layout of barriers: a TOML or JSON file such as `rigdda design` writes.",
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


if TYPE_CHECKING:
    from rich.console import RenderableType

FORBIDDEN = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*]')
"""What cannot be in the name of a folder on some system."""

LONGEST = 200
"""Bytes of the name of a folder; systems take 255."""

PAUSE = 15.0
"""Least time between two lines about progress where there is no terminal [s]."""


class Stopped(Exception):
    """A job ended before its end; the message says what was kept, the code is for the shell."""

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code


def fail(message: str, code: int) -> int:
    """Write one line on standard error; return the exit code."""
    click.echo("rigdda: " + " ".join(message.split()), err=True)
    return code


def note(words: str) -> None:
    """Write one line beside the results, if there is anything to say."""
    if words:
        click.echo("note: " + " ".join(words.split()))


def warn(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Write a warning as one line on standard error; takes what `warnings.showwarning` does."""
    words = str(message) if issubclass(category, UserWarning) else f"{category.__name__}: {message}"
    click.echo("rigdda: " + " ".join(words.split()), err=True)


def once() -> Callable[..., None]:
    """Return `warn`, which says nothing twice."""
    told: set[str] = set()

    def tell(message: Warning | str, *others: Any, **named: Any) -> None:
        if str(message) not in told:
            told.add(str(message))
            warn(message, *others, **named)

    return tell


def folder_for(out: Path | None, name: str, *files: str) -> Path:
    """Return the folder to write files into, which exists: `out`, or the one in runs/ of a name.

    Raises
    ------
    BadInput
        If it cannot be made or written into, or something is in the way of a file.
    """
    from rigdda import BadInput

    folder = Path("runs") / _part(name) if out is None else out
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        mend = f"name a folder that can be made and written into ({error.strerror})"
        raise BadInput("--out", str(folder), mend) from None
    for file in (folder / name for name in files):
        if file.exists() and not (file.is_file() and os.access(file, os.W_OK)):
            mend = "no file can be written there: move it away or name another folder"
            raise BadInput("--out", str(file), mend)
    return folder


def _part(name: str) -> str:
    """Return a name, of a site for example, as one part of a path: no separators, not too long."""
    coding = sys.getfilesystemencoding()
    known = name.encode(coding, "replace").decode(coding)
    return FORBIDDEN.sub("-", known).encode(coding)[:LONGEST].decode(coding, "ignore")


@contextmanager
def kept(folder: Path) -> Iterator[None]:
    """Say what this run leaves in the folder if a simulation diverges or the user interrupts.

    Raises
    ------
    BadInput
        If another process writes into the folder.
    """
    from rigdda import Diverged

    before = _stamps(folder)
    try:
        with _alone(folder):
            yield
    except (Diverged, KeyboardInterrupt) as error:
        if isinstance(error, Diverged) and error.run is not None:
            error.run.save(folder / "diverged.npz")
        written = {name for name, _ in _stamps(folder) - before}
        reason, code = ("interrupted", 130) if isinstance(error, KeyboardInterrupt) else (error, 1)
        names = ", ".join(sorted(written)) or "nothing"
        raise Stopped(f"{reason}; kept in {folder}: {names}", code) from None


LOCK = ".lock"
"""File in a folder of results that the process which writes into it has locked."""


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keep other processes of this package out of a folder, where its drive can lock files."""
    from filelock import FileLock, Timeout

    from rigdda import BadInput

    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0.0)
    except Timeout:
        mend = "another run writes into it: wait for its end or name another folder"
        raise BadInput("--out", str(folder), mend) from None
    except (OSError, NotImplementedError):  # some network drives lock nothing
        pass
    try:
        yield
    finally:
        if lock.is_locked:
            with suppress(OSError):  # Windows removes no file that is open
                (folder / LOCK).unlink()
        lock.release()


def _stamps(folder: Path) -> set[tuple[str, tuple[int, int, int]]]:
    """Return the names in a folder, each with what changes when it is written."""
    found = ((file.name, file.lstat()) for file in folder.iterdir() if file.name != LOCK)
    return {(name, (s.st_ino, s.st_size, s.st_mtime_ns)) for name, s in found}


@contextmanager
def progress(total: int) -> Iterator[Callable[[int, str], None]]:
    """Yield how to tell on standard error how far a job is.

    A bar where that is a terminal, else a line now and then.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _lines(total)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Remaining())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=total)
        yield lambda done, words: bar.update(task, completed=done, description=words)


def _lines(total: int) -> Callable[[int, str], None]:
    """Return how to write a line on standard error, at most one in `PAUSE` seconds."""
    told = time.monotonic()

    def tell(done: int, words: str) -> None:
        nonlocal told
        if time.monotonic() - told >= PAUSE:
            told = time.monotonic()
            click.echo(f"{words}: {done:,} of {total:,}", err=True)

    return tell


def show(table: RenderableType) -> None:
    """Print a rich table on standard output."""
    from rich.console import Console

    Console(markup=False, highlight=False).print(table)  # [m] is a unit, not a style
