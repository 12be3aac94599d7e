"""Figures of a layout from the outcomes of its releases: those that `rigdda study` computes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rigdda import Layout, Site
from rigdda.app.barrier_checks import LayoutChecks, check_layout
from rigdda.app.page.known_layout import CURRENT, MOST_BARRIERS, NOTHING, LiveFigures, Outcomes
from rigdda.app.page.placing import kinds_for
from rigdda.app.reports import study_report
from rigdda.app.reports.study_report import StudiedLayout, StudyResults
from rigdda.barriers import KINDS
from rigdda.envs import DesignProblem
from rigdda.envs.cost import account
from rigdda.envs.siting import Rules


def study_layouts(layout: Layout) -> dict[str, Layout]:
    """Return the layouts of the study of a page: the slope without the layout, and the layout."""
    return {NOTHING: (), CURRENT: layout} if layout else {NOTHING: ()}


def study_table(site: str, layout: Layout, file: str, releases: int) -> dict[str, Any]:
    """Return the content of a study file that computes the figures of the page.

    Parameters
    ----------
    site, file : str
        The site file and the layout file, as seen from the folder of the study file.
    layout : Layout
        The layout.
    releases : int
        Number of releases of each event.
    """
    tables: list[dict[str, Any]] = [{"name": NOTHING}]
    if layout:
        tables.append({"name": CURRENT, "file": file})
    return {"site": site, "releases": releases, "layouts": tables}


def results_of(
    site: Site, layouts: Mapping[str, Layout], seen: Mapping[str, Outcomes]
) -> StudyResults:
    """Return the results of a study from the outcomes of its releases.

    Parameters
    ----------
    site : Site
        The site.
    layouts : dict of str to Layout
        The layouts of the study by name.
    seen : dict of str to dict of str to list of Outcome
        For each layout the outcomes of each event, as many of each.

    Returns
    -------
    StudyResults
        The results, equal to those of `rigdda study` on the same releases.
    """
    studied = []
    for name, layout in layouts.items():
        outcomes = [outcome for event in site.event_names for outcome in seen[name][event]]
        hits = [max((b.max_energy for b in o.barriers), default=0.0) for o in outcomes]
        studied.append(
            StudiedLayout(
                name,
                layout,
                account(site, layout, outcomes),
                on_road=1e-3 * np.array([o.max_energy_on_road for o in outcomes]),
                hit=1e-3 * np.array(hits),
                released=np.array([o.released_volume for o in outcomes]),
                widths=np.array([o.width for o in outcomes]),
            )
        )
    return StudyResults.of(site, studied)


def broken_rules(site: Site, layout: Layout) -> tuple[str, ...]:
    """Return the siting rules that a layout breaks, each with its reason."""
    rules = Rules(site, site.barrier_zone)
    found = rules.violations(layout, tuple(KINDS), MOST_BARRIERS)
    return tuple(dict.fromkeys(map(str, found)))


def checked(site: Site, layout: Layout) -> LayoutChecks:
    """Return the checks of the barriers of a layout."""
    problem = DesignProblem(site, max_barriers=MOST_BARRIERS, kinds=kinds_for(site))
    return check_layout(problem, layout)


def updated(results: StudyResults, before: LiveFigures, count: int) -> LiveFigures:
    """Return figures that were known before with those of the results of a study."""
    rows = study_report.layout_rows(results)
    name = rows[-1]["layout"]
    risk = results.risk(results.layouts[-1])
    return before._replace(
        releases=count,
        costs=rows[-1],
        bare=rows[0],
        events=tuple(r for r in study_report.event_rows(results) if r["layout"] == name),
        individual=None if risk is None else (risk.individual.value, *risk.individual.interval),
        doing="more releases",
    )
