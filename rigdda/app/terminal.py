"""Parts that all commands share: options, output folder, progress bar, tables and error lines."""

from __future__ import annotations

import math
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from rigdda.agents.limits import JOB_RELEASES, RELEASE_SEED
from rigdda.files import LONGEST_NAME, vector_twin

if TYPE_CHECKING:
    from rigdda import Layout, Site
    from rigdda.agents.run_record import RunRecord
    from rigdda.app.design_study import ComparedLayouts

layout_option = click.option(
    "--layout",
    type=click.Path(),
    help="Layout of barriers, a TOML or JSON file as `rigdda design` writes it.",
)

posterior_option = click.option(
    "--posterior",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Posterior of a fit (posterior.csv of `rigdda fit`), which replaces the plausible ranges "
    "of the numbers in it.",
)


class Folder(click.Path):
    """Option type for a folder that refuses the empty name.

    An unset shell variable would otherwise select the current folder.
    """

    def convert(
        self, value: Any, param: click.Parameter | None, context: click.Context | None
    ) -> Any:
        """Return the path."""
        if value == "":
            self.fail("name a folder", param, context)
        return super().convert(value, param, context)


class _InRange(click.ParamType):
    """Option type for a number, whose error says which numbers are accepted."""

    what: str

    def convert(
        self, value: Any, param: click.Parameter | None, context: click.Context | None
    ) -> Any:
        """Return the number, which is finite.

        An underscore between digits is a typing error, not a separator.
        """
        from rigdda import BadInput

        name = param.opts[0] if param else "number"
        try:
            if isinstance(value, str) and "_" in value:
                self.fail(value, param, context)
            found = super().convert(value, param, context)
        except click.BadParameter:
            raise BadInput(name, value, f"give {self.what}{self._bounds()}") from None
        if not math.isfinite(found):  # NaN is within the range of click
            raise BadInput(name, value, f"give a finite number{self._bounds()}")
        return found

    def _bounds(self) -> str:
        own: Any = self
        ends = []
        if own.min is not None:
            ends.append(f"{'above' if own.min_open else 'of at least'} {own.min:,}")
        if own.max is not None:
            ends.append(f"{'below' if own.max_open else 'at most'} {own.max:,}")
        return f" {' and '.join(ends)}" if ends else ""


class WholeNumber(_InRange, click.IntRange):
    """Option type for a whole number."""

    what = "a whole number"


class RealNumber(_InRange, click.FloatRange):
    """Option type for a number."""

    what = "a number"


class _Coordinate(_InRange, click.types.FloatParamType):
    what = "a number"
    min = max = None


CHAINAGE = _Coordinate()
"""Option type for a chainage [m], which may be a coordinate of a country."""


def out_option(default: str) -> Callable[..., Any]:
    """Return the option --out; the default is a folder in runs/."""
    return click.option(
        "--out",
        type=Folder(file_okay=False, path_type=Path),
        help=f"Folder to write into.  [default: runs/{default}]",
    )


def seed_option(words: str, most: int = RELEASE_SEED) -> Callable[..., Any]:
    """Return the option --seed with a help text; `most` is the largest seed that is accepted."""
    kind = WholeNumber(0, most)
    return click.option("--seed", type=kind, default=0, show_default=True, help=words)


def _connect(context: click.Context, _: click.Parameter, address: str | None) -> None:
    """Compute the releases of a command on the workers of a scheduler, if one is given."""
    if address is not None and not context.resilient_parsing:
        from rigdda.distribution import connected

        context.with_resource(connected(address))


executor_option = click.option(
    "--executor",
    metavar="dask://HOST:PORT",
    callback=_connect,
    expose_value=False,
    help="Compute releases on the workers of a Dask scheduler (extra `dask`).  [default: threads "
    "of this process]",
)


def count_option(name: str, least: int, default: int, words: str) -> Callable[..., Any]:
    """Return an option that takes a count, for example of releases."""
    kind = WholeNumber(least, JOB_RELEASES)
    return click.option(name, type=kind, default=default, show_default=True, help=words)


checks_option = click.option(
    "--checks", type=click.Choice(("required", "reported")), default="required", show_default=True,
    help="Whether every barrier must meet the checks of its kind, such as energy and height of a "
    "fence, or the checks are only reported.",
)  # fmt: skip


