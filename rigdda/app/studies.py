"""Studies: comparison of the layouts of a file on common releases, with a CSV row per release."""

from __future__ import annotations

import csv
import hashlib
import io
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

import rigdda
from rigdda import MECHANICS, BadInput, Layout, Outcome, Site, check
from rigdda.agents import limits
from rigdda.app.reports.study_report import StudiedLayout, StudyResults
from rigdda.app.reports.tables import (
    BARRIER_COLUMNS,
    OUTCOME_COLUMNS,
    RUN_OUT_COLUMNS,
    outcome_row,
    write_rows,
)
from rigdda.barriers import from_table
from rigdda.envs.cost import Account
from rigdda.envs.outcome_cache import fingerprint
from rigdda.fields import about, checked, parse
from rigdda.files import is_file, read


@dataclass(frozen=True, slots=True)
class Study:
    """Named layouts on one site.

    Parameters
    ----------
    site : Site
        The site.
    releases : int
        Number of releases of each event with each layout.
    layouts : dict of str to Layout
        The layouts by name.
    source : str
        Name of the site, or its file.
    """

    site: Site
    releases: int
    layouts: dict[str, Layout]
    source: str = ""

    @property
    def size(self) -> int:
        """Total number of releases."""
        return self.releases * len(self.layouts) * len(self.site.events)


class _LayoutTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: Annotated[str, about("Name of the layout.")]
    barriers: Annotated[tuple[dict[str, Any], ...], about("The barriers.")] = ()
    file: Annotated[str | None, about("A layout file, instead of barriers.")] = None


class _StudyFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    site: Annotated[str, about("Name of a site, or a site file.")]
    layouts: Annotated[tuple[_LayoutTable, ...], about("The layouts, each with a name.")]
    releases: Annotated[int, about("Number of releases of each event with each layout.", ge=1)] = 16


def load(path: str | os.PathLike[str]) -> Study:
    """Read a study from a TOML file; file names in it are relative to its folder.

    Raises
    ------
    BadInput
        If the file is missing, a field is unknown or a value is outside its range.
    """
    file = Path(path)
    if not is_file(file):
        raise BadInput("study", str(path), "name an existing TOML file")
    data = _StudyFile(**checked(_StudyFile, parse("study", str(path), read("study", file))))
    near = file.parent / data.site
    source = str(near) if near.suffix == ".toml" else data.site
    site = Site.load(source)
    layouts: dict[str, Layout] = {}
    faults: list[BadInput] = []
    for i, table in enumerate(data.layouts):
        if table.name in layouts or not table.name:
            hint = "give each layout a name of its own"
            faults.append(BadInput(f"layouts[{i}].name", table.name, hint))
            continue
        layouts[table.name], found = _layout(site, table, file.parent)
        faults += [BadInput(f"layouts.{table.name}.{f.field}", f.value, f.hint) for f in found]
    if faults:
        raise _together(faults)
    if not layouts:
        raise BadInput("layouts", 0, "give at least one table [[layouts]]")
    most = limits.JOB_RELEASES // len(layouts) // len(site.events)
    releases = check.integer("releases", data.releases, 1, most)
    return Study(site, releases, layouts, source)


def _layout(site: Site, table: _LayoutTable, folder: Path) -> tuple[Layout, list[BadInput]]:
    """Return the layout of one table and all reasons why it cannot be simulated."""
    try:
        if table.file is not None:
            if table.barriers:
                raise BadInput("file", table.file, "give either a file or barriers, not both")
            layout, faults = rigdda.load_layout(folder / table.file), list[BadInput]()
        else:
            layout, faults = _barriers(table.barriers)
    except BadInput as bad:
        return (), [bad]
    return layout, faults or _impossible(site, layout)


def _impossible(site: Site, layout: Layout) -> list[BadInput]:
    """Return an error for each barrier that cannot be simulated, or for all of them together."""
    faults: list[BadInput] = []
    for part in (*((barrier,) for barrier in layout), layout):
        try:
            site.realise(part, event=site.event_names[0])  # rates may not be known yet
            check.number("capital", site.capital(part))
        except BadInput as bad:
            if part != layout or not faults:
                faults.append(bad)
    return faults


