"""Files that a design writes besides its evaluations: layout, pictures and replay."""

from __future__ import annotations

from pathlib import Path

import rigdda
from rigdda import Layout, Site
from rigdda.agents.designers.protocol import release_seeds
from rigdda.app import archive
from rigdda.app.design_study import SHED, DesignStudy, VerifiedLayout
from rigdda.app.reports import checks, findings, frontier_report, layout_tables, pictures
from rigdda.app.reports.pictures import (
    DRAWN,
    ENOUGH,
    Panel,
    Trajectories,
    envelopes,
    section,
    trajectories,
)
from rigdda.app.reports.simulation_folder import along
from rigdda.app.reports.tables import known_risks, write_risks, write_rows
from rigdda.app.reports.wording import before, euros, span, unchanged
from rigdda.envs.replay_record import release_record
from rigdda.replay.recording import Marks

FILES = (
    "evaluations.csv", "evaluations.jsonl", archive.FILE, "layouts.csv", "chances.csv",
    "layout.toml", "section.png", "cost.png", "episode.rrd", *checks.FILES,
)  # fmt: skip


SEEN = 50
"""Number of releases among which one that reaches the road without barriers is sought."""


def write(done: DesignStudy, out: Path, seed: int) -> None:
    """Write the files of a study except its evaluations into `out`.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    write_rows(out / "layouts.csv", layout_tables.layouts(done))
    write_rows(out / "chances.csv", layout_tables.chances(done))
    write_risks(out, known_risks(done))
    rigdda.save_layout(done.chosen.evaluation.layout, out / "layout.toml")
    _section(done, out / "section.png", seed)
    frontier_report.write(out, done.problem, done.frontier)
    tried = [entry.evaluation for entry in done.result.history.stage("search")]
    points = [pictures.Point.of(case.name, case.evaluation) for case in done.cases]
    reference = pictures.Point(SHED, done.problem.site.shed(), 0.0, (0.0, 0.0))
    pictures.cost(out / "cost.png", tried, [*points, reference])
    _replay(done, out / "episode.rrd", seed)
    checks.write(done, out)


def _section(done: DesignStudy, path: Path, seed: int) -> None:
    """Draw the slope without barriers and with the layout."""
    site, chosen = done.problem.site, done.chosen
    nothing = _all(site, (), seed)
    bare = "As it stands" if site.existing else "Without barriers"
    panels = [Panel(f"{bare}: {_words(done.nothing)}", (), nothing)]
    layout = chosen.evaluation.layout
    if layout:
        panels.append(Panel(f"With the layout: {_words(chosen)}", layout, _all(site, layout, seed)))
    blocks = min(ENOUGH, done.nothing.evaluation.releases)  # a quick study draws a rough picture
    found = envelopes(site, (), release_seeds("ensemble", seed, blocks), along(site))
    section(path, site, done.problem.zone, panels, found, bare)


def _all(site: Site, layout: Layout, seed: int) -> list[Trajectories]:
    """Simulate releases of every event of a site."""
    seeds = release_seeds("ensemble", seed, DRAWN)
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
    seeds = release_seeds("verification", seed, SEEN)
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