def typed(*names: str) -> list[str]:
    """Return those of some parameters of the command whose options the user typed."""
    context = click.get_current_context()
    command_line = click.core.ParameterSource.COMMANDLINE
    return [name for name in names if context.get_parameter_source(name) is command_line]


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, which is in the plural unless the number is 1."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def read_layout(path: str | None) -> Layout:
    """Return the layout in a file, or no barriers if `path` is None.

    Raises
    ------
    BadInput
        If the file is missing or invalid.
    """
    from rigdda import load_layout

    return () if path is None else load_layout(path)


if TYPE_CHECKING:
    from rich.console import Console, RenderableType

FORBIDDEN = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*]')
"""Characters that some operating systems do not allow in the name of a folder."""

UNRECORDED = ("report",)
"""Commands that write into a results folder without a record in it."""

PAUSE = 15.0
"""Least time between two progress lines if standard error is not a terminal [s]."""


class Stopped(Exception):
    """A job stopped early.

    The message says which files were kept; `code` is the exit code of the process.
    """

    def __init__(self, message: str, code: int):
        super().__init__(message)
        self.code = code


def fail(message: str, code: int) -> int:
    """Write one line on standard error; return the exit code."""
    click.echo("rigdda: " + " ".join(message.split()), err=True)
    return code


def note(words: str) -> None:
    """Print a note as one line, or nothing if the text is empty, and keep it in the run record."""
    if words:
        click.echo("note: " + _found(words))


def finding(words: str) -> None:
    """Print a finding as one line, or nothing if it is empty, and keep it in the run record."""
    if words:
        click.echo(_found(words))


FINDINGS_KEY = "rigdda.findings"
"""Key of the findings of a command in the data of its click context."""


def _found(words: str) -> str:
    """Return a text as one line and add it to the findings of the command."""
    line = " ".join(words.split())
    context = click.get_current_context(silent=True)
    if context is not None:
        context.meta.setdefault(FINDINGS_KEY, []).append(line)
    return line


