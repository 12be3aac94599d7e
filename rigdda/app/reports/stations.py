"""Tables of what passes along a slope and at stations, and of where blocks stop.

Units are the same in every table: kJ, m, m/s, rad/s, kg, and 1/year per 100 m of slope. Energies
are those of a whole block, which is as long along the road as the root of its cross-section.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import Layout, Site
from rigdda.app.reports.tables import empty_table, write_rows
from rigdda.app.reports.wording import figure, percent, survey_place
from rigdda.envs.intervals import Estimate, Mean, estimate, total
from rigdda.envs.quantiles import BlockSample, Quantile, mean, quantiles
from rigdda.files import atomic
from rigdda.passages import AT_END, HAS_LEFT, IN_MOTION, STATES, Passages, ends
from rigdda.rounding import chainage, rounded

if TYPE_CHECKING:
    from rich.table import Table

Floats = NDArray[np.float64]
Rows = list[dict[str, Any]]

QUANTILE_LEVELS = (0.5, 0.9, 0.95, 0.99)
"""Shares of passing blocks below the quantiles of the tables."""

ALL_EVENTS = "all events"
"""Name of the rows over all events, weighted by rate."""

PER = "1/year per 100 m"
"""Unit of rates."""

PASSING_RATE = "passing_rate"
"""Name of the rows of the passing rate."""


class Quantity(NamedTuple):
    """A quantity of a passage: its words, its unit and its value in each of some passages."""

    words: str
    unit: str
    of: Callable[[NDArray[np.void]], Floats]


QUANTITIES = {
    "energy": Quantity("energy", "kJ", lambda p: p["translation"] / 1e3 + p["rotation"] / 1e3),
    "energy_translation": Quantity("translational energy", "kJ", lambda p: p["translation"] / 1e3),
    "energy_rotation": Quantity("rotational energy", "kJ", lambda p: p["rotation"] / 1e3),
    "velocity": Quantity("velocity", "m/s", lambda p: np.hypot(p["vx"], p["vy"])),
    "height": Quantity("bounce height of the centre", "m", lambda p: p["height"]),
    "height_normal": Quantity("bounce height normal to the slope", "m", lambda p: p["normal"]),
    "height_top": Quantity("height of the top", "m", lambda p: p["height"] + p["radius"]),
}
"""Quantities of the tables. The bounce height is that of the block's centre above the ground,
measured vertically; normal to the slope, it is this height times the cosine of the inclination of
the ground over the width of the block. The top is higher than the centre by the radius of the
circumscribed circle."""


class Passing(NamedTuple):
    """Releases of some events with what passes, as tables and pictures need them.

    Parameters
    ----------
    site : Site
        The site.
    events : list of str
        Names of the events, in the order of the site.
    rate : (E,) array
        How often each event of the site happens with the layout [1/year per 100 m], 0 of others.
    found : Passages
        The releases.
    """

    site: Site
    events: list[str]
    rate: Floats
    found: Passages

    @classmethod
    def of(cls, site: Site, layout: Layout, event: str | None, found: Passages) -> Passing:
        """Return releases of one event, or of all events, that were simulated with a layout."""
        names = site.event_names
        events = [name for name in names if event in (None, name)]
        each = [100.0 * site.rate(name, layout) * (name in events) for name in names]
        return cls(site, events, np.array(each), found)

    def of_mesh(self) -> str:
        """Return a note on the rates if mesh reduces them and there are several events."""
        bare = [100.0 * self.site.rate(name) for name in self.events]
        rate = [self.rate[self.site.event_names.index(name)] for name in self.events]
        if len(self.events) < 2 or np.array_equal(bare, rate):
            return ""
        return (
            "passing rates, quantiles of all events together and the run-out are those of the "
            "rates with mesh; the other outcomes are those of the rates without mesh"
        )

    @property
    def groups(self) -> list[str]:
        """Names of the events, and `ALL_EVENTS` if there are several."""
        return [*self.events, ALL_EVENTS] if len(self.events) > 1 else self.events

    def releases(self, group: str) -> NDArray[np.int64]:
        """Return the indices of the releases of an event or of all events."""
        if group == ALL_EVENTS:
            return np.arange(len(self.found.event))
        return np.flatnonzero(self.found.event == self.site.event_names.index(group))

    def passages(self, group: str, station: int) -> NDArray[np.void]:
        """Return the passages of an event, or of all events, at a station."""
        return self.own(group, self.found.at(station))

    def own(self, group: str, rows: NDArray[np.void]) -> NDArray[np.void]:
        """Return the rows of an event, or of all events that happen at all."""
        if group == ALL_EVENTS:
            return rows[self.rate[rows["event"]] > 0.0]
        return rows[rows["event"] == self.site.event_names.index(group)]

    def sample(self, group: str, rows: NDArray[np.void], values: Floats) -> BlockSample:
        """Return values of some rows of an event, or of all events, as a sample of the releases."""
        rate = self.rate if group == ALL_EVENTS else np.ones(len(self.rate))
        return BlockSample(values, rows["release"], self.found.event, rate)

    def frequency(self, group: str, rows: NDArray[np.void]) -> Mean:
        """Return how often a release has at least one of some rows [1/year per 100 m]."""
        return total(self._frequency(name, rows) for name in self._drawn(group))

    def probability(self, group: str, rows: NDArray[np.void]) -> Mean:
        """Return the probability that a release has at least one of some rows.

        That of all events is weighted by their rates, of which one must be above 0.
        """
        if group == ALL_EVENTS:
            numbers = [self.site.event_names.index(name) for name in self._drawn(group)]
            return self.frequency(group, rows).times(1.0 / float(self.rate[numbers].sum()))
        chance = self.chance(group, rows)
        return Mean(chance.probability, chance.low, chance.high)

    def _drawn(self, group: str) -> list[str]:
        """Return the events of a group that were simulated."""
        names = self.events if group == ALL_EVENTS else [group]
        return [name for name in names if len(self.releases(name))]

    def _frequency(self, event: str, rows: NDArray[np.void]) -> Mean:
        chance, number = self.chance(event, rows), self.site.event_names.index(event)
        return Mean(chance.probability, chance.low, chance.high).times(float(self.rate[number]))

    def chance(self, event: str, rows: NDArray[np.void]) -> Estimate:
        """Return the probability that a release of an event has at least one of some rows."""
        own = rows["release"][rows["event"] == self.site.event_names.index(event)]
        return estimate(len(np.unique(own)), len(self.releases(event)))

    @property
    def not_drawn(self) -> list[str]:
        """Names of the events of which there is no release."""
        return [name for name in self.events if not len(self.releases(name))]


def summary(
    passing: Passing,
    places: Sequence[int],
    groups: Sequence[str] | None = None,
    names: Sequence[str] = (),
) -> Rows:
    """Return the rows of a table of stations.

    One row for each station, event and quantity, with mean and quantiles, each with the ends of its
    95 % interval. An end is empty where there are too few passages for it; `note` says so.

    Parameters
    ----------
    places : sequence of int
        Indices of the stations.
    groups : sequence of str, optional
        Events, and `ALL_EVENTS` for all together; by default all of `passing.groups`.
    names : sequence of str
        Names of the quantities; by default all of `QUANTITIES` and the passing rate.
    """
    wanted = passing.groups if groups is None else groups
    return [
        row
        for k in places
        for group in wanted
        for row in _station(passing, k, group, names or (*QUANTITIES, PASSING_RATE))
    ]


def _station(
    passing: Passing, station: int, group: str, names: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """Yield the rows of one station and event."""
    rows, releases = passing.passages(group, station), len(passing.releases(group))
    x = float(passing.found.stations[station])
    head = {"x_m": x, **survey_place(passing.site, x), "event": group}
    known = {"releases": releases, "n": len(rows)}
    for name, quantity in ((name, QUANTITIES[name]) for name in names if name != PASSING_RATE):
        sample = passing.sample(group, rows, quantity.of(rows))
        levels = quantiles(sample, QUANTILE_LEVELS)
        yield {
            **head,
            "quantity": name,
            "unit": quantity.unit,
            **known,
            **_ends("mean", mean(sample)),
            **{
                k: v
                for q, x in zip(QUANTILE_LEVELS, levels, strict=True)
                for k, v in _ends(_q(q), x).items()
            },
            "note": _note(len(rows), levels),
        }
    if PASSING_RATE not in names:
        return
    often = passing.frequency(group, rows) if releases else Mean(*[math.nan] * 3)
    empty = {
        k: v for q in QUANTILE_LEVELS for k, v in _ends(_q(q), Quantile(*[math.nan] * 3)).items()
    }
    yield {**head, "quantity": PASSING_RATE, "unit": PER, **known, **_ends("mean", often), **empty,
           "note": "" if releases else "no release of this event"}  # fmt: skip


def _q(level: float) -> str:
    return f"q{100.0 * level:g}"


def _ends(name: str, value: Mean | Quantile) -> dict[str, float]:
    """Return a value and the ends of its interval as columns."""
    return {name: value.value, f"{name}_low": value.low, f"{name}_high": value.high}


def _note(n: int, levels: Sequence[Quantile]) -> str:
    """Return which ends of intervals are empty because there are too few passages."""
    if n == 0:
        return "no block passes"
    words = []
    for side in ("low", "high"):
        missing = [
            _q(q)
            for q, x in zip(QUANTILE_LEVELS, levels, strict=True)
            if math.isnan(getattr(x, side))
        ]
        if missing:
            words.append(f"n is too small for the {side} end of {', '.join(missing)}")
    return "; ".join(words)


def raw(passing: Passing, places: Sequence[int]) -> Rows:
    """Return a row for each passage of some stations, for a table."""
    names, lines = passing.site.event_names, passing.found.stations.tolist()
    table = passing.found.table
    table = table[np.isin(table["station"], places)]
    own = {
        "time_s": table["time"],
        "velocity_x_m_s": table["vx"],
        "velocity_y_m_s": table["vy"],
        "angular_velocity_rad_s": table["omega"],
        "height_m": table["height"],
        "height_normal_m": table["normal"],
        "height_top_m": table["height"] + table["radius"],
        "energy_translation_kJ": table["translation"] / 1e3,
        "energy_rotation_kJ": table["rotation"] / 1e3,
        "mass_kg": table["mass"],
        "width_m": table["width"],
    }
    values = zip(*(column.tolist() for column in own.values()), strict=True)
    seeds = passing.found.seed
    heads = zip(*(table[k].tolist() for k in ("station", "release", "event", "block")), strict=True)
    surveyed = [survey_place(passing.site, x) for x in lines]
    return [
        {"x_m": lines[s], **surveyed[s], "seed": seeds[r], "event": names[e], "block": b}
        | dict(zip(own, v, strict=True))
        for (s, r, e, b), v in zip(heads, values, strict=True)
    ]


def raw_fields(site: Site) -> list[str]:
    """Return the columns of the table of passages of a site."""
    survey = survey_place(site, site.road.start)
    return [PASSAGE_COLUMNS[0], *survey, *PASSAGE_COLUMNS[1:]]


PASSAGE_COLUMNS = (
    "x_m", "seed", "event", "block", "time_s", "velocity_x_m_s", "velocity_y_m_s",
    "angular_velocity_rad_s", "height_m", "height_normal_m", "height_top_m",
    "energy_translation_kJ", "energy_rotation_kJ", "mass_kg", "width_m",
)  # fmt: skip
"""Columns of the table of passages, which may have no rows."""


def stops(passing: Passing) -> Rows:
    """Return a row for each block: where it is at the end of its release, and in which state."""
    names, table = passing.site.event_names, passing.found.stops
    columns, seeds = ("release", "event", "block", "x", "state", "mass"), passing.found.seed
    return [
        {
            "seed": seeds[r],
            "event": names[e],
            "block": b,
            "x_m": x,
            **survey_place(passing.site, x),
            "state": STATES[s],
            "mass_kg": m,
        }
        for r, e, b, x, s, m in zip(*(table[k].tolist() for k in columns), strict=True)
    ]


RUN_OUT_POINTS = 120
"""Intervals between the chainages of the table of run-out."""


def run_out(passing: Passing) -> Rows:
    """Return the rows of the exceedance of the run-out, from uphill of the sources to the end.

    `probability`: that at least one block of a release stops beyond x. `rate`: how often that
    happens [1/year per 100 m]. Both with 95 % intervals. `share_of_blocks`: blocks that stop beyond
    x. Blocks that still move count where they are at the end of the simulation, and blocks that
    left the profile count as beyond every x.
    """
    left, right = ends(passing.site)
    road = passing.site.road
    grid = np.unique([*np.linspace(left, right, RUN_OUT_POINTS + 1), road.start, road.end])
    return [row for group in passing.groups for row in _beyond(passing, group, grid)]


def _beyond(passing: Passing, group: str, grid: Floats) -> Iterator[dict[str, Any]]:
    """Yield the rows of the run-out of one event."""
    table = passing.own(group, passing.found.stops)
    if not len(table):
        return
    weight = passing.sample(group, table, table["x"]).weight
    for x in grid.tolist():
        beyond = (table["x"] > x) | (table["state"] == HAS_LEFT)
        yield {
            "event": group, "x_m": x, **survey_place(passing.site, x),
            "releases": len(passing.releases(group)),
            **_ends("probability", passing.probability(group, table[beyond])),
            **_ends("rate", passing.frequency(group, table[beyond])),
            "share_of_blocks": float(weight[beyond].sum() / weight.sum()),
        }  # fmt: skip


DEPOSIT_SHARES = (0.5, 0.95)
"""Shares of the rock for which the chainage within which it comes to rest is given."""


def stopping(passing: Passing) -> Rows:
    """Return the rows of a table of the chainages within which a share of the rock comes to rest.

    One row for each event, and for all events together, and each share of `DEPOSIT_SHARES`. Each
    block counts in proportion to its mass, and each event in proportion to its rate; blocks beyond
    the road count where they are. `x_m` is the smallest chainage that at least this share of the
    rock does not pass, with the ends of its 95 % interval. The place where a block stops is not
    known if it left the profile or still moved at the end of its release. If `x_m` depends on such
    blocks, it is where they were last, and `bound` is "lower bound"; an end of the interval that
    depends on them, or for which there are too few releases, is empty. `left` and `moving` are the
    shares of the rock in such blocks.
    """
    return [row for group in passing.groups for row in _stopping(passing, group)]


def _stopping(passing: Passing, group: str) -> Iterator[dict[str, Any]]:
    """Yield the rows of one event of the table of chainages within which rock comes to rest."""
    table = passing.own(group, passing.found.stops)
    sample = passing.sample(group, table, table["x"])._replace(size=table["mass"])
    known = table["state"] == AT_END
    beyond = sample._replace(values=np.where(known, table["x"], math.inf))
    weight = sample.weight
    left, moving = (
        float(weight[table["state"] == state].sum() / weight.sum()) if len(table) else math.nan
        for state in (HAS_LEFT, IN_MOTION)
    )
    nowhere = dict.fromkeys(survey_place(passing.site, passing.site.road.start), math.nan)
    pairs = zip(quantiles(sample, DEPOSIT_SHARES), quantiles(beyond, DEPOSIT_SHARES), strict=True)
    for share, (least, most) in zip(DEPOSIT_SHARES, pairs, strict=True):
        high = most.high if math.isfinite(most.high) else math.nan
        yield {
            "event": group,
            "share": share,
            "releases": len(passing.releases(group)),
            "n": len(table),
            **_ends("x_m", Quantile(least.value, least.low, high)),
            **(survey_place(passing.site, least.value) if len(table) else nowhere),
            "bound": "lower bound" if most.value > least.value else "",
            "left": left,
            "moving": moving,
        }


def stopped(rows: Rows) -> tuple[str, str]:
    """Return the chainage within which 95 % of the rock comes to rest, and its interval, in words.

    Parameters
    ----------
    rows : list of dict
        Table of `stopping`; the last row is meant.
    """
    row = rows[-1]
    if math.isnan(row["x_m"]):
        return "-", "-"
    value = rounded(row["x_m"], ".1f", "down" if row["bound"] else "nearest")
    low = "?" if math.isnan(row["x_m_low"]) else rounded(row["x_m_low"], ".1f", "down")
    high = "?" if math.isnan(row["x_m_high"]) else rounded(row["x_m_high"], ".1f", "up")
    return f">= {value}" if row["bound"] else value, f"{low} to {high}"


def lower_bound(rows: Rows) -> str:
    """Return a sentence on a run-out that is a lower bound only; it is empty if it is known.

    Parameters
    ----------
    rows : list of dict
        Table of `stopping`; the last row is meant.
    """
    row = rows[-1]
    if not row["bound"]:
        return ""
    pairs = ((row["left"], "left the surveyed ground"), (row["moving"], "still moved at the end"))
    words = " and ".join(f"{percent(share)} of the rock {what}" for share, what in pairs if share)
    return (
        f"the run-out of 95 % of the rock is a lower bound, because {words}: give a longer profile "
        "or a longer motion.duration to know it"
    )


def undecided(passing: Passing) -> str:
    """Return in words how many blocks had not stopped at the end; empty if all had stopped."""
    state, words = passing.found.stops["state"], []
    if left := int((state == HAS_LEFT).sum()):
        words.append(f"{left:,} left the profile at its end ({chainage(ends(passing.site)[1])} m)")
    if moving := int((state == IN_MOTION).sum()):
        words.append(f"{moving:,} still moved after {passing.site.motion.duration:g} s")
    if not words:
        return ""
    return f"of {len(state):,} blocks {' and '.join(words)}: where they would stop is not known"


def write(path: Path, rows: Rows, fields: Sequence[str] | None = None) -> None:
    """Write rows as PATH.csv and PATH.parquet; `fields` are the columns if there may be no rows."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    write_rows(path.with_name(path.name + ".csv"), rows, fields)
    columns = list(rows[0]) if fields is None else fields
    table = pa.table({name: [_cell(row[name]) for row in rows] for name in columns})
    with atomic(path.with_name(path.name + ".parquet")) as part:
        pq.write_table(table, part)