def _barriers(rows: Sequence[dict[str, Any]]) -> tuple[Layout, list[BadInput]]:
    """Return the barriers of some tables, and an error for each table that has no barrier."""
    found, faults = [], []
    for i, row in enumerate(rows):
        try:
            found.append(from_table(f"barriers[{i}]", row))
        except BadInput as bad:
            faults.append(bad)
    return tuple(found), faults


def _together(faults: Sequence[BadInput]) -> BadInput:
    """Return one error that names all faults."""
    first, *others = faults
    return BadInput(first.field, first.value, "; also ".join([first.hint, *map(str, others)]))


Tick = Callable[[int, str], None]
Job = tuple[str, str, int]
"""Name of the layout, name of the event and seed of one release."""

CHUNK = 64
"""Number of releases that are simulated together before their rows are written."""

_NUMBERS = (
    "width", "released_volume", "reached", *OUTCOME_COLUMNS, *RUN_OUT_COLUMNS,
)  # fmt: skip
"""Columns with numbers of an outcome, without those of the barriers."""

_MONEY = ("harm", "repair")
"""Columns with the costs of a release [EUR per occurrence of its event]."""

_TRAFFIC_COLUMNS = ("vehicles_hit", "vehicles_run_into", "fatalities")
"""Columns with the expected consequences of a release for the traffic, if the site gives it."""


def run(study: Study, seed: int, path: Path, tick: Tick) -> int:
    """Simulate the releases that a CSV file does not contain yet and append them to it.

    Rows are appended in groups as they are computed. At the end, the rows are sorted in the order
    of the study, and rows of other layouts and seeds are removed. Each row has a key, which is a
    hash of everything that its release depends on.

    Returns
    -------
    int
        Number of rows that the file contained before.

    Raises
    ------
    BadInput
        If the file is not the table of a study.
    Diverged
        If a simulation diverges.
    """
    jobs = {_key(study, *job): job for job in _jobs(study, seed)}
    fields = _fields(study)
    found = {row["key"]: row for row in _read(path, fields)}
    rows = {key: row for key, row in found.items() if key in jobs and _sound(row, study, jobs[key])}
    known = len(rows)
    write_rows(path, list(rows.values()), fields)
    todo = [(key, job) for key, job in jobs.items() if key not in rows]
    with path.open("a", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, fields, restval="")
        for start in range(0, len(todo), CHUNK):
            part = todo[start : start + CHUNK]
            asked = [(study.site, study.layouts[n], s, e) for _, (n, e, s) in part]
            for (key, job), outcome in zip(part, rigdda.release_many(asked), strict=True):
                rows[key] = _row(study, job, outcome) | {"key": key}
                table.writerow(rows[key])
            file.flush()
            tick(len(rows), part[-1][1][0])
    write_rows(path, [rows[key] for key in jobs], fields)
    return known


def _jobs(study: Study, seed: int) -> Iterator[Job]:
    """Yield the name of the layout, the event and the seed of every release."""
    for name in study.layouts:
        for event in study.site.event_names:
            for s in range(seed, seed + study.releases):
                yield name, event, s


def _row(study: Study, job: Job, outcome: Outcome) -> dict[str, Any]:
    """Return the row of a release, without its key."""
    layout = study.layouts[job[0]]
    bill = study.site.bill(layout, outcome)
    row: dict[str, Any] = {"layout": job[0], "seed": job[2]}
    row |= {"capital": study.site.capital(layout), "harm": bill.harm, "repair": bill.repair}
    if study.site.traffic is not None:
        row |= zip(
            _TRAFFIC_COLUMNS,
            map(float, study.site.traffic_consequences(layout, outcome)),
            strict=True,
        )
    return row | outcome_row(outcome)


def _key(study: Study, name: str, event: str, seed: int) -> str:
    """Return a hash of everything that a row depends on."""
    built = list(study.layouts[name])
    site = fingerprint(study.site).hex()
    asked = [rigdda.__version__, MECHANICS, site, name, built, event, seed]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:16]


def _fields(study: Study) -> list[str]:
    """Return the columns, with those of as many barriers as the largest layout has."""
    most = max(len(study.site.standing(layout)) for layout in study.layouts.values())
    barriers = [f"barrier_{i}_{name}" for i in range(most) for name in BARRIER_COLUMNS]
    money = _money(study.site)
    return ["layout", "event", "seed", "capital", *money, *_NUMBERS, *barriers, "key"]


