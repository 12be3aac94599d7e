"""Observations of rockfall to which a site is fitted, read from CSV files.

A file has one of three forms, which are distinguished by their columns: run-outs of single blocks,
a deposit (the mass that lies in each interval of chainage), or quantities of blocks that pass a
station.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Site, check
from rigdda.agents.limits import JOB_RELEASES
from rigdda.app.reports.stations import QUANTITIES
from rigdda.files import is_file
from rigdda.files import read as read_text
from rigdda.passages import ends
from rigdda.rounding import chainage

Floats = NDArray[np.float64]

OBSERVED_RUN_OUT, DEPOSIT = "run-out", "deposit"

AMOUNTS = ("share", "mass_t", "volume_m3")
"""Columns of which a deposit has one. Only the proportions between its intervals count."""

FORMS = (
    "run_out_m; or start_m, end_m and share, mass_t or volume_m3; or station_m, quantity and value"
)
"""Columns of the three forms besides `event`."""

LEAST_VALUES = 3
"""Least number of observed values."""


class DataSet(NamedTuple):
    """Observed values of one quantity of one event.

    Parameters
    ----------
    quantity : str
        "run-out", "deposit", or a quantity of a passage: a key of
        `rigdda.app.reports.stations.QUANTITIES`.
    event : str
        Name of the event.
    values : (n,) array
        The values; of a deposit, the ends of its intervals (n = J + 1) [m].
    station : float
        Chainage of the station of a passage [m].
    shares : (J,) array
        Shares of the rock of a deposit in its intervals; they add up to 1.
    releases : int
        Number of releases that made a deposit.
    """

    quantity: str
    event: str
    values: Floats
    station: float = math.nan
    shares: Floats = np.zeros(0)
    releases: int = 1

    @property
    def name(self) -> str:
        """Name in tables: that of the event and, except for run-outs, the quantity."""
        if self.quantity == OBSERVED_RUN_OUT:
            return self.event
        at = "" if math.isnan(self.station) else f" at {chainage(self.station)} m"
        return f"{self.event}, {self.quantity}{at}"

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return QUANTITIES[self.quantity].unit if self.quantity in QUANTITIES else "m"

    @property
    def passes(self) -> bool:
        """Whether it is a quantity of passages."""
        return self.quantity in QUANTITIES

    def sample(self, count: int) -> Floats:
        """Return chainages (count,) at which the blocks of a deposit may lie [m].

        They have the distribution of the deposit, with the rock of an interval evenly spread.
        """
        place = (np.arange(count) + 0.5) / count
        return np.interp(place, np.concatenate([[0.0], np.cumsum(self.shares)]), self.values)


DataSets = Mapping[str, DataSet]
"""Observations by their names."""


def read(paths: Sequence[Path], site: Site) -> dict[str, DataSet]:
    """Return the observations in some files, by name.

    Raises
    ------
    BadInput
        If a file is not a table with the columns of one of the three forms and, for a site with
        several events, `event`; if a run-out is beyond the road, where computed run-outs are cut
        off; if no block of an event can pass a station; if intervals have gaps; if the names of two
        sets of observations are the same, see `DataSet.name`; or if there are fewer than three
        values or two intervals.
    """
    found: dict[str, DataSet] = {}
    for path in paths:
        for one in _read(path, site):
            if one.name in found:
                raise _repeated(path, found[one.name], one)
            found[one.name] = one
    if sum(len(one.values) for one in found.values()) < LEAST_VALUES:
        raise BadInput("observed", str(paths[0]), "give three observed runs or more")
    return found


def _repeated(path: Path, first: DataSet, second: DataSet) -> BadInput:
    """Return the error for observations in a file that have the name of earlier ones."""
    where, event = f"observed {path}", second.event
    if (first.event, first.quantity) != (event, second.quantity):
        hint = f"rename this event: {second.name!r} would be the name of observations of the event "
        hint += f"{first.event!r}, too"
        return BadInput(f"{where} event", event, hint)
    if first.station != second.station and second.passes:
        hint = f"give {first.station!r} for both, or stations that are farther apart: in tables, "
        hint += f"both would be at {chainage(first.station)} m"
        return BadInput(f"{where} station_m", second.station, hint)
    return BadInput("observed", str(path), f"give the observations {first.name!r} in one file only")


def _read(path: Path, site: Site) -> list[DataSet]:
    """Return the observations in a file."""
    if not is_file(path):
        raise BadInput("observed", str(path), "name a CSV file with event and run_out_m")
    only = site.event_names[0] if len(site.events) == 1 else ""
    where = f"observed {path}"
    names, rows = _table(path, only)
    each = list(_rows(where, names, rows))
    for field, row in each:
        event = row.setdefault("event", only) or only
        if event not in site.event_names:
            raise BadInput(f"{field} event", event, "choose " + " or ".join(site.event_names))
        row["event"] = event
    if "run_out_m" in names:
        return _run_outs(each, site)
    return _passages(each, site) if "station_m" in names else _deposits(where, each, names, site)


Row = tuple[str, dict[str, str]]


def _table(path: Path, only: str) -> tuple[list[str], list[list[str]]]:
    """Return the columns of a file and its rows of cells.

    `only` is the event of a site with a single event, otherwise an empty text.
    """
    table = csv.reader(io.StringIO(read_text("observed", path), newline=""))
    try:
        names, *rows = [row for row in table if any(row)] or [[]]
    except csv.Error as error:
        raise BadInput("observed", str(path), f"repair line {table.line_num}: {error}") from None
    amounts = [name for name in AMOUNTS if name in names]
    forms = (
        "run_out_m" in names,
        {"start_m", "end_m"} <= set(names) and len(amounts) == 1,
        {"station_m", "quantity", "value"} <= set(names),
    )
    if sum(forms) != 1 or not ("event" in names or only):
        hint = f"name its columns event and {FORMS} in the first row"
        if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
            hint = "separate its columns with commas and write numbers with a decimal point"
        raise BadInput(f"observed {path}", ", ".join(names), hint)
    check.distinct(f"observed {path}", names)
    return names, rows


def _rows(where: str, names: list[str], rows: list[list[str]]) -> Iterator[Row]:
    """Yield a name for each row of the table `where` and its cells by column."""
    for i, row in enumerate(rows):
        if len(row) != len(names):
            hint = f"give {len(names)} cells, one per column; use a decimal point in numbers"
            raise BadInput(f"{where} row {i + 1}", ",".join(row), hint)
        yield f"{where} row {i + 1}", dict(zip(names, row, strict=True))


def _number(
    row: Row, name: str, low: float = -check.LARGEST_NUMBER, high: float = check.LARGEST_NUMBER
) -> float:
    """Return the number in a cell, between two limits."""
    where, text = f"{row[0]} {name}", row[1][name]
    try:
        value = check.parsed(text)
    except ValueError:
        raise BadInput(where, text, "give a number") from None
    return check.number(where, value, low, high)


def _run_outs(rows: Sequence[Row], site: Site) -> list[DataSet]:
    """Return run-outs of single blocks by event."""
    found: dict[str, list[float]] = {}
    for row in rows:
        value = _number(row, "run_out_m", site.slope.points[0][0], site.slope.points[-1][0])
        if value > site.road.end:
            hint = (
                "computed run-outs are cut off at the end of the road, "
                f"{chainage(site.road.end)} m: fit a copy of the site file in which the road ends "
                "beyond all observed stops"
            )
            raise BadInput(f"{row[0]} run_out_m", value, hint)
        found.setdefault(row[1]["event"], []).append(value)
    return [DataSet(OBSERVED_RUN_OUT, event, np.array(values)) for event, values in found.items()]


def _passages(rows: Sequence[Row], site: Site) -> list[DataSet]:
    """Return quantities of passages by event, station and quantity."""
    found: dict[tuple[str, float, str], list[float]] = {}
    for row in rows:
        station = _station(row, site)
        quantity = row[1]["quantity"]
        check.one_of(f"{row[0]} quantity", quantity, tuple(QUANTITIES))
        value = _number(row, "value", -check.LARGEST_NUMBER if "height" in quantity else 0.0)
        found.setdefault((row[1]["event"], station, quantity), []).append(value)
    return [
        DataSet(quantity, event, np.array(values), station)
        for (event, station, quantity), values in found.items()
    ]


def _station(row: Row, site: Site) -> float:
    """Return the chainage of a station that blocks of the event can pass.

    Raises
    ------
    BadInput
        If it is not within the profile, or not downhill of the upper end of the source.
    """
    station, (low, high) = _number(row, "station_m"), ends(site)
    if not low < station < high:
        hint = f"give a chainage within the profile, between {chainage(low)} and {chainage(high)} m"
        raise BadInput(f"{row[0]} station_m", station, hint)
    event = row[1]["event"]
    source = site.source(site.event(event).source)
    first = min(source.band or [x for _, piece in source.pieces() for x, _ in piece])
    if station <= first:
        hint = f"give a chainage beyond {chainage(first)} m, where the source {source.name} "
        hint += f"begins: no block of the event {event} passes a station uphill of it"
        raise BadInput(f"{row[0]} station_m", station, hint)
    return station


def _deposits(where: str, rows: Sequence[Row], names: Sequence[str], site: Site) -> list[DataSet]:
    """Return deposits by event."""
    (amount,) = (name for name in AMOUNTS if name in names)
    found: dict[str, list[tuple[Row, float, float, float]]] = {}
    for row in rows:
        start = _number(row, "start_m", site.slope.points[0][0])
        end = _number(row, "end_m", start, site.slope.points[-1][0])
        found.setdefault(row[1]["event"], []).append((row, start, end, _number(row, amount, 0.0)))
    return [_deposit(where, event, own, amount) for event, own in found.items()]


def _deposit(
    file: str, event: str, rows: list[tuple[Row, float, float, float]], amount: str
) -> DataSet:
    """Return the deposit in the rows of an event."""
    rows = sorted(rows, key=lambda row: row[1])
    edges = [rows[0][1]]
    for (where, _), start, end, _ in rows:
        if start != edges[-1]:
            hint = f"let it begin at {chainage(edges[-1])}, where the interval before it ends; "
            raise BadInput(f"{where} start_m", start, f"{hint}give 0 if there is no rock")
        if end == start:
            raise BadInput(f"{where} end_m", end, f"let the interval end beyond {chainage(start)}")
        edges.append(end)
    amounts = np.array([row[3] for row in rows])
    if len(rows) < 2 or not amounts.any():
        hint = "give two intervals or more, and rock in at least one"
        raise BadInput(f"{file} {amount} of {event}", amounts.tolist(), hint)
    counts = {_releases(row[0]) for row in rows}
    if len(counts) > 1:
        hint = "give the same number of releases in all rows of an event"
        raise BadInput(f"{file} releases of {event}", ", ".join(map(str, sorted(counts))), hint)
    (count,) = counts
    shares = amounts / amounts.sum()
    return DataSet(DEPOSIT, event, np.array(edges), math.nan, shares, count)


def _releases(row: Row) -> int:
    """Return the number of releases that made the deposit of a row, 1 by default.

    A number of thousands of digits is infinite as a float, and Python refuses to convert it to an
    integer.
    """
    where, text = f"{row[0]} releases", row[1].get("releases", "1")
    try:
        value = check.parsed(text)
    except ValueError:
        value = math.nan
    return check.integer(where, int(value) if value.is_integer() else text, 1, JOB_RELEASES)
