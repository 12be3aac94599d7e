"""Reading of results folders for reports: their records, tables, pictures and sites."""

from __future__ import annotations

import csv
import io
import shlex
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cached_property
from pathlib import Path

from rigdda import BadInput, DoubtfulInput, Site
from rigdda.agents import run_record
from rigdda.agents.run_record import RunRecord
from rigdda.files import read

FIELD = "RESULTS"
"""Name of the argument in error messages."""

NEEDED = (".csv", ".toml", ".png")
"""Endings of the files that a report reads."""


@dataclass(frozen=True)
class ResultsFolder:
    """A folder that commands have written, with their records.

    Parameters
    ----------
    path : path
        The folder.
    label : str
        Its name in a report.
    records : dict of str to RunRecord
        Records of the commands that wrote into it, by command.
    """

    path: Path
    label: str
    records: dict[str, RunRecord]

    @cached_property
    def site(self) -> Site | None:
        """The site of the first command that has one, as it was used."""
        text = next((record.site for record in self.records.values() if record.site), "")
        if not text:
            return None
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DoubtfulInput)  # the command itself has told it
            return Site.parse(text, str(self.path / run_record.FILE))

    def files(self, pattern: str, command: str = "") -> list[str]:
        """Return the names of the files that match a pattern, in order.

        With `command`, only files that this command wrote.
        """
        records = [self.records[command]] if command in self.records else self.records.values()
        if command and command not in self.records:
            return []
        names = {name for record in records for name in record.files}
        return sorted((name for name in names if fnmatch(name, pattern)), key=_natural)

    def others(self) -> list[str]:
        """Return the names of all tables in the folder, also of those that no record names."""
        return sorted(file.name for file in self.path.glob("*.csv"))

    def table(
        self, name: str, needed: Sequence[str] = ()
    ) -> tuple[list[str], list[dict[str, str]]]:
        """Return the columns and the rows of a CSV file.

        Raises
        ------
        BadInput
            If the file is missing, is not UTF-8, lacks one of the columns `needed`, or a row has
            more or fewer cells than there are columns.
        """
        file = self.path / name
        head, *rows = [*csv.reader(io.StringIO(read(FIELD, file), newline=""))] or [[]]
        if lacking := [column for column in needed if column not in head]:
            mend = f"it lacks the column {lacking[0]!r}: run the command that made it again"
            raise BadInput(FIELD, str(file), mend)
        for number, row in enumerate(rows, 2):
            if len(row) != len(head):
                mend = f"repair line {number}, which has {len(row)} cells, not {len(head)}"
                raise BadInput(FIELD, str(file), f"{mend}, or run the command again")
        return head, [dict(zip(head, row, strict=True)) for row in rows]

    def picture(self, name: str) -> Path:
        """Return the vector picture of a name that ends in .png, or the .png if there is none."""
        vector = (self.path / name).with_suffix(".svg")
        return vector if vector.is_file() else self.path / name


def _natural(name: str) -> tuple[list[float], str]:
    """Return a key that sorts names with numbers, such as stations, by their numbers."""
    words = "".join(c if c.isdigit() or c == "." else " " for c in name).split()
    return [float(word) for word in words if word.count(".") <= 1 and word.strip(".")], name


def open_all(paths: Sequence[Path]) -> list[ResultsFolder]:
    """Return the results folders of some paths, each with a label of its own.

    Raises
    ------
    BadInput
        If a path is not a results folder, a command in it has not ended, or a file is missing.
    """
    found: list[ResultsFolder] = []
    for path in paths:
        if any(folder.path.resolve() == path.resolve() for folder in found):
            raise BadInput(FIELD, str(path), "name each folder once")
        label = path.resolve().name
        same = [folder.label for folder in found if folder.label.partition(" (")[0] == label]
        label = f"{label} ({len(same) + 1})" if same else label
        found.append(ResultsFolder(path, label, _records(path)))
    return found


def _records(path: Path) -> dict[str, RunRecord]:
    """Return the records of a results folder after checking that it is complete."""
    if not path.is_dir():
        mend = "name an existing folder that rigdda design, simulate or study wrote"
        raise BadInput(FIELD, str(path), mend)
    records = run_record.read(path)
    if not records:
        mend = (
            f"it has no {run_record.FILE}: name a folder that rigdda design, simulate or study "
            "wrote, or run the command that made it again"
        )
        raise BadInput(FIELD, str(path), mend)
    for record in records.values():
        again = shlex.join(["rigdda", *record.arguments])
        if not record.ended:
            mend = f"its run was interrupted or has not ended: run it again to go on: {again}"
            raise BadInput(FIELD, str(path), mend)
        for name in record.files:
            if name.endswith(NEEDED) and not (path / name).is_file():
                mend = f"this file is missing: put it back or run the command again: {again}"
                raise BadInput(FIELD, str(path / name), mend)
    return records


def replay_of(folders: Sequence[ResultsFolder]) -> Path:
    """Return the first replay in some results folders.

    Raises
    ------
    BadInput
        If there is none.
    """
    for folder in folders:
        for name in folder.files("*.rrd"):
            if (folder.path / name).is_file():
                return folder.path / name
    named = ", ".join(str(folder.path) for folder in folders)
    mend = "none has a replay (episode.rrd), which --serve shows: add a folder of rigdda design"
    raise BadInput(FIELD, named, mend)