def _cell(value: Any) -> Any:
    """Return a value, None in place of NaN."""
    return None if isinstance(value, float) and math.isnan(value) else value


PRINTED = ("energy", "velocity", "height", "height_normal")
"""Quantities that are printed."""


def tables(rows: Rows) -> Iterator[tuple[str, Table]]:
    """Yield what to print about each station: a line, and a table at most 80 characters wide.

    All events together: quantiles with the ends of their 95 % intervals.
    """
    shown = [row for row in rows if row["event"] == rows[-1]["event"]]
    for often in (row for row in shown if row["quantity"] == PASSING_RATE):
        out = empty_table(("", "median", "95 % (interval)", "99 % (interval)"))
        for row in (row for row in shown if row["x_m"] == often["x_m"]):
            if row["quantity"] in PRINTED:
                words = f"{row['quantity'].replace('_', ', ')} [{row['unit']}]"
                out.add_row(words, *(_words(row, name) for name in ("q50", "q95", "q99")))
        survey = ""
        if "chainage_m" in often:
            survey = (
                f" (survey: chainage {often['chainage_m']:,.1f} m, elevation "
                f"{often['elevation_m']:,.1f} m)"
            )
        line = (
            f"at {often['x_m']:g} m{survey} {often['n']:,} blocks pass, in "
            f"{_words(often, 'mean')} releases a year per 100 m of slope"
        )
        yield line, out


