"""Tables of results: rows of CSV files and tables that the command line prints."""

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
from numpy.typing import NDArray

from rigdda import (
    Embankment,
    Fence,
    GravityWall,
    Layout,
    Outcome,
    Points,
    Site,
)
from rigdda.agents.designers.protocol import Entry
from rigdda.app.design_study import SHED, ComparedLayouts, design_events
from rigdda.app.reports.wording import (
    at_most,
    euros,
    percent,
    small,
    span,
    survey_place,
    surveyed,
)
from rigdda.barriers import Earthwork, to_tables
from rigdda.envs.cost import Risk
from rigdda.envs.intervals import Estimate, Mean, estimate, mid_p, student_interval
from rigdda.envs.problem import can_fail
from rigdda.files import atomic
from rigdda.rounding import between, chainage

if TYPE_CHECKING:
    from rich.table import Table


OUTCOME_COLUMNS = {
    "road_volume": ("volume that reaches the road", "m3", 1.0),
    "debris_fraction": ("share of the rock that reaches it", "%", 100.0),
    "debris_on_road": ("debris on the road at the end", "m2", 1.0),
    "max_energy_on_road": ("largest energy on the road", "kJ/m", 1e-3),
    "slope_fraction": ("rock on the slope at the end", "%", 100.0),
    "held_fraction": ("rock behind barriers at the end", "%", 100.0),
    "road_fraction": ("rock on the road at the end", "%", 100.0),
    "beyond_fraction": ("rock beyond the road at the end", "%", 100.0),
}
"""Description, unit and factor for printing of each field of an outcome."""

RUN_OUT_COLUMNS = ("run_out_to_road_50", "run_out_to_road_95", "run_out_to_road_100")
"""Columns with the chainages of a release that contain 50, 95 and 100 % of its rock, which are cut
at the downhill edge of the road [m]; see `rigdda.Outcome.run_out`."""

BARRIER_COLUMNS = {
    "hits": ("hits", "-", 1.0),
    "max_energy": ("largest energy of a hit", "kJ/m", 1e-3),
    "total_energy": ("energy of all hits", "kJ/m", 1e-3),
    "absorbed_energy": ("energy absorbed", "kJ/m", 1e-3),
    "thrust": ("largest thrust, mean over a second", "kN/m", 1e-3),
    "overtopped": ("blocks that passed", "-", 1.0),
    "caught": ("share of the rock at rest behind or in it", "%", 100.0),
    "failed": ("failed", "%", 100.0),
    "displacement": ("displacement", "m", 1.0),
}
"""Description, unit and factor for printing of each field of a barrier."""

ONLY = {
    "failed": (Fence, GravityWall, Embankment),
    "thrust": (Fence, GravityWall, Embankment),
    "displacement": (GravityWall,),
}
"""Kinds of barrier for which a field is meaningful; other fields apply to all kinds."""


class EvaluationsFile:
    """A CSV file with one row per evaluated layout, which is written during the search.

    Costs are in EUR per metre of road and year, except `cost`, which is in EUR per metre. The
    column `barriers` is a JSON list of tables as in a layout file. If the site has traffic, there
    are also the columns of `RISK`; if it has other coordinates than its survey, `survey` is a JSON
    list of the chainage and elevation on the survey of each barrier. The class is a context
    manager.
    """

    FIELDS = (
        "simulations", "stage", "releases", "objective", "objective_low", "objective_high",
        "capital", "harm", "repair", "cost", "debris", "debris_share", "targets", "seconds",
        "barriers",
    )  # fmt: skip

    RISK = (
        "vehicles_hit", "vehicles_run_into", "fatalities", "individual_risk",
        "individual_risk_low", "individual_risk_high",
    )  # fmt: skip

    def __init__(self, path: str | os.PathLike[str], site: Site):
        self._site = site
        self._file = Path(path).open("w", newline="", encoding="utf-8")
        self._rows = csv.writer(self._file)
        risk = () if site.traffic is None else self.RISK
        survey = ("survey",) if site.origin.surveyed else ()
        self._rows.writerow((*self.FIELDS, *risk, *survey))

    def __enter__(self) -> EvaluationsFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, entry: Entry) -> None:
        """Write one row and flush it."""
        e = entry.evaluation
        row: tuple[Any, ...] = (
            entry.simulations, entry.stage, e.releases, e.objective, *e.ci, e.capital, e.harm,
            e.repair, e.cost, e.debris, e.debris_share, e.targets or "", e.seconds,
            json.dumps(to_tables(e.layout)),
        )  # fmt: skip
        if (r := e.risk) is not None:
            row += (r.hit.value, r.run_into.value, r.fatalities.value, *r.individual)
        if self._site.origin.surveyed:
            row += (json.dumps([survey_place(self._site, b.x) for b in e.layout]),)
        self._rows.writerow(row)
        self._file.flush()


