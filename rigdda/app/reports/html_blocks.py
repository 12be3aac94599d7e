"""Blocks of an HTML report, and the results folders whose content they show.

A folder gives its records, tables, pictures and sites; blocks are paragraphs, lists, tables and
pictures, ready for the template.
"""

from __future__ import annotations

import base64
import csv
import html
import io
import math
import re
import shlex
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cached_property
from pathlib import Path
from typing import Any

from rigdda import BadInput, DoubtfulInput, Site
from rigdda.agents import run_record
from rigdda.agents.run_record import RunRecord
from rigdda.app.reports.wording import at_most, euros, figure, percent
from rigdda.files import is_folder, read
from rigdda.rounding import NumberForm, Rounding, rounded

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
            return Site.parse(text, str(self.path / run_record.RECORD_FILE))

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
            hint = f"it lacks the column {lacking[0]!r}: run the command that made it again"
            raise BadInput(FIELD, str(file), hint)
        for number, row in enumerate(rows, 2):
            if len(row) != len(head):
                hint = f"repair line {number}, which has {len(row)} cells, not {len(head)}"
                raise BadInput(FIELD, str(file), f"{hint}, or run the command again")
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
    if not is_folder(path):
        hint = "name an existing folder that rigdda design, simulate or study wrote"
        raise BadInput(FIELD, str(path), hint)
    records = run_record.read(path)
    if not records:
        hint = (
            f"it has no {run_record.RECORD_FILE}: name a folder that rigdda design, simulate or "
            "study wrote, or run the command that made it again"
        )
        raise BadInput(FIELD, str(path), hint)
    for record in records.values():
        again = shlex.join(["rigdda", *record.arguments])
        if not record.ended:
            hint = f"its run was interrupted or has not ended: run it again to go on: {again}"
            raise BadInput(FIELD, str(path), hint)
        for name in record.files:
            if name.endswith(NEEDED) and not (path / name).is_file():
                hint = f"this file is missing: put it back or run the command again: {again}"
                raise BadInput(FIELD, str(path / name), hint)
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
    hint = "none has a replay (episode.rrd), which --serve shows: add a folder of rigdda design"
    raise BadInput(FIELD, named, hint)


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading within a section."""

    text: str
    kind: str = "heading"


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph of plain text; `mood` is "", "answer", "warning" or "good"."""

    text: str
    mood: str = ""
    kind: str = "paragraph"


@dataclass(frozen=True, slots=True)
class Items:
    """A list of sentences."""

    lines: Sequence[str]
    kind: str = "items"


@dataclass(frozen=True, slots=True)
class Figures:
    """A few key figures, each with its words, its value and a remark."""

    figures: Sequence[tuple[str, str, str]]
    kind: str = "figures"


@dataclass(frozen=True, slots=True)
class Listing:
    """Text in a fixed font, such as a command or a site file."""

    text: str
    title: str = ""
    kind: str = "listing"


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a table, with the columns of the CSV file that it shows."""

    text: str
    columns: str = ""
    number: bool = False


@dataclass(frozen=True, slots=True)
class Table:
    """A table with a caption.

    Parameters
    ----------
    title, words : str
        Title and explanation above the table.
    head : sequence of Cell
        Names of the columns.
    rows : sequence of (int, list of Cell)
        Number of each row in the CSV file, from 0, and its cells.
    source : str
        Folder and name of the CSV file; empty if the table is not from a file.
    """

    title: str
    words: str
    head: Sequence[Cell]
    rows: Sequence[tuple[int, Sequence[Cell]]]
    source: str = ""
    kind: str = "table"


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as inline markup with a caption."""

    title: str
    words: str
    markup: str
    kind: str = "picture"


Block = Heading | Paragraph | Items | Figures | Listing | Table | Picture

