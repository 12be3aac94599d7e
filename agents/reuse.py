"""Which releases a designer has to simulate, told from what they cost: those are its budget.

A release of one block against a fence that holds is that against any stronger fence of its place
and height. `DesignProblem.sample` simulates it once, and it is counted once. What is counted does
not depend on what else the process has simulated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from agents.store import Release
from rigdda import Fence, Layout, Site


class Reuse:
    """Counts what need not be simulated again."""

    def __init__(self, site: Site):
        bands = {source.name for source in site.sources if source.band is not None}
        alone = [e for e in site.events if e.source in bands and e.number == (1, 1)]
        self._alone = {event.name for event in alone}
        self._known: dict[tuple[object, ...], set[int]] = {}

    def spared(
        self,
        layout: Layout,
        seeds: Mapping[str, Sequence[int]],
        releases: Mapping[str, Sequence[Release]],
    ) -> int:
        """Return how many of some releases another class of a lone fence had already."""
        if len(layout) != 1 or not isinstance(layout[0], Fence):
            return 0
        fence, spared = layout[0], 0
        for name in self._alone & releases.keys():
            known = self._known.setdefault((fence.x, fence.height, name), set())
            drawn = seeds[name]
            spared += sum(
                seed in known and not release.failed
                for seed, release in zip(drawn, releases[name], strict=True)
            )
            known.update(
                seed
                for seed, release in zip(drawn, releases[name], strict=True)
                if not release.failed
            )
        return spared
