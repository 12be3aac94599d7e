"""Verification of layouts on common new releases, until their order is clear.

All layouts are evaluated on the same releases, first on an eighth of them, then on a quarter, half
and all. After each part, the layout that is recommended is compared with the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import NormalDist

from rigdda import Layout, Outcome
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem, Evaluation, ensemble
from rigdda.envs.comparison import LEAST_PER_EVENT, Difference, difference
from rigdda.envs.intervals import CONFIDENCE
from rigdda.seeds import release_seeds

LEAST = 100
"""Least number of releases of a layout after which a verification may end. With fewer, intervals of
rare harm are wider than Z."""

PARTS = 4
"""Largest number of parts, each but the first as large as all before."""


def stages(releases: int, events: int) -> tuple[int, ...]:
    """Return the numbers of releases after which a verification is judged, ascending.

    Parameters
    ----------
    releases : int
        Largest number of releases.
    events : int
        Number of events, of which each needs two releases.
    """
    halved = (releases >> i for i in range(PARTS - 1, 0, -1))
    return (*(n for n in halved if n >= max(LEAST, 2 * events)), releases)


class Verification:
    """Evaluates layouts on the first releases of the stream "verification".

    Parameters
    ----------
    problem : DesignProblem
        The problem, in which all layouts are feasible.
    releases : int
        Largest number of releases of a layout.
    seed : int
        Seed of the search.
    store : Store
        Store of the evaluations, which keeps outcomes.

    Attributes
    ----------
    stages : tuple of int
        Numbers of releases after which the layouts are judged.
    """

    def __init__(self, problem: DesignProblem, releases: int, seed: int, store: Store):
        self.problem, self._store = problem, store
        self.stages = stages(releases, len(problem.site.events))
        self._seeds = release_seeds("verification", seed, releases)
        self._events = problem.plan(self._seeds)
        self._outcomes: dict[Layout, list[Outcome]] = {}

    def evaluate(self, layout: Layout, stage: int = 0) -> Evaluation:
        """Return the evaluation of a layout on all releases up to a stage, without outcomes.

        Raises
        ------
        BadInput, Diverged
            The same errors as `DesignProblem.evaluate`.
        """
        n = self.stages[stage]
        own = self._outcomes.setdefault(layout, [])
        for end in self.stages[: stage + 1]:
            if len(own) < end:
                own += self._part(layout, len(own), end)
        return replace(self.problem.judge(layout, own[:n], self._seeds[:n]), outcomes=())

    def _part(self, layout: Layout, start: int, end: int) -> list[Outcome]:
        """Return the outcomes of some releases, in the order of their seeds."""
        places = range(start, end)
        by_event = {
            name: [i for i in places if self._events[i] == name]
            for name in dict.fromkeys(self._events[start:end])
        }
        seeds = {name: [self._seeds[i] for i in own] for name, own in by_event.items()}
        found = self._store.outcomes(self.problem, layout, seeds)
        order = [i for own in by_event.values() for i in own]
        known = dict(zip(order, found, strict=True))
        return [known[i] for i in places]

    def difference(self, one: Layout, two: Layout) -> Difference:
        """Return the difference in Z between two layouts on their common releases.

        Raises
        ------
        BadInput
            If an event with a non-zero rate has fewer than two of them.
        """
        site, pair = self.problem.site, (self._outcomes[one], self._outcomes[two])
        n = min(map(len, pair))
        facts = ensemble.of(site, self.problem.key).facts
        return difference(site, (one, two), (pair[0][:n], pair[1][:n]), facts)

    def decided(self, evaluations: Sequence[Evaluation], precision: float) -> bool:
        """Return whether a verification may end.

        It may if Z of the last layout is known to within `precision`, or if its order with every
        other layout is clear: the other one is cheaper, or not by more than `precision` times Z.
        The intervals of the last layout and the first one must also not overlap, because a design
        says first whether the layout saves more than it costs.

        Parameters
        ----------
        evaluations : sequence of Evaluation
            Evaluations of the layouts that may be built, on all their releases, which are the same
            for all. No barrier is the first and the recommended layout is the last.
        precision : float
            Half of the width of an interval over Z [-].
        """
        bare, last = evaluations[0], evaluations[-1]
        exact = precision * abs(last.objective)
        if last.ci[1] - last.ci[0] <= 2.0 * exact:
            return True
        if last.layout and last.ci[0] <= bare.ci[1] and last.ci[1] >= bare.ci[0]:
            return False
        others = [e.layout for e in evaluations if e.layout != last.layout]
        if last.releases < LEAST_PER_EVENT * len(self.problem.site.events):
            return False
        found = [self.difference(last.layout, other) for other in others]
        return all(is_clear(one, exact, len(self.stages)) for one in found)


def is_clear(found: Difference, tolerance: float, comparisons: int) -> bool:
    """Return whether it is clear that one layout costs more, or at most `tolerance` more.

    Parameters
    ----------
    found : Difference
        Z of the first layout minus Z of the second.
    tolerance : float
        Difference that does not matter [EUR per metre and year].
    comparisons : int
        Number of interim analyses in which both layouts are compared. The interval is widened, so
        that the probability of an error in any of them is that of one interval (Bonferroni).
    """
    error = (1.0 - CONFIDENCE) / 2.0
    normal = NormalDist().inv_cdf
    wider = normal(1.0 - error / comparisons) / normal(1.0 - error)
    low, high = (found.value + wider * (end - found.value) for end in found.ci)
    return low > 0.0 or high <= tolerance
