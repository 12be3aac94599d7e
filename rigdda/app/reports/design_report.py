"""Files and tables of `rigdda design`: layouts, checks, frontier, band of the ground, pictures.

Evaluations are written while the search runs, by `rigdda.app.reports.tables.EvaluationsFile`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

import rigdda
from rigdda import Layout, Site
from rigdda.agents.designers import rule
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.rule import RuleAnswer
from rigdda.app import archive
from rigdda.app.barrier_checks import BarrierCheck, LayoutChecks
from rigdda.app.design_study import SHED, DesignStudy, VerifiedLayout
from rigdda.app.reports import findings, pictures
from rigdda.app.reports.pictures import (
    DPI,
    DRAWN_TRAJECTORIES,
    ENVELOPE_BLOCKS,
    EVENTS,
    FONT,
    MARKERS,
    EventTrajectories,
    Panel,
    envelopes,
    save,
    section,
    trajectories,
)
from rigdda.app.reports.simulation_report import along
from rigdda.app.reports.tables import (
    bounded,
    chance_columns,
    empty_table,
    known_risks,
    write_risks,
    write_rows,
)
from rigdda.app.reports.wording import before, euros, percent, percentage, span, unchanged
from rigdda.app.uncertainty.ground_band import Band
from rigdda.barriers import to_tables
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.design_envelope import DesignEnvelope
from rigdda.envs.fence_checks import FenceCheck, demands
from rigdda.envs.intervals import Estimate
from rigdda.envs.problem import MET, MISSED, UNDECIDED, can_fail
from rigdda.envs.replay_record import release_record
from rigdda.envs.ritchie_ditch import OUTSIDE_CHART
from rigdda.files import remove_results
from rigdda.replay.recording import Marks
from rigdda.seeds import release_seeds


def interim_line(cases: Sequence[VerifiedLayout]) -> str:
    """Return the layouts in one line: names, Z with intervals, and the barriers of the last one."""
    parts = []
    for case in cases:
        e = case.evaluation
        parts.append(f"{case.name} {euros(e.objective)} ({span(e.ci)})")
    last = cases[-1]
    what = f"; {last.name}: {_interim_labels(last)}" if last.evaluation.layout else ""
    head = f"so far, with {last.evaluation.releases:,} releases of each layout"
    return f"{head}: Z {', '.join(parts)} EUR per metre and year{what}"


def interim_table(cases: Sequence[VerifiedLayout]) -> Table:
    """Return the table of the layouts with Z and its 95 % interval."""
    releases = cases[-1].evaluation.releases
    found = empty_table((f"so far ({releases:,} releases each)", "Z (95 %)", "barriers"))
    for case in cases:
        e = case.evaluation
        found.add_row(case.name, f"{euros(e.objective)} ({span(e.ci)})", _interim_labels(case))
    return found


def _interim_labels(case: VerifiedLayout) -> str:
    """Return the barriers of a layout in words."""
    return ", ".join(b.label_and_place for b in case.evaluation.layout)


Row = dict[str, Any]


def layout_rows(done: DesignStudy) -> list[Row]:
    """Return a row for each verified layout, and one for a rock shed as a reference.

    Z and its parts are in EUR per metre of road and year, `cost` is the price to build in EUR per
    metre, and `debris` is the volume on the road in m3 per metre and year; `debris_share` is that
    volume divided by that of the first layout. `chosen` marks the layout found, and `comparable`
    the layouts that may be proposed, which meet the required checks. `_low` and `_high` are the
    ends of 95 % intervals.
    """
    site, whole = done.problem.site, done.nothing.evaluation.debris
    rows = [
        {
            "layout": case.name,
            "chosen": case is done.chosen,
            **_costs(site, case.evaluation, whole),
            "comparable": case in done.comparable,
        }
        for case in done.cases
    ]
    shed = {name: 0.0 for name in rows[0] if name not in ("layout", "chosen")}
    known = ("objective", "objective_low", "objective_high", "capital")
    shed |= dict.fromkeys(known, site.shed()) | {"cost": site.prices.shed, "releases": 0}
    words = {"targets": "", "barriers": "", "comparable": False}
    return [*rows, {"layout": SHED, "chosen": False, **shed, **words}]


def _costs(site: Site, e: Evaluation, whole: float) -> Row:
    """Return the cost of a layout and its parts; `whole` is the debris without the layout."""
    return {
        "objective": e.objective, **_ends("objective", e.ci),
        "capital": e.capital,
        "harm": e.harm, **_ends("harm", e.harm_ci),
        "repair": e.repair, **_ends("repair", e.repair_ci),
        "cost": e.cost,
        "debris": e.debris, **_ends("debris", e.debris_ci), 
        "debris_share": e.debris / whole if whole else math.nan,
        "targets": e.targets or "",
        "releases": e.releases,
        "barriers": findings.barriers_in_words(site, e.layout),
    }  # fmt: skip


def _ends(name: str, interval: tuple[float, float]) -> Row:
    """Return the ends of an interval as columns."""
    low, high = interval
    return {f"{name}_low": low, f"{name}_high": high}


def chance_rows(done: DesignStudy) -> list[Row]:
    """Return a row for each event and verified layout.

    `reach` is the probability that a block of a release reaches the road, `failure` that a barrier
    fails; `_low` and `_high` are the ends of 95 % intervals, and `_bound` is a one-sided 95 % upper
    bound. `failure` is empty if no barrier can fail. `cost` is the expected harm and repair of the
    event in EUR per metre and year.
    """
    site = done.problem.site

    def failure(found: Evaluation, event: str) -> Estimate | None:
        return found.failure[event] if can_fail(site, found.layout) else None

    return [
        {
            "event": event.name,
            "design": event.design,
            "layout": case.name,
            "releases": case.evaluation.reach[event.name].releases,
            **chance_columns("reach", case.evaluation.reach[event.name]),
            **chance_columns("failure", failure(case.evaluation, event.name)),
            "cost": case.evaluation.by_event[event.name],
        }
        for event in site.events
        for case in done.cases
    ]


CHECK_FILES = ("checks.csv", "design_sheet.csv", "demand.csv", "demand.png")
"""Files of the checks."""

FOUND_LAYOUT = "layout found"
"""Name of the layout of a designer in the design sheets."""


def write_checks(done: DesignStudy, out: Path) -> None:
    """Write the checks of the layout found, the design sheets and the demand along the slope."""
    rows = [_check_row(check) for check in done.checks.table]
    write_rows(out / "checks.csv", rows, CHECK_COLUMNS)
    write_rows(out / "design_sheet.csv", [*sheet_rows(done.rule, done.checks)], SHEET_COLUMNS)
    along = [*demand_rows(done.problem, done.rule.envelope)]
    write_rows(out / "demand.csv", along, DEMAND_COLUMNS)
    layouts = {done.rule.name: done.rule.layout, done.chosen.name: done.chosen.evaluation.layout}
    pictures.draw_demand(out / "demand.png", done.problem, along, layouts)


CHECK_COLUMNS = (
    "barrier", "x_m", "check", "demand", "capacity", "unit", "use", "limit", "satisfied", "note",
    "existing",
)  # fmt: skip
"""Columns of the table of checks."""


def _check_row(check: BarrierCheck) -> dict[str, Any]:
    """Return a check as a row of a CSV file."""
    return {
        "barrier": check.barrier,
        "x_m": check.x,
        "check": check.check,
        "demand": check.demand,
        "capacity": check.capacity,
        "unit": check.unit,
        "use": check.use,
        "limit": check.limit,
        "satisfied": check.satisfied,
        "note": check.note,
        "existing": check.existing,
    }


SHEET_COLUMNS = ("layout", "fence", "quantity", "symbol", "value", "unit", "basis")
"""Columns of the design sheets."""


def sheet_rows(answer: RuleAnswer, checks: LayoutChecks) -> Iterator[dict[str, Any]]:
    """Yield the rows of the design sheets of the rule's fence and of the fences of a layout."""
    own = [] if answer.check is None else [answer.check]
    name = answer.name if answer.name == rule.RULE_NAME else "nearest to the rule"
    for layout, found in ((name, own), (FOUND_LAYOUT, checks.fences)):
        for check in found:
            yield from _sheet(layout, check)