def write_outcomes(
    path: str | os.PathLike[str], seeds: Sequence[int], outcomes: Sequence[Outcome]
) -> None:
    """Write a CSV file with one row per release: its seed, its outcome and its barriers."""
    rows = []
    for seed, outcome in zip(seeds, outcomes, strict=True):
        rows.append({"seed": seed} | outcome_row(outcome))
    write_rows(path, rows)


def outcome_row(outcome: Outcome) -> dict[str, Any]:
    """Return an outcome, including that of each barrier, as columns of a CSV file."""
    row: dict[str, Any] = {"event": outcome.event, "width": outcome.width}
    row |= {"released_volume": outcome.released_volume, "reached": outcome.reached}
    row |= {name: getattr(outcome, name) for name in OUTCOME_COLUMNS}
    row |= zip(RUN_OUT_COLUMNS, outcome.run_out, strict=True)
    for i, barrier in enumerate(outcome.barriers):
        row |= {f"barrier_{i}_{name}": getattr(barrier, name) for name in BARRIER_COLUMNS}
    return row


def write_rows(
    path: str | os.PathLike[str],
    rows: Sequence[dict[str, Any]],
    fields: Sequence[str] | None = None,
) -> None:
    """Write a CSV file with one row per dictionary.

    `fields` are the columns, by default the keys of the first row. A row may lack some of them.
    """
    with atomic(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, rows[0] if fields is None else fields, restval="")
        table.writeheader()
        table.writerows({k: "" if applies_not(v) else v for k, v in row.items()} for row in rows)


def applies_not(value: Any) -> bool:
    """Return whether a value is NaN, which is written as an empty cell."""
    return isinstance(value, float) and math.isnan(value)


def outcomes(
    site: Site,
    layout: Layout,
    results: Sequence[Outcome],
    run_out: tuple[str, str] | None = None,
) -> Table:
    """Return the table of means over releases with 95 % intervals.

    Parameters
    ----------
    site, layout : Site, Layout
        The site and the layout.
    results : sequence of Outcome
        The outcomes.
    run_out : (str, str), optional
        Chainage within which 95 % of the rock comes to rest and its interval, see
        `rigdda.app.reports.stations.stopped`; outcomes do not contain it, because they end at
        the road.
    """
    table = empty_table(("", "mean", "95 % interval"))

    def add(words: str, unit: str, factor: float, values: list[float]) -> None:
        sample = factor * np.array(values, dtype=np.float64)
        ends = _interval(sample, 0.0, unit == "%")
        table.add_row(f"{words} [{unit}]", f"{sample.mean():.4g}", _span(ends, ".4g"))

    chance = estimate(sum(outcome.reached for outcome in results), len(results))
    ends = 100.0 * chance.low, 100.0 * chance.high
    head = "a block reaches the road [%]"
    table.add_row(head, f"{100.0 * chance.probability:.4g}", _span(ends, ".4g"))
    for name, (words, unit, factor) in OUTCOME_COLUMNS.items():
        add(words, unit, factor, [getattr(outcome, name) for outcome in results])
    if run_out is not None:
        table.add_row("run-out of 95 % of the rock [m]", *run_out)
    built = zip(site.standing(layout), site.labels(layout), strict=True)
    for i, (barrier, label) in enumerate(built):
        table.add_section()
        table.add_row(f"{label}, at {barrier.x:.1f} m")
        if words := surveyed(site, barrier.x):
            table.add_row(words.strip())
        for name, (words, unit, factor) in BARRIER_COLUMNS.items():
            if isinstance(barrier, Earthwork) and name not in ("overtopped", "caught", *ONLY):
                continue
            if not isinstance(barrier, ONLY.get(name, object)):
                continue
            add(f"  {words}", unit, factor, [getattr(o.barriers[i], name) for o in results])
    return table