def _money(site: Site) -> tuple[str, ...]:
    """Return the columns with costs and, for a site with traffic, those with its risk."""
    return _MONEY if site.traffic is None else (*_MONEY, *_TRAFFIC_COLUMNS)


def _read(path: Path, fields: list[str]) -> list[dict[str, Any]]:
    """Return the complete rows of a file, which may be of layouts with more or fewer barriers.

    Raises
    ------
    BadInput
        If the file is not the table of a study.
    """
    text = path.read_bytes().decode(errors="replace") if is_file(path) else ""
    if not text:
        return []
    head, *rows = [*_lines(text)] or [[]]
    if not {name for name in fields if not name.startswith("barrier_")} <= set(head):
        hint = (
            "this is not a study table of this version: move it away or name another folder with "
            "--out"
        )
        raise BadInput("study table", str(path), hint)
    if not text.endswith("\n"):  # the last row is incomplete because the process was killed
        rows = rows[:-1]
    found = (dict(zip(head, row, strict=False)) for row in rows)
    return [{name: row.get(name, "") for name in fields} for row in found]


def _lines(text: str) -> Iterator[list[str]]:
    """Yield the rows of a CSV file and skip those that cannot be read."""
    rows = csv.reader(io.StringIO(text, newline=""))
    while True:
        try:
            yield next(rows)
        except csv.Error:
            continue
        except StopIteration:
            return


def _sound(row: dict[str, Any], study: Study, job: Job) -> bool:
    """Return whether a row belongs to this release and contains all its numbers."""
    name, event, seed = job
    layout = study.layouts[name]
    if (row["layout"], row["event"], row["seed"]) != (name, event, str(seed)):
        return False
    if _number(row["capital"]) != study.site.capital(layout):
        return False
    mine = {
        f"barrier_{i}_{hit}"
        for i in range(len(study.site.standing(layout)))
        for hit in BARRIER_COLUMNS
    }
    said = {field for field, text in row.items() if field.startswith("barrier_") and text}
    wanted = {*mine, *_NUMBERS, *_money(study.site)}
    return said == mine and all(math.isfinite(_number(row[field])) for field in wanted)


def _number(text: str) -> float:
    """Return the number in a cell: 1 for True, 0 for False and NaN if it is not a number."""
    try:
        return check.parsed({"True": "1", "False": "0"}.get(text, text))
    except ValueError:
        return math.nan


def releases(study: Study, path: Path) -> list[dict[str, Any]]:
    """Return the rows of the complete CSV file of a study, one per release."""
    return _read(path, _fields(study))


def results(study: Study, path: Path) -> StudyResults:
    """Return the results of a study from its complete CSV file."""
    rows, site = releases(study, path), study.site
    layouts = []
    for name, layout in study.layouts.items():
        own = [row for row in rows if row["layout"] == name]
        layouts.append(
            StudiedLayout(
                name,
                layout,
                _account(site, own),
                on_road=1e-3 * _column(own, "max_energy_on_road"),
                hit=1e-3 * np.array([_hit(row) for row in own]),
                released=_column(own, "released_volume"),
                widths=_column(own, "width"),
            )
        )
    return StudyResults.of(site, layouts)


def _column(rows: Sequence[dict[str, str]], name: str) -> NDArray[np.float64]:
    """Return the numbers of a column."""
    return np.array([_number(row[name]) for row in rows])


def _hit(row: dict[str, str]) -> float:
    """Return the largest energy of a hit on any barrier in a release [J/m]."""
    found = [
        _number(text)
        for name, text in row.items()
        if name.startswith("barrier_") and name.endswith("_max_energy") and text
    ]
    return max(found, default=0.0)


def _account(site: Site, rows: Sequence[dict[str, str]]) -> Account:
    """Return the account of the releases in some rows."""
    said = [[text for name, text in row.items() if _tells_failure(name)] for row in rows]
    return Account(
        event=np.array([row["event"] for row in rows]),
        harm=_column(rows, "harm"),
        repair=_column(rows, "repair"),
        volume=_column(rows, "road_volume"),
        reached=_column(rows, "reached") > 0.0,
        failed=np.array(["True" in texts for texts in said], dtype=bool),
        toll=None
        if site.traffic is None
        else np.column_stack([_column(rows, n) for n in _TRAFFIC_COLUMNS]),
    )


def _tells_failure(field: str) -> bool:
    return field.startswith("barrier_") and field.endswith("_failed")