def warn(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Write a warning as one line on standard error, with the signature of `showwarning`."""
    words = str(message) if issubclass(category, UserWarning) else f"{category.__name__}: {message}"
    click.echo("rigdda: " + " ".join(words.split()), err=True)


def once() -> Callable[..., None]:
    """Return a version of `warn` that writes each message only once."""
    told: set[str] = set()

    def tell(message: Warning | str, *others: Any, **named: Any) -> None:
        if str(message) not in told:
            told.add(str(message))
            warn(message, *others, **named)

    return tell


def folder_for(out: Path | None, name: str, *files: str) -> Path:
    """Create the output folder if needed and return it: `out`, or `name` in runs/.

    Files of the user and results of other commands are never overwritten.

    Raises
    ------
    BadInput
        If the folder cannot be created or written into, or one of the files cannot be written or
        was not written by the command that is running.
    """
    from rigdda import BadInput
    from rigdda.agents.run_record import RECORD_FILE

    folder = Path("runs") / _part(name) if out is None else out
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        hint = f"name a folder that can be created and written into ({error.strerror})"
        raise BadInput("--out", str(folder), hint) from None
    for file in (folder / name for name in (*files, RECORD_FILE)):
        if file.exists() and not (file.is_file() and os.access(file, os.W_OK)):
            hint = "this file cannot be overwritten: move it away or name another folder"
            raise BadInput("--out", str(file), hint)
    _refuse_foreign(folder, files)
    return folder


def _refuse_foreign(folder: Path, files: Sequence[str]) -> None:
    """Check that the files which exist in a folder are results of the command that is running.

    Which command wrote a file is in the record of the folder. Nothing is checked for a function
    that is called from Python, or for a command without a record, such as `report`.

    Raises
    ------
    BadInput
        If a file exists that another command or the user wrote.
    """
    from rigdda import BadInput
    from rigdda.agents.run_record import read

    context = click.get_current_context(silent=True)
    if context is None or context.info_name in UNRECORDED:
        return
    known, command = read(folder), str(context.info_name)
    own = known.pop(command, None)
    for file in dict.fromkeys((*files, *map(vector_twin, files))):
        writer = next((name for name, record in known.items() if file in record.files), None)
        if writer is not None:
            hint = f"`rigdda {writer}` wrote this file: name another folder"
        elif own is None and (folder / file).exists():
            hint = f"run.json does not say that `rigdda {command}` wrote this file: move it away "
            hint += "or name another folder"
        else:
            continue
        raise BadInput("--out", str(folder / file), hint)


def remove_earlier(folder: Path, files: Iterable[str]) -> None:
    """Remove what earlier runs of the running command wrote into a folder, except `files`.

    A report on the folder would otherwise show results of different runs together.
    """
    from rigdda.agents.run_record import read

    context = click.get_current_context(silent=True)
    if context is None:
        return
    kept = {*files, *map(vector_twin, files)}
    for name in _earlier(read(folder), str(context.info_name)):
        if name not in kept:
            (folder / name).unlink(missing_ok=True)


def _part(name: str) -> str:
    """Return a name, for example of a site, as a valid part of a path."""
    coding = sys.getfilesystemencoding()
    known = name.encode(coding, "replace").decode(coding)
    return FORBIDDEN.sub("-", known).encode(coding)[:LONGEST_NAME].decode(coding, "ignore")


@contextmanager
def recorded_run(folder: Path, site: Site | None = None) -> Iterator[None]:
    """Record a run in `run.json`, and report its files if it diverges or the user interrupts it.

    Parameters
    ----------
    folder : path
        The results folder.
    site : Site, optional
        The site of the run, for its record.

    Raises
    ------
    BadInput
        If another process is writing into the folder.
    """
    from rigdda import Diverged

    before = _stamps(folder)
    try:
        with _alone(folder), _recorded(folder, site, before):
            yield
    except (Diverged, KeyboardInterrupt) as error:
        if isinstance(error, Diverged) and error.run is not None:
            error.run.save(folder / "diverged.npz")
        written = {name for name, _ in _stamps(folder) - before}
        reason, code = ("interrupted", 130) if isinstance(error, KeyboardInterrupt) else (error, 1)
        names = ", ".join(sorted(written)) or "nothing"
        raise Stopped(f"{reason}; kept in {folder}: {names}", code) from None


@contextmanager
def _recorded(folder: Path, site: Site | None, before: set[Stamp]) -> Iterator[None]:
    """Write the record of the command into its folder, and complete it when the command ends."""
    from rigdda import BadInput
    from rigdda.agents.run_record import RunRecord, read, write_records

    context = click.get_current_context(silent=True)
    if context is None:  # a function that is called from Python has no command to record
        yield
        return
    command, arguments = str(context.info_name), context.find_root().obj or []
    record = RunRecord.begin(command, list(arguments), context.params, site)
    known = read(folder)
    record.files = earlier = _earlier(known, command)
    record.write(folder)
    try:
        yield
    except BadInput:  # a refused command does not replace the record of the results
        if _stamps(folder) == before:
            write_records(folder, known)
        raise
    written = {name for name, _ in _stamps(folder) - before}
    record.end(sorted(written | {name for name in earlier if (folder / name).exists()}))
    record.write(folder)
    context.call_on_close(lambda: _add_findings(record, folder, context))


def _earlier(known: dict[str, RunRecord], command: str) -> list[str]:
    """Return the files that earlier runs of the same command wrote into a folder."""
    return known[command].files if command in known else []


def _add_findings(record: RunRecord, folder: Path, context: click.Context) -> None:
    """Add the findings that a command printed to its record."""
    record.findings = context.meta.get(FINDINGS_KEY, [])
    if record.findings:
        with suppress(OSError):  # the results are complete without them
            record.write(folder)


Stamp = tuple[str, tuple[int, int, int]]
"""Name of a file with its inode, size and time of modification."""

LOCK = ".lock"
"""File in an output folder that is locked by the process which writes into the folder."""


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Lock a folder against other processes of this package if its drive supports file locks.

    Temporary files of killed processes are removed.
    """
    from filelock import FileLock, Timeout

    from rigdda import BadInput
    from rigdda.files import remove_parts

    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0.0)
    except Timeout:
        hint = "another run is writing into it: wait until it has ended or name another folder"
        raise BadInput("--out", str(folder), hint) from None
    except (OSError, NotImplementedError):  # some network drives cannot lock files
        pass
    if lock.is_locked:
        remove_parts(folder)
    try:
        yield
    finally:
        if lock.is_locked:
            with suppress(OSError):  # Windows does not remove open files
                (folder / LOCK).unlink()
        lock.release()