def _sheet(layout: str, check: FenceCheck) -> Iterator[dict[str, Any]]:
    """Yield the rows of the design sheet of a fence."""
    for row in check.rows():
        yield {"layout": layout, "fence": check.fence.label} | row._asdict()


DEMAND_COLUMNS = (
    "x_m", "covered", "event_energy", "passing", "velocity_m_s", "velocity_low_m_s",
    "velocity_high_m_s", "design_energy_kJ", "demanded_energy_kJ", "demanded_class_kJ",
    "event_height", "height_m", "height_low_m", "height_high_m", "needed_height_m",
    "classes_that_fit_kJ",
)  # fmt: skip
"""Columns of the table of the demand along the slope."""


def demand_rows(problem: DesignProblem, envelope: DesignEnvelope) -> Iterator[dict[str, Any]]:
    """Yield the rows of the demand along the slope.

    `classes_that_fit_kJ` lists the classes of fences that satisfy the rule at the station, also in
    height and elongation, and may be built there.
    """
    menu, factors = Menu(problem), problem.site.rule
    for demand in demands(envelope, factors):
        hard, high = demand.hard, demand.high
        fit = [fence.rated for fence in rule.fences(menu, demand)]
        fit = fit if demand.covered >= rule.COVERED else []
        yield {
            "x_m": demand.x,
            "covered": demand.covered,
            "event_energy": hard.event.name,
            "passing": round(hard.passing),
            "velocity_m_s": hard.speed.value,
            "velocity_low_m_s": hard.speed.low,
            "velocity_high_m_s": hard.speed.high,
            "design_energy_kJ": 1e-3 * hard.energy(),
            "demanded_energy_kJ": hard.energy() * factors.energy / factors.rated(1),
            "demanded_class_kJ": demand.least_class or "none",
            "event_height": high.event.name,
            "height_m": high.height.value,
            "height_low_m": high.height.low,
            "height_high_m": high.height.high,
            "needed_height_m": high.needed_height(),
            "classes_that_fit_kJ": " ".join(map(str, fit)),
        }


