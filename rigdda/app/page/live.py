"""Live figures: what a layout costs and lets through, from releases that are computed meanwhile.

A thread computes releases of the layout on the page, and of the slope without it, in rounds of more
and more releases of each event. The figures are those of a study (`rigdda study`) of the same
releases; like the command, the thread first converts rates of arrivals to those of releases. When
the layout or the site changes, the thread leaves what it does and begins anew. It imports `figures`
and the problem of design, so that the page opens sooner.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import msgspec

import rigdda
from rigdda import BadInput, Error, Layout, Site
from rigdda.app.page.known_layout import LiveFigures, Outcomes
from rigdda.app.page.loading import IMPORTING
from rigdda.app.page.portions import FIRST, next_size

if TYPE_CHECKING:
    from rigdda.app.page.rates import Released

ROUNDS = (10, 25, 50, 100, 200, 400, 800, 1600)
"""Numbers of releases of each event after each round."""

COMPARED = 100
"""Releases of each event of the layout after which the kept alternatives are computed, too, with as
many releases."""

CHECKED = 50
"""Releases of each event after which the barriers are checked."""

MOST_KEPT = 24
"""Number of layouts whose outcomes are remembered."""


@dataclass
class _Known:
    """The outcomes of a site that have been computed, by layout; the oldest are forgotten."""

    key: bytes = b""
    outcomes: dict[Layout, Outcomes] = field(default_factory=dict)

    def of(self, site: Site, layout: Layout) -> Outcomes:
        with IMPORTING:
            from rigdda.envs.outcome_cache import release_key

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
        self._released: tuple[Site, Released] | None = None
        self._ready: dict[Layout, LiveFigures] = {}
        self._ready_site: Site | None = None
        self._asked: tuple[Site, Layout, tuple[Layout, ...]] | None = None
        self._generation = 0
        self._wake = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="live figures", daemon=True)
        self._thread.start()

    def ask(self, site: Site, layout: Layout, others: Sequence[Layout] = ()) -> None:
        """Compute the figures of a layout from now on, and those of others beside it.

        Parameters
        ----------
        site : Site
            The site.
        layout : Layout
            The layout.
        others : sequence of Layout
            Layouts to compare, which are computed when there are `COMPARED` releases of `layout`.
        """
        asked = site, layout, tuple(others)
        with self._wake:
            if self._asked == asked:
                return
            self._asked, self._generation = asked, self._generation + 1
            self._wake.notify_all()

    def rest(self) -> None:
        """Leave what is being computed until a layout is asked for."""
        with self._wake:
            self._asked, self._generation = None, self._generation + 1

    def known(self, site: Site, layout: Layout) -> LiveFigures | None:
        """Return the figures of a layout that was asked for, if they are remembered."""
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
                while not self._closed and (self._generation == done or self._asked is None):
                    self._wake.wait()
                if self._closed:
                    return
                assert self._asked is not None
                (site, layout, others), done = self._asked, self._generation
            try:
                self._compute(site, layout, others, done)
            except Error as error:
                self._show(done, LiveFigures(layout, 0, error=str(error)))
            except Exception as error:  # the thread lives as long as the page
                traceback.print_exc()
                words = f"{type(error).__name__}: {error}"
                self._show(done, LiveFigures(layout, 0, error=words))

    def _show(self, generation: int, figures: LiveFigures) -> None:
        with self._wake:
            if generation == self._generation:
                self.figures, self.revision = figures, self.revision + 1
                if figures.costs is not None:
                    self._remember(figures)

    def _remember(self, figures: LiveFigures) -> None:
        """Remember the figures of a layout on the site that was asked for last."""
        assert self._asked is not None
        if self._ready_site != self._asked[0]:
            self._ready, self._ready_site = {}, self._asked[0]
        self._ready[figures.layout] = figures

    def _left(self, generation: int) -> bool:
        return generation != self._generation

    def _compute(
        self, site: Site, layout: Layout, others: Sequence[Layout], generation: int
    ) -> None:
        """Compute round after round until there is something else to do.

        `site` is that of the file; figures are of the one with the rates of releases.
        """
        with IMPORTING:
            from rigdda.app.page import figures

        broken = figures.broken_rules(site, layout)
        shown = LiveFigures(layout, 0, broken=broken, doing="starting")
        self._show(generation, shown)
        try:
            site.realise(layout, 0, site.event_names[0])
            site.capital(layout)
        except BadInput as bad:
            self._show(generation, shown._replace(fault=str(bad), doing=""))
            return
        try:
            released = self._release_rates(site, shown, generation)
        except Error as error:
            self._show(generation, shown._replace(error=str(error), doing=""))
            return
        if released is None:
            return
        where, shown = released.site, shown._replace(notes=released.notes)
        layouts = figures.study_layouts(layout)
        for count in (n for n in ROUNDS if n <= self.most):
            seen = {name: self._known.of(where, one) for name, one in layouts.items()}
            for words in self._fill(where, layouts, seen, count):
                if self._left(generation):
                    return
                self._show(generation, shown._replace(doing=words))
            short = {n: {e: o[:count] for e, o in of.items()} for n, of in seen.items()}
            shown = figures.updated(figures.results_of(where, layouts, short), shown, count)
            if count >= CHECKED and shown.checks is None and not broken and layout:
                self._show(generation, shown._replace(doing="checking the barriers"))
                shown = shown._replace(checks=figures.checked(where, layout))
            self._show(generation, shown)
            if count == min(COMPARED, self.most):
                new = [one for one in others if self._lacks(site, one, count)]
                self._compare(where, new, generation, count)
            if self._left(generation):
                return
        self._show(generation, shown._replace(doing=""))

    def _release_rates(self, site: Site, shown: LiveFigures, generation: int) -> Released | None:
        """Return a site with the rates of releases, None if there is something else to do.

        Raises
        ------
        Error
            As `rates.released` does.
        """
        with IMPORTING:
            from rigdda.app.page import rates

        if self._released is None or self._released[0] != site:
            for words in rates.simulate(site):
                if self._left(generation):
                    return None
                self._show(generation, shown._replace(doing=words))
            self._released = site, rates.released(site)
        return self._released[1]

    def _lacks(self, site: Site, layout: Layout, count: int) -> bool:
        """Return whether there are no figures of a layout of so many releases of each event."""
        known = self.known(site, layout)
        return known is None or not (known.fault or known.releases >= count)

    def _compare(self, site: Site, others: Sequence[Layout], generation: int, count: int) -> None:
        """Compute the figures of other layouts, of so many releases of each event."""
        with IMPORTING:
            from rigdda.app.page import figures

        for other in others:
            layouts = figures.study_layouts(other)
            seen = {name: self._known.of(site, one) for name, one in layouts.items()}
            found = LiveFigures(other, 0)
            try:
                for _ in self._fill(site, layouts, seen, count):
                    if self._left(generation):
                        return
                short = {n: {e: o[:count] for e, o in of.items()} for n, of in seen.items()}
                found = figures.updated(figures.results_of(site, layouts, short), found, count)
            except Error as error:
                found = found._replace(fault=str(error))
            with self._wake:
                if generation == self._generation:
                    self._remember(found._replace(doing=""))
                    self.revision += 1

    def _fill(
        self, site: Site, layouts: Mapping[str, Layout], seen: Mapping[str, Outcomes], count: int
    ) -> Iterator[str]:
        """Simulate the releases that are missing, and yield after some of them how many there are.

        The layout comes first: a user waits for it.
        """
        for name in reversed(list(layouts)):
            for event in site.event_names:
                own = seen[name][event]
                size = FIRST
                while len(own) < count:
                    end = min(count, len(own) + size)
                    jobs = [(site, layouts[name], k, event) for k in range(len(own), end)]
                    start = time.monotonic()
                    own += rigdda.release_many(jobs)
                    size = next_size(size, time.monotonic() - start)
                    yield f"{event}: {len(own):,} of {count:,} releases"