Row = dict[str, str]


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table of a report.

    Parameters
    ----------
    head : str
        Its name.
    names : tuple of str
        Columns of the CSV file that a cell shows.
    form : callable
        Function of their values that returns the text of a cell: numbers where `number`, with NaN
        for an empty cell, otherwise texts.
    number : bool
        Whether the values are numbers.
    """

    head: str
    names: tuple[str, ...]
    form: Callable[..., str]
    number: bool = True

    def cell(self, row: Row, where: str) -> Cell:
        """Return the cell of a row.

        Raises
        ------
        BadInput
            If a value is not a number; the message names `where`.
        """
        values: list[Any] = [
            _float(row[name], name, where) if self.number else row[name] for name in self.names
        ]
        return Cell(self.form(*values), " ".join(self.names), self.number)


def _float(text: str, name: str, where: str) -> float:
    """Return the number in a cell, NaN if it is empty."""
    if not text:
        return math.nan
    try:
        return float(text)
    except ValueError:
        hint = f"{text!r} in the column {name!r} is not a number: run the command again"
        raise BadInput(FIELD, where, hint) from None


def words(head: str, name: str) -> Column:
    """Return a column of texts."""
    return Column(head, (name,), _said, number=False)


def _said(text: str) -> str:
    return {"True": "yes", "False": "no"}.get(text, text)


def mixed(head: str, name: str) -> Column:
    """Return a column of texts and numbers, of which the numbers are rounded."""
    return Column(head, (name,), _rounded, number=False)


def _rounded(text: str) -> str:
    try:
        found = float(text)
    except ValueError:
        return text
    return figure(found) if math.isfinite(found) else text


def value(head: str, name: str, form: NumberForm = figure) -> Column:
    """Return a column of numbers, "-" where there is none."""
    return Column(head, (name,), lambda x: "-" if math.isnan(x) else form(x))


def interval(head: str, name: str, form: NumberForm = figure) -> Column:
    """Return a column of numbers with the ends of their intervals in brackets, if they differ.

    The ends are rounded outward.
    """
    return spread(head, (name, f"{name}_low", f"{name}_high"), form)


def spread(head: str, names: tuple[str, str, str], form: NumberForm = figure) -> Column:
    """Return a column like `interval` from three columns: the value and the ends."""

    def text(x: float, low: float, high: float) -> str:
        if math.isnan(x) or low == x == high:
            return "-" if math.isnan(x) else form(x)
        least = "?" if math.isnan(low) else form(low, "down")
        most = "?" if math.isnan(high) else form(high, "up")
        return f"{form(x)} ({least} to {most})"

    return Column(head, names, text)


def bounded(head: str, name: str) -> Column:
    """Return a column of probabilities with their upper bounds, rounded up, in brackets."""

    def text(x: float, bound: float) -> str:
        return "-" if math.isnan(x) else f"{percent(x)} (≤ {at_most(bound)})"

    return Column(head, (name, f"{name}_bound"), text)


def plain(value: float, rounding: Rounding = "nearest", /) -> str:
    """Return a number as it was given, such as a chainage."""
    return rounded(value, ".10g", rounding)


def money(head: str, name: str) -> Column:
    """Return a column of amounts of money."""
    return value(head, name, euros)


def usual_columns(head: Sequence[str], rows: Sequence[Row]) -> tuple[Column, ...]:
    """Return columns for a file of unknown content, with intervals joined to their values."""
    ends = {f"{name}_{end}" for name in head for end in ("low", "high")
            if {f"{name}_low", f"{name}_high"} <= {*head}}  # fmt: skip
    return tuple(_usual(name, ends, rows) for name in head if name not in ends)


def _usual(name: str, ends: set[str], rows: Sequence[Row]) -> Column:
    said = name.replace("_", " ").replace(".", ".\u200b")  # a path may break after a dot
    if not all(_is_number(row[name]) for row in rows):
        return words(said, name)
    form = plain if name in ("x", "x_m", "seed") else figure
    return interval(said, name, form) if f"{name}_low" in ends else value(said, name, form)


def _is_number(text: str) -> bool:
    try:
        return not text or math.isfinite(float(text))
    except ValueError:
        return False


def table(
    folder: ResultsFolder,
    name: str,
    title: str,
    explained: str = "",
    columns: Sequence[Column] = (),
    shown: Callable[[Row], bool] = lambda row: True,
) -> Table:
    """Return the table of a CSV file.

    Parameters
    ----------
    folder : ResultsFolder
        The folder.
    name : str
        The file.
    title, explained : str
        Title of the table, and its explanation.
    columns : sequence of Column
        Its columns; by default all columns of the file.
    shown : callable
        Function of a row that returns whether the row is shown.

    Raises
    ------
    BadInput
        If the file lacks a column, or a value in it is not a number.
    """
    needed = [column for own in columns for column in own.names]
    head, rows = folder.table(name, needed)
    kept = [(i, row) for i, row in enumerate(rows) if shown(row)]
    used = columns or usual_columns(head, rows)
    where = str(folder.path / name)
    cells = [(i, [column.cell(row, where) for column in used]) for i, row in kept]
    heads = [Cell(column.head, number=column.number) for column in used]
    return Table(title, explained, heads, cells, f"{folder.label}/{name}")


def listed(
    title: str,
    explained: str,
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[str] = (),
) -> Table:
    """Return a table of given texts; `numbers` are the columns of numbers."""
    heads = [Cell(name, number=name in numbers) for name in head]
    cells = [
        (i, [Cell(text, number=name in numbers) for name, text in zip(head, row, strict=True)])
        for i, row in enumerate(rows)
    ]
    return Table(title, explained, heads, cells)


def picture(file: Path, title: str, explained: str = "", mark: str = "") -> Picture:
    """Return a picture of an SVG file as inline markup, or of a PNG file as data.

    Parameters
    ----------
    file : path
        The file.
    title, explained : str
        Title and explanation below the picture.
    mark : str
        Word that makes the identifiers within the picture unique in the report.

    Raises
    ------
    BadInput
        If the file cannot be read or is not a picture.
    """
    name = html.escape(title, quote=True)
    if file.suffix == ".svg":
        return Picture(title, explained, inline(read(FIELD, file), name, mark, str(file)))
    data = base64.b64encode(file.read_bytes()).decode()
    markup = f'<img alt="{name}" src="data:image/png;base64,{data}">'
    return Picture(title, explained, markup)


def inline(text: str, name: str, mark: str, where: str) -> str:
    """Return an SVG document as markup within HTML: without head, with identifiers of its own.

    Raises
    ------
    BadInput
        If the text is not an SVG document.
    """
    found = re.search(r"<svg\b([^>]*)>(.*)</svg>", text, re.DOTALL)
    box = re.search(r'viewBox="([^"]*)"', found[1]) if found else None
    if found is None or box is None:
        hint = "this is not a picture: run the command that made it again"
        raise BadInput(FIELD, where, hint)
    body = re.sub(r"<metadata>.*?</metadata>", "", found[2], flags=re.DOTALL)
    body = re.sub(r'\bid="', f'id="{mark}-', body)
    body = re.sub(r"url\(#", f"url(#{mark}-", body)
    body = re.sub(r'href="#', f'href="#{mark}-', body)
    return (
        f'<svg role="img" aria-label="{name}" viewBox="{box[1]}" '
        f'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">'
        f"{body}</svg>"
    )
