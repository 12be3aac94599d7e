"""Risk that remains with a layout, and trials of the largest barriers against its worst event."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigdda import Barrier, Layout
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.agents.designers.menu import Menu
from rigdda.app.design_study import design_events
from rigdda.app.reports import findings
from rigdda.app.reports.wording import figure
from rigdda.envs import DesignProblem, Evaluation
from rigdda.seeds import release_seeds

STATIONS = 3
"""Number of places in the zone where each kind is tried; the last one is near the road."""


LARGE = 0.9
"""Least size of a barrier that is tried, divided by the largest size of its kind [-]."""


RELEASES = 4
"""Number of releases of the event with each barrier that is tried."""


HOLDS = 0.5
"""An event counts as stopped if at most this share of its releases reaches the road [-]."""


def remaining_risk(
    problem: DesignProblem,
    verified: Sequence[Evaluation],
    tried: Sequence[TriedLayout],
    seed: int,
) -> str:
    """Return a text on the risk that remains with the last of the verified layouts.

    The text also says if none of the largest barriers stops the event that causes most of this
    risk.
    """
    words, most = findings.left_over(verified[-1]), findings.worst(verified[-1])
    if most is None or any(e.reach[most].probability <= HOLDS for e in verified):
        return words
    if most in design_events(problem.site) and any(
        len(one.layout) == 1 and one.reach.releases and one.reach.probability <= HOLDS
        for one in tried
    ):
        return words
    trials = failed_trials(problem, most, seed)
    return f"{trials}: {words}" if trials else words


def trial_layouts(problem: DesignProblem) -> tuple[Layout, ...]:
    """Return layouts with one of the largest barriers of each kind, at `STATIONS` places each.

    Mesh and removals are left out because they do not stop an event.
    """
    menu, found = Menu(problem), list[Barrier]()
    for kind in problem.kinds:
        barriers = (
            [menu.put(b.thickest(menu.zone), b.x) or b for b in menu.singles(kind)]
            if kind not in ("mesh", "removal")
            else []
        )
        least = LARGE * max((b.size for b in barriers), default=0.0)
        large = sorted((b for b in barriers if b.size >= least), key=lambda b: b.x)
        places = np.linspace(0, len(large) - 1, min(STATIONS, len(large))).round().astype(int)
        found += [large[i] for i in places.tolist()]
    return tuple((barrier,) for barrier in found)


def failed_trials(problem: DesignProblem, event: str, seed: int) -> str:
    """Return a text that says that none of the largest single barriers stops an event.

    It gives the range of the volumes of these releases, which are the same with each barrier. The
    text is empty if one of the barriers stops the event in half of the releases or more, or if none
    may be built.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    layouts, volumes = trial_layouts(problem), list[float]()
    seeds = {event: release_seeds("ensemble", seed, RELEASES)}
    for layout in layouts:
        outcomes = problem.sample(layout, seeds)
        volumes = [outcome.released_volume / outcome.width for outcome in outcomes]
        if sum(outcome.reached for outcome in outcomes) <= HOLDS * len(outcomes):
            return ""
    if not layouts:
        return ""
    low, high = min(volumes), max(volumes)
    size = figure(low) if low == high else f"{figure(low, 'down')} to {figure(high, 'up')}"
    return (
        f"none of {len(layouts)} large single barriers that were tried stops the event {event!r} "
        f"in at least half of {RELEASES} releases of {size} m3 per metre"
    )
