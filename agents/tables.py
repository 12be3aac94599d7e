"""Results as tables: rows of a CSV file and what the command line prints."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.protocol import Entry
from envs import Evaluation
from envs.evaluation import student_interval
from rigdda import Fence, GravityWall, Layout, Outcome, Site
from rigdda.barriers import Barrier, Earthwork, describe, to_tables
from rigdda.files import atomic

if TYPE_CHECKING:
    from rich.table import Table

OUTCOME = {
    "debris_fraction": ("debris past the road's edge", "%", 100.0),
    "debris_on_road": ("debris on the road at the end", "m2", 1.0),
    "max_energy_on_road": ("largest energy on the road", "kJ/m", 1e-3),
    "slope_fraction": ("at the end on the slope", "%", 100.0),
    "held_fraction": ("at the end behind barriers", "%", 100.0),
    "road_fraction": ("at the end on the road", "%", 100.0),
    "beyond_fraction": ("at the end beyond the road", "%", 100.0),
}
"""Field of an outcome: words, unit and factor for printing."""

HIT = {
    "hits": ("hits", "-", 1.0),
    "max_energy": ("largest energy of a hit", "kJ/m", 1e-3),
    "total_energy": ("energy of all hits", "kJ/m", 1e-3),
    "absorbed_energy": ("energy absorbed", "kJ/m", 1e-3),
    "overtopped": ("blocks that passed", "-", 1.0),
    "caught": ("mass at rest behind or in it", "%", 100.0),
    "failed": ("failed", "%", 100.0),
    "displacement": ("displacement", "m", 1.0),
}
"""The same of a barrier."""

ONLY = {"failed": Fence, "displacement": GravityWall}
"""Kind of which alone a field of a barrier says anything."""


class EvaluationsFile:
    """A CSV file with one row an evaluated layout, written as they come.

    `barriers` is a JSON list of tables as in a layout file. Usable as a context manager.
    """

    FIELDS = (
        "simulations", "stage", "releases", "objective", "objective_low", "objective_high",
        "debris", "debris_low", "debris_high", "cost", "barriers",
    )  # fmt: skip

    def __init__(self, path: str | os.PathLike[str]):
        self._file = Path(path).open("w", newline="", encoding="utf-8")
        self._rows = csv.writer(self._file)
        self._rows.writerow(self.FIELDS)

    def __enter__(self) -> EvaluationsFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, entry: Entry) -> None:
        """Write one row and flush it."""
        e = entry.evaluation
        barriers = json.dumps(to_tables(e.layout))
        numbers = (len(e.seeds), e.objective, *e.ci, e.debris, *e.debris_ci, e.cost)
        self._rows.writerow((entry.simulations, entry.stage, *numbers, barriers))
        self._file.flush()


def write_outcomes(
    path: str | os.PathLike[str], seeds: Sequence[int], outcomes: Sequence[Outcome]
) -> None:
    """Write a CSV file with one row a release: its seed, its outcome, what each barrier took."""
    rows = []
    for seed, outcome in zip(seeds, outcomes, strict=True):
        rows.append({"seed": seed} | outcome_row(outcome))
    write_rows(path, rows)


def outcome_row(outcome: Outcome) -> dict[str, Any]:
    """Return an outcome, and what each barrier took, as columns of a CSV file."""
    row: dict[str, Any] = {"released_mass": outcome.released_mass}
    row |= {name: getattr(outcome, name) for name in OUTCOME}
    row |= zip(("run_out_50", "run_out_95", "run_out_100"), outcome.run_out, strict=True)
    for i, barrier in enumerate(outcome.barriers):
        row |= {f"barrier_{i}_{name}": getattr(barrier, name) for name in HIT}
    return row


def write_rows(
    path: str | os.PathLike[str],
    rows: Sequence[dict[str, Any]],
    fields: Sequence[str] | None = None,
) -> None:
    """Write a CSV file with one row a dictionary.

    `fields` are the columns, by default the keys of the first row; a row may lack some.
    """
    with atomic(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, rows[0] if fields is None else fields, restval="")
        table.writeheader()
        table.writerows(rows)


def outcomes(layout: Layout, results: Sequence[Outcome]) -> Table:
    """Return the table of means over releases."""
    table = empty_table(("", "mean", "95 % interval"))

    def add(words: str, unit: str, factor: float, values: list[float], low: float = 0.0) -> None:
        sample = factor * np.array(values)
        interval = np.clip(student_interval(sample), low, 100.0 if unit == "%" else None)
        table.add_row(f"{words} [{unit}]", f"{sample.mean():.4g}", _span(interval, ".4g"))

    for name, (words, unit, factor) in OUTCOME.items():
        add(words, unit, factor, [getattr(outcome, name) for outcome in results])
    run_out = [outcome.run_out[1] for outcome in results]
    add("run-out of 95 % of the mass", "m", 1.0, run_out, -math.inf)
    for i, barrier in enumerate(layout):
        table.add_section()
        table.add_row(describe(barrier))
        earthwork = isinstance(barrier, Earthwork)
        for name, (words, unit, factor) in HIT.items():
            if earthwork and name not in ("overtopped", "caught"):
                continue
            if not isinstance(barrier, ONLY.get(name, object)):
                continue
            add(f"  {words}", unit, factor, [getattr(o.barriers[i], name) for o in results])
    return table


def designs(cases: Iterable[tuple[str, Evaluation]]) -> Table:
    """Return the table of verified layouts, at most 80 characters wide."""
    table = empty_table(("layout", "debris [%] (95 %)", "objective (95 %)", "cost"))
    for name, e in cases:
        low, high = e.debris_ci
        debris = f"{100 * e.debris:.1f} ({_span((100 * low, 100 * high), '.1f')})"
        table.add_row(name, debris, f"{e.objective:.3f} ({_span(e.ci, '.3f')})", f"{e.cost:.1f}")
    return table


def failures(barrier: Barrier, index: int, results: Sequence[Outcome]) -> str:
    """Return in how many releases a fence, the barrier of this index of a layout, fails, in words.

    Nothing for what cannot fail.
    """
    if not isinstance(barrier, Fence):
        return ""
    failed = sum(outcome.barriers[index].failed for outcome in results)
    return f", fails in {failed} of {len(results)} releases"


def sites(found: Iterable[Site]) -> Table:
    """Return the table of sites."""
    table = empty_table(("site", "height [m]", "blocks", "road [m]", "description"))
    for site in found:
        heights = [y for _, y in site.slope.points]
        road = f"{site.road.start:g} to {site.road.end:g}"
        blocks = str(len(site.realise().blocks))
        words = shorten(site.description, 120, placeholder=" ...")
        table.add_row(site.name, f"{max(heights) - min(heights):g}", blocks, road, words)
    return table


def empty_table(head: Sequence[str]) -> Table:
    """Return an empty table: words on the left, numbers to the right."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD)
    for i, name in enumerate(head):
        table.add_column(name, justify="left" if i == 0 or name == "description" else "right")
    return table


def _span(interval: Iterable[float], form: str) -> str:
    """Return an interval in words; a single value has none."""
    low, high = interval
    return f"{low:{form}} to {high:{form}}" if math.isfinite(high - low) else "-"