def rule_words(answer: RuleAnswer) -> str:
    """Return in words what the rule requires, or which barrier replaces its fence and why."""
    caveat = f"; {answer.caveat}" if answer.caveat else ""
    if answer.name == rule.RULE_NAME and answer.check is not None:
        check = answer.check
        uses = ", ".join(f"{name} {_figure(use)}" for name, use in check.uses.items())
        place = f"{check.fence.label}, at {check.fence.x:.1f} m"
        return f"rule (UNI 11211-4): {place}; utilisation: {uses}{caveat}"
    stands = "" if not answer.layout else f"; shown instead: {answer.layout[0].label}"
    return f"the rule (UNI 11211-4) gives no fence: {answer.reason}{caveat}{stands}"


def check_table(checks: LayoutChecks) -> Table:
    """Return the table of checks, at most 80 characters wide."""
    out = empty_table(("barrier", "demand", "capacity", "unit", "use", "at most", ""))
    last = ""
    for check in checks.table:
        head = f"{check.barrier}, at {check.x:.1f} m"
        if head != last:
            out.add_row(head)
            last = head
        cells = map(_figure, (check.demand, check.capacity))
        met = "" if check.satisfied else "NOT MET"
        out.add_row(
            f"  {check.check}", *cells, check.unit, _figure(check.use), _figure(check.limit), met
        )
    return out


def _figure(value: float) -> str:
    """Return a number with three figures, or as a whole number from 100 on."""
    if not math.isfinite(value):
        return "inf"
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def check_notes(checks: LayoutChecks) -> Iterator[str]:
    """Yield lines on checks that are not met and on barriers that nothing reaches."""
    for check in checks.table:
        if not check.satisfied:
            yield f"not met: {check.barrier}, {check.check}: {check.note}"
    for barrier, x, note in dict.fromkeys((c.barrier, c.x, c.note) for c in checks.table):
        if OUTSIDE_CHART in note:
            yield f"the checks of the {barrier}, at {x:.1f} m, are not verified: {note}"
    for barrier, x in dict.fromkeys((c.barrier, c.x) for c in checks.table):
        if "embankment" in barrier:
            yield (
                f"the {barrier}, at {x:.1f} m, was not checked for the penetration of a block into "
                "its crest, nor for the stability of its slopes and of the ground"
            )
    for barrier in checks.idle:
        yield f"no block of the design events reaches the {barrier}"


FRONTIER_FILES = ("frontier.csv", "frontier.png")