def _interval(sample: NDArray[np.float64], low: float, percent: bool) -> Sequence[float]:
    """Return the 95 % interval of a mean, cut at `low` and, for a percentage, at 100.

    If every value is 0 or 100 %, the interval is that of a probability.
    """
    if percent and np.isin(sample, (0.0, 100.0)).all():
        return [100.0 * end for end in mid_p(int(np.count_nonzero(sample)), len(sample))]
    ends = np.clip(student_interval(sample), low, 100.0 if percent else None)
    return [float(end) for end in ends]


def sites(found: Iterable[Site]) -> Table:
    """Return the table of sites with their families, heights, events and zones."""
    table = empty_table(("site", "family", "height [m]", "events (1/year per 100 m)", "zone [m]"))
    for site in found:
        heights = [y for _, y in site.slope.points]
        zone = site.barrier_zone
        events = ", ".join(f"{event.name} {event.rate:g}" for event in site.events)
        table.add_row(
            site.name,
            site.family or "-",
            f"{max(heights) - min(heights):.0f}",
            shorten(events, 160, placeholder=" ..."),
            f"{chainage(zone.start)} to {chainage(zone.end)}",
        )
    return table


def empty_table(head: Sequence[str]) -> Table:
    """Return an empty table with text aligned on the left and numbers on the right.

    Values with their intervals stay on one line. Where a table is too wide, text is broken instead.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for i, name in enumerate(head):
        left = i == 0 or name in TEXT_COLUMNS
        table.add_column(name, justify="left" if left else "right", no_wrap="(95 %)" in name)
    return table


TEXT_COLUMNS = ("description", "family", "layout", "events (1/year per 100 m)")
"""Columns that contain text."""


def _span(interval: Iterable[float], form: str) -> str:
    """Return an interval as text, its ends rounded outward; it is "-" for a single value."""
    low, high = interval
    return between(low, high, form) if math.isfinite(high - low) else "-"


def fit(rows: Sequence[dict[str, Any]]) -> Table:
    """Return the table of a fit, at most 80 characters wide."""

    def number(value: Any) -> str:
        return f"{value:.3g}" if isinstance(value, float) else ""

    out = empty_table(("what", "fitted", "95 %", "left out", "observed"))
    for row in rows:
        unit = f" [{row['unit']}]" if row["unit"] not in ("", "-") else ""
        ends = between(row["low"], row["high"], ".3g") if row["low"] != "" else ""
        ends = "not identified" if row["identified"] == "no" else ends
        cells = (number(row[name]) for name in ("left_out", "observed"))
        out.add_row(row["what"] + unit, number(row["fitted"]), ends, *cells)
    return out


def write_points(path: Path, seeds: Sequence[int], points: Points) -> None:
    """Write a CSV file with one row per block of the lumped-mass model, in SI units."""
    each = zip(*(column.tolist() for column in (*points, points.energy)), strict=True)
    names = ("mass_kg", "run_out_m", "speed_m_s", "height_m", "energy_j")
    rows = [{"seed": seeds[k], **dict(zip(names, row, strict=True))} for k, *row in each]
    write_rows(path, rows)


def points(found: Points) -> Table:
    """Return the table of results of the lumped-mass model, with one quantity per row."""
    out = empty_table(("what", "mean", "95 % of blocks"))
    reached, weight = found.reached, found.mass / found.mass.sum()
    out.add_row("debris that reaches the road [-]", f"{float(weight @ reached):.3f}", "")
    columns = {"run-out [m]": found.run_out, "energy at the road [kJ/m]": 1e-3 * found.energy}
    columns["height at the road [m]"] = found.height
    for what, values in columns.items():
        known = values[~np.isnan(values)]
        if len(known):
            out.add_row(what, f"{known.mean():.3g}", f"{np.quantile(known, 0.95):.3g}")
    return out


def costs(study: ComparedLayouts) -> Table:
    """Return the table of the costs of each layout, at most 80 characters wide.

    Costs are in EUR per metre of road and year, except "to build", which is in EUR per metre.
    "debris" is the volume on the road, divided by the volume without barriers.
    """
    head = ("layout", "Z (95 %)", "capital", "harm", "repair", "to build", "debris")
    table = empty_table(head)
    whole = study.nothing.evaluation.debris
    for case in study.cases:
        e = case.evaluation
        table.add_row(
            case.name,
            f"{euros(e.objective)} ({span(e.ci)})",
            euros(e.capital),
            euros(e.harm),
            euros(e.repair),
            euros(e.cost),
            percent(e.debris / whole) if whole else "-",
        )
    site = study.problem.site
    annual = euros(site.shed())
    table.add_row(SHED, annual, annual, "0", "0", euros(site.prices.shed), "0 %")
    return table


def chances(study: ComparedLayouts) -> Table | None:
    """Return the table of probabilities in each design event, or None if the site has none.

    Each probability is followed by its one-sided 95 % upper bound. That of a failure is "-" if no
    barrier can fail.
    """
    events = design_events(study.problem.site)
    if not events:
        return None
    table = empty_table(("design event", "layout", "reaches road", "barrier fails", "of"))
    for event in events:
        for i, case in enumerate(study.cases):
            e = case.evaluation
            reach = e.reach[event]
            fallible = can_fail(study.problem.site, e.layout)
            fails = bounded(e.failure[event]) if fallible else "-"
            name = "" if i else event
            table.add_row(name, case.name, bounded(reach), fails, f"{reach.releases:,}")
        table.add_section()
    return table


def risks(study: ComparedLayouts) -> Table | None:
    """Return the table of the risk of each layout to the traffic, or None without traffic."""
    found = known_risks(study)
    return risk_table(found) if found else None


def risk_table(found: Sequence[tuple[str, Risk]]) -> Table:
    """Return the table of the risk of named layouts to the traffic on the section, per year.

    The individual risk is followed by the upper end of its 95 % interval, rounded up.
    """
    table = empty_table(("layout", "hit", "run into", "deaths", "per km", "one person"))
    for name, risk in found:
        means = (risk.hit, risk.run_into, risk.fatalities, risk.per_km)
        one = f"{small(risk.individual.value)} (<= {small(risk.individual.high, 'up')})"
        table.add_row(name, *(f"{mean.value:.2g}" for mean in means), one)
    return table


RISKS = "risk.csv"
"""File with the risk of each layout to the traffic."""


def write_risks(folder: Path, found: Sequence[tuple[str, Risk]]) -> None:
    """Write the risk of named layouts to `risk.csv`, or remove an old file if there is none."""
    if found:
        write_rows(folder / RISKS, [{"layout": name, **_risk_row(risk)} for name, risk in found])
    else:
        (folder / RISKS).unlink(missing_ok=True)


def _risk_row(risk: Risk) -> dict[str, float]:
    """Return the columns with a risk, each mean followed by the ends of its 95 % interval."""
    row: dict[str, float] = {}
    for name in ("hit", "run_into", "fatalities", "per_km", "individual"):
        mean: Mean = getattr(risk, name)
        row |= {name: mean.value, f"{name}_low": mean.low, f"{name}_high": mean.high}
    return row


def known_risks(study: ComparedLayouts) -> list[tuple[str, Risk]]:
    """Return the risk of each layout to the traffic; empty without traffic."""
    return [(c.name, c.evaluation.risk) for c in study.cases if c.evaluation.risk is not None]


def chance_columns(name: str, chance: Estimate | None) -> dict[str, float]:
    """Return a probability, the ends of its 95 % interval and its upper bound as columns.

    They are empty without a probability, as that of a failure where no barrier can fail.
    """
    names = (name, f"{name}_low", f"{name}_high", f"{name}_bound")
    if chance is None:
        return dict.fromkeys(names, math.nan)
    values = (chance.probability, chance.low, chance.high, chance.bound)
    return dict(zip(names, values, strict=True))


def bounded(estimate: Estimate) -> str:
    """Return a probability with its upper bound, rounded up, as text; "-" without releases."""
    if not estimate.releases:
        return "-"
    return f"{percent(estimate.probability)} (<= {at_most(estimate.bound)})"
