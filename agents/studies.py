"""Scripted studies: every layout of a file in the same releases, one row each in a CSV file."""

from __future__ import annotations

import csv
import hashlib
import io
import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

import rigdda
from agents import limits
from agents.store import mechanics
from agents.tables import HIT, OUTCOME, empty_table, outcome_row, write_rows
from envs.evaluation import student_interval
from rigdda import BadInput, Layout, Outcome, Site, check
from rigdda.barriers import from_table
from rigdda.files import read

if TYPE_CHECKING:
    from rich.table import Table

Tick = Callable[[int, str], None]

_NUMBERS = ("released_mass", *OUTCOME, "run_out_50", "run_out_95", "run_out_100")
"""Columns of an outcome, without what each barrier took."""


@dataclass(frozen=True, slots=True)
class Study:
    """Named layouts on one site.

    Parameters
    ----------
    site : Site
        Where.
    releases : int
        Releases of each layout.
    layouts : dict of str to Layout
        What stands, by its name.
    """

    site: Site
    releases: int
    layouts: dict[str, Layout]

    @property
    def size(self) -> int:
        """Releases in all."""
        return self.releases * len(self.layouts)


class _LayoutTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: str
    barriers: tuple[dict[str, Any], ...] = ()
    file: str | None = None


class _StudyFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    site: str
    layouts: tuple[_LayoutTable, ...]
    releases: int = 16


def load(path: str | os.PathLike[str]) -> Study:
    """Read a study from a TOML file; files that it names lie relative to it.

    Raises
    ------
    BadInput
        If the file is missing, a field is unknown or a value is outside its range.
    """
    file = Path(path)
    if not file.is_file():
        raise BadInput("study", str(path), "name an existing TOML file")
    try:
        data = msgspec.toml.decode(read("study", file), type=_StudyFile)
    except msgspec.ValidationError as error:
        raise BadInput("study", str(path), str(error)) from None
    except (msgspec.DecodeError, RecursionError) as error:
        raise BadInput("study", str(path), f"mend its TOML: {error}") from None
    near = file.parent / data.site
    site = Site.load(near if near.suffix == ".toml" else data.site)
    layouts: dict[str, Layout] = {}
    for i, table in enumerate(data.layouts):
        if table.name in layouts:
            raise BadInput(f"layouts[{i}].name", table.name, "give each layout a name of its own")
        layouts[table.name] = _layout(f"layouts[{i}]", table, file.parent)
        site.realise(layouts[table.name])  # what cannot be built is said before all
        check.number(f"cost of layouts[{i}]", site.cost(layouts[table.name]))
    if not layouts:
        raise BadInput("layouts", 0, "give at least one table [[layouts]]")
    releases = check.integer("releases", data.releases, 1, limits.RELEASES // len(layouts))
    return Study(site, releases, layouts)


def _layout(field: str, table: _LayoutTable, folder: Path) -> Layout:
    """Return the layout of one table."""
    if table.file is None:
        rows = enumerate(table.barriers)
        return tuple(from_table(f"{field}.barriers[{i}]", row) for i, row in rows)
    if table.barriers:
        raise BadInput(f"{field}.file", table.file, "give either a file or barriers, not both")
    return rigdda.load_layout(folder / table.file)


def run(study: Study, seed: int, path: Path, tick: Tick) -> int:
    """Simulate what a CSV file does not hold yet; return how many rows it held.

    Every row is appended as soon as it and those before it are done; at the end the rows lie in the
    order of the study, and rows of other layouts and seeds are gone. A row is known again by its
    key: a hash of all that its release depends on.

    Raises
    ------
    BadInput
        If the file is not that of a study.
    Diverged
        If a simulation diverges.
    """
    jobs = {_key(study, name, s): (name, s) for name, s in _jobs(study, seed)}
    fields = _fields(study)
    found = {row["key"]: row for row in _read(path, fields)}
    rows = {key: row for key, row in found.items() if key in jobs and _sound(row, study, jobs[key])}
    known = len(rows)
    write_rows(path, list(rows.values()), fields)
    todo = {key: job for key, job in jobs.items() if key not in rows}
    with path.open("a", newline="", encoding="utf-8") as file, ThreadPoolExecutor() as pool:
        table = csv.DictWriter(file, fields, restval="")
        outcomes = pool.map(lambda job: _release(study, *job), todo.values())
        for (key, (name, s)), outcome in zip(todo.items(), outcomes, strict=True):
            cost = study.site.cost(study.layouts[name])
            rows[key] = {"layout": name, "seed": s, "cost": cost} | outcome_row(outcome)
            rows[key]["key"] = key
            table.writerow(rows[key])
            file.flush()
            tick(len(rows), name)
    write_rows(path, [rows[key] for key in jobs], fields)
    return known


def _jobs(study: Study, seed: int) -> Iterator[tuple[str, int]]:
    """Yield the name of the layout and the seed of every release."""
    for name in study.layouts:
        for s in range(seed, seed + study.releases):
            yield name, s


def _release(study: Study, name: str, seed: int) -> Outcome:
    return rigdda.release_outcome(study.site, study.layouts[name], seed)


def _key(study: Study, name: str, seed: int) -> str:
    """Return a hash of all that a row depends on."""
    asked = [rigdda.__version__, mechanics(), study.site, name, list(study.layouts[name]), seed]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:16]