FEW_PASSAGES = 20
"""Number of passages below which the 95 % quantile of an event is not printed."""

FEW_RELEASES = 100
"""Number of releases of an event below which more are advised."""


def of_design_events(site: Site, rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what each design event does at each station, in words.

    All events together are mostly small blocks, which say little about what a barrier must hold.

    Parameters
    ----------
    site : Site
        The site.
    rows : sequence of mapping
        Rows of the table of stations, with numbers or with their text.
    """
    lines = []
    for event in (event.name for event in site.events if event.design):
        own = [row for row in rows if row["event"] == event]
        for rate in (row for row in own if row["quantity"] == PASSING_RATE):
            here = {row["quantity"]: row for row in own if row["x_m"] == rate["x_m"]}
            count, where = int(rate["n"]), f"design event {event!r} at {float(rate['x_m']):g} m"
            if count < FEW_PASSAGES:
                releases = int(rate["releases"])
                passed = {0: "no block passes", 1: "1 block passes"}.get(
                    count, f"{count} blocks pass"
                )
                line = f"{where}: {passed} in {releases:,} releases"
                if releases < FEW_RELEASES:
                    line += f"; use --event {shlex.quote(event)} to simulate this event alone"
                lines.append(line)
                continue
            energy, height = (float(here[name]["q95"]) for name in ("energy", "height"))
            lines.append(
                f"{where}: 95 % of the {count:,} passing blocks have less than {figure(energy)} "
                f"kJ, and the centres of 95 % are lower than {figure(height)} m above the ground"
            )
    return lines


def _words(row: dict[str, Any], name: str) -> str:
    """Return a value with its interval in words."""
    if math.isnan(row[name]):
        return "-"
    if name == "q50":
        return figure(row[name])
    low, high = figure(row[f"{name}_low"], "down"), figure(row[f"{name}_high"], "up")
    return f"{figure(row[name])} ({low} to {high})"
