"""Layouts that were tried, and the frontier: the cheapest layout for each probability of reach.

P(reach) is the probability that a block of a design event reaches the road. Layouts have different
numbers of releases, and a layout that is tried with few of them may keep all rock off the road by
luck. They are therefore compared by the one-sided 95 % upper bound of P(reach).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from rigdda import Layout, Site
from rigdda.envs.cost import Evaluation
from rigdda.envs.intervals import Estimate, estimate


@dataclass(frozen=True, slots=True)
class TriedLayout:
    """What is known of a layout that was tried.

    Parameters
    ----------
    layout : tuple of Barrier
        The barriers.
    cost : float
        Capital cost [EUR per metre of road].
    reach, failure : Estimate
        Probability that a block reaches the road and that a barrier fails, each in the design event
        with the largest upper bound.
    verified : Evaluation or None
        Evaluation on releases that no search used. If None, the probabilities are those of all
        releases of the search with this layout.
    """

    layout: Layout
    cost: float
    reach: Estimate
    failure: Estimate
    verified: Evaluation | None = None

    @classmethod
    def of(cls, site: Site, evaluation: Evaluation) -> TriedLayout:
        """Return the layout of a verified evaluation on a site with design events."""
        reach, failure = (
            worst([seen[event.name] for event in site.events if event.design])
            for seen in (evaluation.reach, evaluation.failure)
        )
        return cls(evaluation.layout, evaluation.cost, reach, failure, evaluation)

    @property
    def level(self) -> float:
        """Upper bound of the probability that a block reaches the road [-]."""
        return self.reach.bound


def worst(chances: Sequence[Estimate]) -> Estimate:
    """Return the estimate with the largest upper bound."""
    return max(chances, key=lambda chance: chance.bound)


def frontier(tried: Iterable[TriedLayout]) -> tuple[TriedLayout, ...]:
    """Return the layouts that no other layout dominates, the cheapest first.

    A layout dominates another if it costs no more to build and has no larger upper bound of
    P(reach), and at least one of the two is smaller.
    """
    kept: list[TriedLayout] = []
    for one in sorted(tried, key=lambda one: (one.cost, one.level)):
        if not kept or one.level < kept[-1].level:
            kept.append(one)
    return tuple(kept)


Counts = tuple[int, int, int]
"""Number of releases, of those in which a block reached the road, and in which a barrier failed."""


class Tally:
    """Counts of the releases of every layout in a search.

    Parameters
    ----------
    site : Site
        The site.
    """

    def __init__(self, site: Site):
        self._design = [event.name for event in site.events if event.design]
        self._costs: dict[Layout, float] = {}
        self._counts: dict[Layout, dict[tuple[str, str], Counts]] = {}

    def add(
        self, layout: Layout, cost: float, source: str, counts: Mapping[str, Counts], more: bool
    ) -> None:
        """Add releases of a layout.

        Parameters
        ----------
        layout : Layout
            The layout.
        cost : float
            Its capital cost [EUR/m].
        source : str
            Stream of the releases.
        counts : mapping of str to Counts
            Counts by name of event.
        more : bool
            Whether the releases follow earlier ones of the stream. Otherwise they are the first of
            the stream, and replace earlier counts of fewer releases.
        """
        self._costs[layout] = cost
        own = self._counts.setdefault(layout, {})
        for event, found in counts.items():
            before = own.get((source, event), (0, 0, 0))
            if more:
                n, reached, failed = (a + b for a, b in zip(before, found, strict=True))
                found = n, reached, failed
            own[source, event] = max(before, found)

    def tried(self) -> tuple[TriedLayout, ...]:
        """Return what is known of each layout; empty if the site has no design events."""
        return tuple(self._each()) if self._design else ()

    def _each(self) -> Iterator[TriedLayout]:
        for layout, counts in self._counts.items():
            sums = []
            for event in self._design:
                own = [found for (_, name), found in counts.items() if name == event]
                sums.append([sum(column) for column in zip((0, 0, 0), *own, strict=True)])
            reach = worst([estimate(reached, n) for n, reached, _ in sums])
            failure = worst([estimate(failed, n) for n, _, failed in sums])
            yield TriedLayout(layout, self._costs[layout], reach, failure)
