"""Run-outs of a site by event, observed and computed."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Site, check, release_many
from rigdda.files import read as read_text
from rigdda.lumped_mass import lumped

Floats = NDArray[np.float64]
Model = Literal["blocks", "lumped"]


def read(path: Path, site: Site) -> dict[str, Floats]:
    """Return the observed run-outs [m], as chainages of the site, of each event.

    Raises
    ------
    BadInput
        If the file is no table with `run_out_m` and, where the site has several, `event`, or a
        run-out is beyond the road, where computed ones are cut.
    """
    if not path.is_file():
        raise BadInput("observed", str(path), "name a CSV file with event and run_out_m")
    found: dict[str, list[float]] = {}
    only = site.event_names[0] if len(site.events) == 1 else ""
    for field, row in _rows(path, only):
        event = row.get("event") or only
        if event not in site.event_names:
            raise BadInput(f"{field} event", event, "choose " + " or ".join(site.event_names))
        found.setdefault(event, []).append(_run_out(f"{field} run_out_m", row["run_out_m"], site))
    if sum(map(len, found.values())) < 3:
        raise BadInput("observed", str(path), "give three observed runs or more")
    return {event: np.array(values) for event, values in found.items()}


def _rows(path: Path, only: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield what to call each row of a table, and its cells; `only` is the only event, if so."""
    table = csv.reader(io.StringIO(read_text("observed", path), newline=""))
    try:
        names, *rows = [row for row in table if any(row)] or [[]]
    except csv.Error as error:
        raise BadInput("observed", str(path), f"mend its line {table.line_num}: {error}") from None
    if "run_out_m" not in names or not ("event" in names or only):
        mend = "head its columns event and run_out_m"
        raise BadInput("observed", ", ".join(names), mend)
    if len(set(names)) < len(names):
        raise BadInput("observed", ", ".join(names), "head each column with a name of its own")
    for i, row in enumerate(rows):
        if len(row) != len(names):
            mend = f"give {len(names)} cells, one a heading; a number has a decimal point"
            raise BadInput(f"observed row {i + 1}", ",".join(row), mend)
        yield f"observed row {i + 1}", dict(zip(names, row, strict=True))


def _run_out(field: str, text: str, site: Site) -> float:
    """Return the run-out of a row of observations [m]."""
    try:
        value = float(text if "_" not in text else "")  # Python takes 4_0 for 40
    except ValueError:
        raise BadInput(field, text, "give a number") from None
    check.number(field, value, site.slope.points[0][0], site.slope.points[-1][0])
    if value > site.road.end:
        mend = f"put road.end beyond it: computed run-outs are cut there, at {site.road.end:g} m"
        raise BadInput(field, value, mend)
    return value


def run_outs(site: Site, model: Model, events: Sequence[str], seeds: range) -> dict[str, Floats]:
    """Return the computed run-outs of each event [m]: of a group, of its last block."""
    if model == "lumped":
        found = {event: lumped(site, (), seeds, event) for event in events}
        return {e: np.array([p.run_out[p.release == k].max() for k in range(len(seeds))])
                for e, p in found.items()}  # fmt: skip
    outcomes = release_many([(site, (), seed, event) for event in events for seed in seeds])
    each = np.array([outcome.run_out[2] for outcome in outcomes]).reshape(len(events), len(seeds))
    return dict(zip(events, each, strict=True))