def write_frontier(folder: Path, problem: DesignProblem, front: Sequence[TriedLayout]) -> None:
    """Write the CSV file and the picture of a frontier, or remove old ones if it is empty."""
    if front:
        write_rows(folder / FRONTIER_FILES[0], frontier_rows(problem.site, front))
        draw_frontier(folder / FRONTIER_FILES[1], problem, front)
        return
    remove_results(folder, FRONTIER_FILES)


def frontier_rows(site: Site, front: Sequence[TriedLayout]) -> list[dict[str, Any]]:
    """Return the rows of the CSV file: costs in EUR per metre, Z in EUR per metre and year.

    `reach_bound` is the one-sided 95 % upper bound. The probability of a failure is empty if no
    barrier can fail, and Z is empty for a layout that is not verified.
    """
    found = []
    for one in front:
        z, fallible = one.verified, can_fail(site, one.layout)
        found.append(
            {
                "cost": one.cost,
                "reach": one.reach.probability,
                "reach_bound": one.level,
                "failure": one.failure.probability if fallible else math.nan,
                "failure_bound": one.failure.bound if fallible else math.nan,
                "releases": one.reach.releases,
                "verified": z is not None,
                "objective": z.objective if z else "",
                "objective_low": z.ci[0] if z else "",
                "objective_high": z.ci[1] if z else "",
                "barriers": json.dumps(to_tables(one.layout)),
            }
        )
    return found


def frontier_table(site: Site, front: Sequence[TriedLayout]) -> Table:
    """Return the table of a frontier, at most 80 characters wide."""
    out = empty_table(("layout", "to build", "reaches road", "fails", "Z", "of"))
    for one in front:
        z = euros(one.verified.objective) if one.verified else "not verified"
        known = can_fail(site, one.layout) and one.failure.releases
        fails = percent(one.failure.probability) if known else "-"
        count = f"{one.reach.releases:,}"
        out.add_row(brief(site, one.layout), euros(one.cost), bounded(one.reach), fails, z, count)
    return out


def brief(site: Site, layout: Layout) -> str:
    """Return the kinds and chainages of a layout in words."""
    return " + ".join(b.label_and_place for b in layout) or unchanged(site)