def _fields(study: Study) -> list[str]:
    """Return the columns: those of the layout with most barriers."""
    most = max(map(len, study.layouts.values()))
    barriers = [f"barrier_{i}_{name}" for i in range(most) for name in HIT]
    return ["layout", "seed", "cost", *_NUMBERS, *barriers, "key"]


def _read(path: Path, fields: list[str]) -> list[dict[str, Any]]:
    """Return the whole rows of a file, those of more or fewer barriers too.

    Raises
    ------
    BadInput
        If the file is not that of a study.
    """
    text = path.read_bytes().decode(errors="replace") if path.is_file() else ""
    if not text:
        return []
    head, *rows = [*_lines(text)] or [[]]
    if not {name for name in fields if not name.startswith("barrier_")} <= set(head):
        mend = "this is no study of this version: move it away or name another folder with --out"
        raise BadInput("study table", str(path), mend)
    if not text.endswith("\n"):  # a kill has left the last row unfinished
        rows = rows[:-1]
    found = (dict(zip(head, row, strict=False)) for row in rows)
    return [{name: row.get(name, "") for name in fields} for row in found]


def _lines(text: str) -> Iterator[list[str]]:
    """Yield the rows of a CSV file; one that cannot be read is passed over."""
    rows = csv.reader(io.StringIO(text, newline=""))
    while True:
        try:
            yield next(rows)
        except csv.Error:
            continue
        except StopIteration:
            return


def _sound(row: dict[str, Any], study: Study, job: tuple[str, int]) -> bool:
    """Return whether a row is of this layout and seed, with a number wherever one belongs."""
    name, seed = job
    layout = study.layouts[name]
    if (row["layout"], row["seed"]) != (name, str(seed)):
        return False
    if _number(row["cost"]) != study.site.cost(layout):
        return False
    mine = {f"barrier_{i}_{hit}" for i in range(len(layout)) for hit in HIT}
    said = {field for field, text in row.items() if field.startswith("barrier_") and text}
    numbers = [text for field, text in row.items() if field in mine or field in _NUMBERS]
    return said == mine and all(math.isfinite(_number(text)) for text in numbers)


def _number(text: str) -> float:
    """Return the number that stands in a cell, 1 and 0 for True and False; NaN if there is none."""
    try:
        return float({"True": "1", "False": "0"}.get(text, text))
    except ValueError:
        return math.nan


def table(study: Study, path: Path) -> Table:
    """Return the table of means over releases with their 95 % intervals."""
    out = empty_table(("layout", "cost", "debris [%] (95 %)", "largest energy on the road [kJ/m]"))
    rows = _read(path, _fields(study))
    for name, layout in study.layouts.items():
        own = [row for row in rows if row["layout"] == name]
        debris = 100.0 * np.array([float(row["debris_fraction"]) for row in own])
        low, high = np.clip(student_interval(debris), 0.0, 100.0)
        energy = max(float(row["max_energy_on_road"]) for row in own) / 1e3
        words = f"{debris.mean():.1f} ({low:.1f} to {high:.1f})"
        out.add_row(name, f"{study.site.cost(layout):.1f}", words, f"{energy:.0f}")
    return out
