"""Live figures: what a layout costs and lets through, from releases that are computed meanwhile.

A thread computes releases of the layout on the page, and of the slope without it, in rounds of more
and more releases of each event. The figures are those of a study (`rigdda study`) of the same
releases. When the layout or the site changes, the thread leaves what it does and begins anew.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import msgspec
import numpy as np

import rigdda
from rigdda import BadInput, Error, Layout, Outcome, Site
from rigdda.app.barrier_checks import LayoutChecks, check_layout
from rigdda.app.page.placing import kinds_for
from rigdda.app.reports import study_report
from rigdda.app.reports.study_report import StudiedLayout, StudyResults
from rigdda.barriers import KINDS
from rigdda.envs import DesignProblem
from rigdda.envs.cost import Account, account, learn
from rigdda.envs.outcome_cache import release_key

NOTHING, CURRENT = "without it", "layout"
"""Names of the two layouts of a study of the page."""

ROUNDS = (10, 25, 50, 100, 200, 400, 800, 1600)
"""Numbers of releases of each event after each round."""

CHECKED = 50
"""Releases of each event after which the barriers are checked."""

CHUNK, PATIENCE = 4, 0.15
"""Number of releases that are simulated together at first, and the time that those of one chunk may
take [s]: a change of the layout waits for them."""

MOST_KEPT = 24
"""Number of layouts whose outcomes are remembered."""

MOST_BARRIERS = 8
"""Greatest number of barriers of a layout on the page."""

Outcomes = dict[str, list[Outcome]]
"""Outcomes of the releases with seeds 0, 1, 2, ... of each event."""


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


def results_of(site: Site, layouts: Mapping[str, Layout], seen: Mapping[str, Outcomes]) -> Any:
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
    flat = {n: [o for event in site.event_names for o in seen[n][event]] for n in layouts}
    accounts = {name: account(site, layouts[name], flat[name]) for name in layouts}
    studied = tuple(
        StudiedLayout(
            name,
            layouts[name],
            accounts[name],
            np.array([1e-3 * outcome.max_energy_on_road for outcome in flat[name]]),
            np.array([1e-3 * max((b.max_energy for b in o.barriers), default=0.0)
                      for o in flat[name]]),
        )
        for name in layouts
    )  # fmt: skip
    together = _joined(list(accounts.values()))
    outcomes = [outcome for name in layouts for outcome in flat[name]]
    released = np.array([outcome.released_volume for outcome in outcomes])
    widths = np.array([outcome.width for outcome in outcomes])
    facts = {}
    for event in site.event_names:
        own = together.event == event
        facts[event] = learn(site, together.of(own), released[own], widths[own], 1.0)
    return StudyResults(site, studied, facts)


def _joined(parts: list[Account]) -> Account:
    """Return the account of several accounts one after another."""
    tolls = [part.toll for part in parts if part.toll is not None]

    def column(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts])

    names = ("event", "harm", "repair", "volume", "reached", "failed")
    toll = np.concatenate(tolls) if tolls else None
    return Account(**{name: column(name) for name in names}, toll=toll)


class LiveFigures(NamedTuple):
    """What is known of a layout."""

    layout: Layout
    releases: int
    """Releases of each event that the figures are of; 0 before the first round has ended."""
    costs: Mapping[str, Any] | None = None
    """Z and its parts, a row of layouts.csv of the study."""
    events: tuple[Mapping[str, Any], ...] = ()
    """The rows of events.csv of the study for this layout."""
    bare: Mapping[str, Any] | None = None
    """Z and its parts without the layout."""
    individual: tuple[float, float, float] | None = None
    """Individual risk with its interval [1/year]; None without traffic."""
    checks: LayoutChecks | None = None
    broken: tuple[str, ...] = ()
    """Siting rules that the layout breaks, with the reason."""
    fault: str = ""
    """Why the layout cannot be simulated; empty if it can."""
    doing: str = ""
    """What is being computed; empty if nothing is."""


def broken_rules(site: Site, layout: Layout) -> tuple[str, ...]:
    """Return the siting rules that a layout breaks, each with its reason."""
    problem = DesignProblem(site, max_barriers=MOST_BARRIERS)
    found = problem.place.violations(layout, tuple(KINDS), MOST_BARRIERS)
    return tuple(dict.fromkeys(map(str, found)))


@dataclass
class _Known:
    """The outcomes of a site that have been computed, by layout; the oldest are forgotten."""

    key: bytes = b""
    outcomes: dict[Layout, Outcomes] = field(default_factory=dict)

    def of(self, site: Site, layout: Layout) -> Outcomes:
        key = release_key(site) + msgspec.json.encode(site.existing)
        if key != self.key:
            self.key, self.outcomes = key, {}
        found = self.outcomes.pop(layout, None) or {name: [] for name in site.event_names}
        self.outcomes[layout] = found
        others = [one for one in self.outcomes if one]  # the bare slope is never forgotten
        for old in others[: max(0, len(others) - MOST_KEPT)]:
            del self.outcomes[old]
        return found


class Live:
    """The thread that computes figures of one layout after another.

    Parameters
    ----------
    most : int
        Releases of each event after which the thread rests.

    Attributes
    ----------
    figures : LiveFigures or None
        What is known of the layout that was asked for last; None before the first. It is replaced
        as a whole, so that any thread may read it.
    revision : int
        Number that grows with each replacement.
    """

    def __init__(self, most: int = ROUNDS[-1]):
        self.most = most
        self.figures: LiveFigures | None = None
        self.revision = 0
        self._known = _Known()
        self._ready: dict[Layout, LiveFigures] = {}
        self._ready_site: Site | None = None
        self._asked: tuple[Site, Layout] | None = None
        self._generation = 0
        self._wake = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="live figures", daemon=True)
        self._thread.start()

    def ask(self, site: Site, layout: Layout) -> None:
        """Compute the figures of a layout from now on."""
        with self._wake:
            if self._asked == (site, layout):
                return
            self._asked, self._generation = (site, layout), self._generation + 1
            self._wake.notify_all()

    def known(self, site: Site, layout: Layout) -> LiveFigures | None:
        """Return the figures of a layout that was asked for earlier, if they are remembered."""
        with self._wake:
            return self._ready.get(layout) if self._ready_site == site else None

    def close(self) -> None:
        """End the thread when it has computed its present releases."""
        with self._wake:
            self._closed, self._generation = True, self._generation + 1
            self._wake.notify_all()
        self._thread.join()

    def _work(self) -> None:
        done = 0
        while True:
            with self._wake:
                while not self._closed and self._generation == done:
                    self._wake.wait()
                if self._closed:
                    return
                assert self._asked is not None
                (site, layout), done = self._asked, self._generation
            try:
                self._compute(site, layout, done)
            except Error as error:
                self._show(done, LiveFigures(layout, 0, fault=str(error)))
            except Exception as error:  # the thread lives as long as the page
                traceback.print_exc()
                self._show(done, LiveFigures(layout, 0, fault=f"{type(error).__name__}: {error}"))

    def _show(self, generation: int, figures: LiveFigures) -> None:
        with self._wake:
            if generation == self._generation:
                self.figures, self.revision = figures, self.revision + 1
                if figures.costs is not None and self._asked is not None:
                    if self._ready_site != self._asked[0]:
                        self._ready, self._ready_site = {}, self._asked[0]
                    self._ready[figures.layout] = figures

    def _left(self, generation: int) -> bool:
        return generation != self._generation

    def _compute(self, site: Site, layout: Layout, generation: int) -> None:
        """Compute round after round until there is something else to do."""
        broken = broken_rules(site, layout)
        shown = LiveFigures(layout, 0, broken=broken, doing="starting")
        self._show(generation, shown)
        try:
            site.realise(layout, 0, site.event_names[0])
            site.capital(layout)
        except BadInput as bad:
            self._show(generation, shown._replace(fault=str(bad), doing=""))
            return
        layouts = study_layouts(layout)
        for count in (n for n in ROUNDS if n <= self.most):
            seen = {name: self._known.of(site, one) for name, one in layouts.items()}
            for words in self._fill(site, layouts, seen, count):
                if self._left(generation):
                    return
                self._show(generation, shown._replace(doing=words))
            short = {n: {e: o[:count] for e, o in of.items()} for n, of in seen.items()}
            shown = _figures(results_of(site, layouts, short), shown, count)
            if count >= CHECKED and shown.checks is None and not broken and layout:
                self._show(generation, shown._replace(doing="checking the barriers"))
                shown = shown._replace(checks=self._checked(site, layout))
            self._show(generation, shown)
            if self._left(generation):
                return
        self._show(generation, shown._replace(doing=""))

    @staticmethod
    def _checked(site: Site, layout: Layout) -> LayoutChecks:
        problem = DesignProblem(site, max_barriers=MOST_BARRIERS, kinds=kinds_for(site))
        return check_layout(problem, layout)

    def _fill(
        self, site: Site, layouts: Mapping[str, Layout], seen: Mapping[str, Outcomes], count: int
    ) -> Iterator[str]:
        """Simulate the releases that are missing, and yield after some of them how many there are.

        The layout comes first: a user waits for it.
        """
        for name in reversed(list(layouts)):
            for event in site.event_names:
                own = seen[name][event]
                step = CHUNK
                while len(own) < count:
                    end = min(count, len(own) + step)
                    jobs = [(site, layouts[name], k, event) for k in range(len(own), end)]
                    start = time.monotonic()
                    own += rigdda.release_many(jobs)
                    quick = time.monotonic() - start < PATIENCE
                    step = 2 * step if quick else max(1, step // 2)
                    yield f"{event}: {len(own):,} of {count:,} releases"


def _figures(results: StudyResults, before: LiveFigures, count: int) -> LiveFigures:
    """Return the figures of the results of a study."""
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