def _stamps(folder: Path) -> set[Stamp]:
    """Return the names of the files in a folder that hold results, each with its stamp."""
    from rigdda.agents.run_record import RECORD_FILE

    found = ((file.name, file.lstat()) for file in folder.iterdir())
    found = ((name, s) for name, s in found if name not in (LOCK, RECORD_FILE))
    return {(name, (s.st_ino, s.st_size, s.st_mtime_ns)) for name, s in found}


Tick = Callable[[int, str], None]
"""Reports the number of releases or steps that are done, and what is being done."""


@contextmanager
def progress(total: int) -> Iterator[Tick]:
    """Yield a function that reports the progress of a job on standard error.

    On a terminal it is a progress bar, otherwise an occasional line. The words may contain names
    that a user gave; they are shown as they are.
    """
    with interim(total) as (tick, _):
        yield tick


@contextmanager
def interim(total: int) -> Iterator[tuple[Tick, Callable[[str, RenderableType], None]]]:
    """Yield the function of `progress` and a function that shows an interim answer.

    The second function takes the answer as one line and as a table. On a terminal, the table stands
    above the progress bar until the next one replaces it. Otherwise, the line is written; the first
    line appears at once, later ones at most every `PAUSE` seconds. Both are on standard error.
    """
    from rich.console import Group
    from rich.live import Live
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    console = _console(stderr=True)
    if not console.is_terminal:
        rarely = _rarely(-PAUSE)
        yield _lines(total), lambda line, _: rarely(" ".join(line.split()))
        return
    words = TextColumn("{task.description}", markup=False)  # the column has markup of its own
    bar = Progress(words, BarColumn(), MofNCompleteColumn(), Remaining(), console=console)
    task = bar.add_task("starting", total=total)
    with Live(bar, console=console, transient=True) as live:
        yield (
            lambda done, words: bar.update(
                task, completed=done, description=" ".join(words.split())
            ),
            lambda _, table: live.update(Group(table, bar)),
        )


def _lines(total: int) -> Tick:
    """Return a function that writes at most one progress line every `PAUSE` seconds."""
    rarely = _rarely(0.0)
    return lambda done, words: rarely(f"{words}: {done:,} of {total:,}")


def _rarely(last: float) -> Callable[[str], None]:
    """Return a function that writes at most one line every `PAUSE` seconds.

    `last` is the assumed time of the line before, relative to now [s].
    """
    told = time.monotonic() + last

    def tell(line: str) -> None:
        nonlocal told
        if time.monotonic() - told >= PAUSE:
            told = time.monotonic()
            click.echo(line, err=True)

    return tell


def show(table: RenderableType) -> None:
    """Print a rich table on standard output, with all text as it is."""
    _console().print(table)


def _console(stderr: bool = False) -> Console:
    """Return a console that shows all text as it is.

    Texts contain units such as [m] and names that a user gave, which must not be read as markup,
    as codes of emojis or as anything to highlight.
    """
    from rich.console import Console

    return Console(stderr=stderr, markup=False, emoji=False, highlight=False)


def warn_of_placeholders(site: str) -> None:
    """Print a note if a site file still has placeholders of `rigdda new`."""
    from rigdda.app import value_origins

    note_placeholders(len(value_origins.marks_of(site)))


def note_placeholders(count: int) -> None:
    """Print a note if a site file marks some values as placeholders."""
    if count:
        words = "1 value as a placeholder" if count == 1 else f"{count} values as placeholders"
        note(f"the site file marks {words} to replace")


TRAFFIC_HEADING = (
    "risk to the traffic on {0.section_length:g} m of road, per year: vehicles hit by falling "
    "rock,\nvehicles that run into debris, deaths, deaths per km, and the individual risk\n"
    "of a person who travels it {0.commuter_trips:g} times, with the upper end of its 95 % interval"
)
"""Line above the table of the risk to a `Traffic`."""


def show_risks(done: ComparedLayouts) -> None:
    """Print the risk of each layout to the traffic, if the site has traffic."""
    from rigdda.app.reports import tables

    risks = tables.risks(done)
    if risks is not None:
        click.echo(TRAFFIC_HEADING.format(done.problem.site.traffic))
        show(risks)
