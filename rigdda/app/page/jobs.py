"""Long commands that the page runs in processes of their own, with progress, cancel and resume."""

from __future__ import annotations

import contextlib
import csv
import json
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from rigdda import BadInput, Layout
from rigdda.barriers import from_table
from rigdda.files import atomic

RUNNING, FINISHED, CANCELLED, FAILED, INTERRUPTED = (
    "running", "finished", "cancelled", "failed", "interrupted",
)  # fmt: skip
"""States of a job. It is interrupted if the server ended while it ran."""

VERIFIED = "verification"
"""Stage of the evaluations on releases that the search did not use."""

PATIENCE = 10.0
"""Time that a cancelled process has to end before it is killed [s]."""


class Record(msgspec.Struct):
    """The file of a job."""

    arguments: list[str]
    """Arguments of the command line."""
    state: str
    words: str = ""
    """The last line on standard error of a command that failed."""


class Job:
    """A command of the command line in a process of its own.

    Its record is a file, so that a server that is started again finds it.

    Parameters
    ----------
    folder : Path
        Folder of the project.
    name : str
        Name of the job, and of its files.
    """

    def __init__(self, folder: Path, name: str):
        self._file = folder / f"{name}.job.json"
        self._log = folder / f"{name}.job.log"
        self._process: subprocess.Popen[bytes] | None = None
        self._record = self._read()

    @property
    def arguments(self) -> list[str]:
        """Arguments of the command; empty if there has been none."""
        return self._record.arguments if self._record is not None else []

    @property
    def command(self) -> str:
        """The command as a user would type it; empty if there has been none."""
        return shlex.join(["rigdda", *self.arguments]) if self.arguments else ""

    def option(self, name: str) -> str:
        """Return the value of an option of the command; empty if it has none of that name."""
        known = self.arguments
        return known[known.index(name) + 1] if name in known else ""

    @property
    def words(self) -> str:
        """Why the command failed; empty if it did not."""
        return self._record.words if self._record is not None else ""

    @property
    def state(self) -> str:
        """The state, one of those above; empty if there has been no command."""
        if self._record is None:
            return ""
        if self._process is not None and self._record.state == RUNNING:
            code = self._process.poll()
            if code is not None:
                self._end(FINISHED if code == 0 else FAILED)
        return self._record.state

    @property
    def pid(self) -> int | None:
        """Number of the process while it runs."""
        return self._process.pid if self._process is not None and self.state == RUNNING else None

    @property
    def line(self) -> str:
        """The last line that the command wrote on standard error or standard output."""
        return _last_line(self._log)

    def start(self, arguments: Sequence[str]) -> None:
        """Run a command.

        Raises
        ------
        BadInput
            If the job is running already.
        """
        if self.state == RUNNING:
            raise BadInput("job", self.command, "wait until it has ended, or cancel it")
        self._log.parent.mkdir(parents=True, exist_ok=True)
        self._write(Record(list(arguments), RUNNING))
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "rigdda.app.page.worker", *arguments],
                stdin=subprocess.PIPE, stdout=log, stderr=log, start_new_session=True,
            )  # fmt: skip

    def resume(self) -> None:
        """Run the last command again; it continues where it stopped.

        Raises
        ------
        BadInput
            If there is none, or it is running.
        """
        if not self.arguments:
            raise BadInput("job", None, "start one first")
        self.start(self.arguments)

    def cancel(self) -> None:
        """End the command, and return when its process is gone."""
        if self.state == RUNNING and self._process is not None:
            self._close()
            self._end(CANCELLED)

    def close(self) -> None:
        """End the command because the server ends; it can be resumed."""
        if self.state == RUNNING and self._process is not None:
            self._close()

    def _close(self) -> None:
        process = self._process
        assert process is not None and process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _end(self, state: str) -> None:
        assert self._record is not None
        words = self.line if state == FAILED else ""
        self._write(Record(self._record.arguments, state, words))
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()
        self._process = None

    def _write(self, record: Record) -> None:
        self._record = record
        with atomic(self._file) as part:
            part.write_bytes(msgspec.json.encode(record))

    def _read(self) -> Record | None:
        try:
            found = msgspec.json.decode(self._file.read_bytes(), type=Record)
        except (OSError, msgspec.DecodeError):
            return None
        if found.state == RUNNING:  # of a server that is gone, and its process with it
            found.state = INTERRUPTED
        return found


def _last_line(file: Path) -> str:
    try:
        lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.strip() for line in reversed(lines) if line.strip()), "")


class Tried(NamedTuple):
    """A layout that a search has evaluated."""

    layout: Layout
    stage: str
    simulations: int
    """Releases of the search until then."""
    releases: int
    """Releases of this layout."""
    objective: float
    low: float
    high: float
    """Z and its 95 % interval [EUR per metre of road and year]."""
    capital: float
    """Capital and upkeep [EUR per metre of road and year]."""
    risk: float
    """Harm and repair [EUR per metre of road and year]."""
    cost: float
    """To build [EUR per metre of road]."""


def tried(folder: Path) -> list[Tried]:
    """Return the layouts in evaluations.csv of a design, the last evaluation of each.

    A verification takes precedence over the evaluations of other stages. A row that is being
    written is left out.
    """
    found: dict[Layout, Tried] = {}
    try:
        with (folder / "evaluations.csv").open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                with contextlib.suppress(BadInput, ValueError, TypeError, KeyError):
                    one = _tried(row)
                    known = found.get(one.layout)
                    if known is None or known.stage != VERIFIED or one.stage == VERIFIED:
                        found[one.layout] = one
    except OSError:
        return []
    return list(found.values())


def _tried(row: dict[str, Any]) -> Tried:
    tables = json.loads(row["barriers"])
    layout = tuple(from_table(f"barriers[{i}]", table) for i, table in enumerate(tables))
    risk = float(row["harm"]) + float(row["repair"])
    z, low, high = (float(row[f"objective{end}"]) for end in ("", "_low", "_high"))
    return Tried(
        layout, row["stage"], int(row["simulations"]), int(row["releases"]), z, low, high,
        float(row["capital"]), risk, float(row["cost"]),
    )  # fmt: skip