def draw_frontier(path: Path, problem: DesignProblem, front: Sequence[TriedLayout]) -> None:
    """Write a PNG diagram of P(reach) against the capital cost of the layouts of a frontier."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(pictures.FONT):
        figure = Figure((9.0, 5.4), dpi=pictures.DPI, layout="constrained")
        axes = figure.subplots()
        cost = [one.cost for one in front]
        axes.step(
            cost, [100.0 * one.level for one in front], where="post", color="#0072b2",
            linewidth=1.4, label="95 % upper bound: no layout that was tried is cheaper and lower",
        )  # fmt: skip
        for verified, colour, words in (
            (True, "#0072b2", "P(reach) on the releases of the verification"),
            (False, "#9aa5b1", "P(reach) in the search, not verified"),
        ):
            own = [one for one in front if (one.verified is not None) == verified]
            if own:
                axes.plot([one.cost for one in own],
                          [100.0 * one.reach.probability for one in own], "o", color=colour,
                          label=words)  # fmt: skip
        if problem.targets.reach is not None:
            axes.axhline(100.0 * problem.targets.reach, color="#d0312d", linestyle="--",
                         label=f"target: {percentage(problem.targets.reach)}")  # fmt: skip
        axes.set(xlabel="cost to build [EUR per metre of road]", ylabel="P(reach) [%]")
        axes.set(xlim=(0.0, None), ylim=(0.0, None))
        axes.grid(alpha=0.25)
        figure.legend(loc="outside lower center", ncols=1, frameon=False)
        pictures.save(figure, path)


BAND_FILES = ("band.csv", "band.png")


def band_rows(band: Band) -> list[dict[str, Any]]:
    """Return one row for each ground and layout.

    The probability of a failure is empty if no barrier can fail.
    """
    out = []
    for i, sample in enumerate(band.samples):
        for case in sample.cases:
            e = case.evaluation
            row: dict[str, Any] = {"ground": i + 1} | sample.values | {"layout": case.name}
            row |= {"Z": e.objective, "Z_low": e.ci[0], "Z_high": e.ci[1]}
            row |= {"capital": e.capital, "harm": e.harm, "repair": e.repair}
            for event in band.events:
                row[f"P(reach) of {event}"] = e.reach[event].probability
                failure = e.failure[event].probability if case.fallible else math.nan
                row[f"P(failure) of {event}"] = failure
            chosen = case is sample.cases[-1]
            row |= {"releases": e.releases, "state": sample.state if chosen else ""}
            out.append(row)
    return out


def write_band(folder: Path, band: Band) -> None:
    """Write `BAND_FILES` into a folder."""
    write_rows(folder / "band.csv", band_rows(band))
    draw_band(folder / "band.png", band)


def band_table(band: Band) -> Table:
    """Return the table of the least, median and greatest values over the grounds.

    P(reach) is the greatest of the design events on a ground.
    """
    head = ["layout", "Z: median", "least to greatest"]
    if band.events:
        head.append("P(reach)")
    out = empty_table(head)
    for i, case in enumerate(band.samples[0].cases):
        own = [sample.cases[i].evaluation for sample in band.samples]
        z = [e.objective for e in own]
        cells = [case.name, euros(float(np.median(z))), span((min(z), max(z)))]
        if band.events:
            worst = [max(e.reach[name].probability for name in band.events) for e in own]
            cells.append(f"{percent(min(worst), 'down')} to {percent(max(worst), 'up')}")
        out.add_row(*cells)
    return out


def band_on_target(band: Band) -> str:
    """Return a text that says on how many grounds the targets are met; empty without targets."""
    states = [sample.targets for sample in band.samples if sample.targets is not None]
    if not states:
        return ""
    counts = {state: states.count(state) for state in (MET, UNDECIDED, MISSED)}
    words = ", ".join(f"{state} on {count}" for state, count in counts.items() if count)
    return f"the targets are {words} of {len(states)} grounds"


def band_verdict(band: Band) -> str:
    """Return a text that says on how many grounds the chosen layout is the cheapest.

    The choice survives if it is the cheapest on all of them, and it depends on the ground if it
    misses the targets or costs more than another layout on some. Differences within the noise show
    neither.
    """
    states = [sample.state for sample in band.samples]
    count, missed = len(states), states.count("missed")
    if missed == count:
        words = f"on {count} of {count} grounds, the chosen layout misses the targets"
        return f"{words}: costs are not compared"
    asked = any(sample.targets is not None for sample in band.samples)
    rest = "those that do not miss the targets" if asked else "these"
    words = f"on {states.count('cheapest')} of {count} grounds, the chosen layout is the cheapest"
    words += f" of {rest}"
    if undecided := states.count("undecided"):
        words += f"; on {undecided}, another one is cheaper by no more than the noise"
    if missed:
        words += f"; on {missed}, it misses the targets"
    if lost := [sample for sample in band.samples if sample.state == "dearer"]:
        rivals = dict.fromkeys(sample.cheapest.name for sample in lost)
        named = " or ".join(repr(name) for name in rivals)
        most = max(s.cases[-1].priced.objective - s.cheapest.priced.objective for s in lost)
        words += f"; on {len(lost)}, {named} is cheaper by up to {euros(most)} EUR per metre and "
        words += "year"
    if missed or lost:
        return f"{words}: the choice depends on the ground"
    if undecided:
        return (
            f"{words}: these releases show neither that the choice survives nor that it depends on "
            "the ground"
        )
    return f"{words}: the choice survives"


def draw_band(path: Path, band: Band) -> None:
    """Write the picture: Z of each layout on each ground, ordered by Z without barriers."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    order = sorted(band.samples, key=lambda sample: sample.cases[0].priced.objective)
    x = np.arange(len(order))
    with rc_context(FONT):
        figure = Figure((9.0, 5.0), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        for i, case in enumerate(order[0].cases):
            own = [sample.cases[i].evaluation for sample in order]
            z = np.array([e.objective for e in own])
            ends = np.abs(np.array([e.ci for e in own]).T - z)
            axes.errorbar(
                x + 0.08 * (i - 1.5), z, ends, fmt=MARKERS[i % len(MARKERS)], capsize=3,
                color=EVENTS[i % len(EVENTS)], label=case.name,
            )  # fmt: skip
        axes.set_xticks(x, [str(band.samples.index(sample) + 1) for sample in order])
        axes.set(xlabel=f"ground ({band.source}), by Z without new barriers",
                 ylabel="Z [EUR per metre of road and year]")  # fmt: skip
        axes.set_ylim(bottom=0.0)
        axes.grid(axis="y", alpha=0.25)
        figure.legend(loc="outside lower center", ncols=4, frameon=False)
        save(figure, path)


DESIGN_FILES = (
    "evaluations.csv", "evaluations.jsonl", archive.ARCHIVE_FILE, "layouts.csv", "chances.csv",
    "layout.toml", "section.png", "cost.png", "episode.rrd", *CHECK_FILES,
)  # fmt: skip


DRAWN_RELEASES = 50
"""Number of releases among which one that reaches the road without barriers is sought."""


def write_design(done: DesignStudy, out: Path, seed: int) -> None:
    """Write the files of a study except its evaluations into `out`.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    write_rows(out / "layouts.csv", layout_rows(done))
    write_rows(out / "chances.csv", chance_rows(done))
    write_risks(out, known_risks(done))
    rigdda.save_layout(done.chosen.evaluation.layout, out / "layout.toml")
    _section(done, out / "section.png", seed)
    write_frontier(out, done.problem, done.frontier)
    tried = [entry.evaluation for entry in done.result.history.stage("search")]
    points = [pictures.Point.of(case.name, case.evaluation) for case in done.cases]
    reference = pictures.Point(SHED, done.problem.site.shed(), 0.0, (0.0, 0.0))
    pictures.cost_against_risk(out / "cost.png", tried, [*points, reference])
    _replay(done, out / "episode.rrd", seed)
    write_checks(done, out)


def _section(done: DesignStudy, path: Path, seed: int) -> None:
    """Draw the slope without barriers and with the layout."""
    site, chosen = done.problem.site, done.chosen
    nothing = _all(site, (), seed)
    bare = "As it stands" if site.existing else "Without barriers"
    panels = [Panel(f"{bare}: {_words(done.nothing)}", (), nothing)]
    layout = chosen.evaluation.layout
    if layout:
        panels.append(Panel(f"With the layout: {_words(chosen)}", layout, _all(site, layout, seed)))
    # a quick study draws a rough picture
    blocks = min(ENVELOPE_BLOCKS, done.nothing.evaluation.releases)
    found = envelopes(site, (), release_seeds("ensemble", seed, blocks), along(site))
    section(path, site, done.problem.zone, panels, found, bare)


def _all(site: Site, layout: Layout, seed: int) -> list[EventTrajectories]:
    """Simulate releases of every event of a site."""
    seeds = release_seeds("ensemble", seed, DRAWN_TRAJECTORIES)
    return [trajectories(site, layout, event.name, seeds) for event in site.events]


def _words(case: VerifiedLayout) -> str:
    e = case.evaluation
    return f"Z = {euros(e.objective)} ({span(e.ci)}) EUR per metre and year"


def _replay(done: DesignStudy, path: Path, seed: int) -> None:
    """Write a replay of the layout in a release that would reach the road without barriers.

    The release is of the event with the largest risk without barriers.
    """
    site, nothing, chosen = done.problem.site, done.nothing, done.chosen
    event = findings.worst(nothing.evaluation) or site.event_names[0]
    seeds = release_seeds("verification", seed, DRAWN_RELEASES)
    bare = done.problem.sample((), {event: seeds})
    drawn = next((s for s, o in zip(seeds, bare, strict=True) if o.reached), seeds[0])
    layout = chosen.evaluation.layout
    run, outcome = rigdda.release(site, layout, drawn, event)
    risk = nothing.evaluation.by_event[event]
    notes = {
        "layout": "; ".join(b.label for b in layout) or unchanged(site),
        "event": f"{event}, {euros(risk)} EUR per metre and year {before(site)}",
        "release": f"seed {drawn}, {outcome.road_volume:.2g} of {outcome.released_volume:.2g} m3 "
        "reach the road",
        before(site): _words(nothing),
        "with the layout": _words(chosen),
    }
    labels = site.labels(layout)
    road = site.road.start, site.road.end
    record = release_record(site, layout, drawn, event, outcome)
    run.to_rerun(path, Marks(road, notes, f"{site.name}: {chosen.name}", labels, record))
