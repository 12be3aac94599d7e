"""Sequential halving of candidates on common releases (Karnin et al. 2013, ICML 28, 1238-1246).

All candidates of a race are evaluated on the same new releases, and their costs are kept by event.
After each round, the better candidates continue with more releases each. Candidates that are far
behind the best are dropped at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda import Fence, Layout
from rigdda.agents.designers.protocol import Ledger
from rigdda.agents.designers.store import Release
from rigdda.envs import DesignProblem
from rigdda.envs.intervals import CONFIDENCE, lower_bound, upper_bound
from rigdda.envs.problem import End, can_fail, excess, of_mean

Floats = NDArray[np.float64]

PLANNED = 1000
"""Number of releases of the plan from which the shares of events are taken. In a plan with few
releases, every event would have two."""
LEFT = 0.3
"""Least factor by which the leaders may reduce the releases of an event [-]. Without this limit, no
releases would remain to distinguish candidates that stop the event from those that do not."""
TRUSTED = 8
"""Number of releases of an event below which the mean of a candidate is combined with the mean
without barriers."""


class Arm:
    """A candidate: a layout and its releases in a race.

    Z is estimated as in `DesignProblem`. It is the annual cost of the barriers plus the sum over
    all events of the rate times the mean bill.

    Attributes
    ----------
    releases : dict of str to list of Release
        Releases by name of event, in the order of the seeds, which are the same for all candidates
        of a race.
    expected : mapping of str to float
        Forecast mean bill of each event [EUR], for events with few releases. Without a forecast it
        is the mean without barriers.
    """

    def __init__(
        self,
        problem: DesignProblem,
        layout: Layout,
        strict: bool = False,
        expected: Mapping[str, float] | None = None,
    ):
        site = problem.site
        self.problem, self.layout, self.strict = problem, layout, strict
        targets = problem.targets
        self.limits = [(targets.reach, "reached")] if targets.reach is not None else []
        if targets.failure is not None and can_fail(site, layout):
            self.limits.append((targets.failure, "failed"))
        self.priced = problem.nothing.objective > 0.0
        self.annual = site.annual(layout) if self.priced else 0.0
        self.rates = {name: site.rate(name, layout) for name in site.event_names}
        bare = {name: self.without(name) for name in site.event_names}
        self.expected = bare if expected is None else expected
        self.releases: dict[str, list[Release]] = {name: [] for name in site.event_names}
        self._arrays: dict[str, Floats] = {}

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of its barriers, going downhill."""
        return tuple(barrier.kind for barrier in self.layout)

    def add(self, releases: Mapping[str, Iterable[Release]]) -> None:
        """Add releases."""
        for name, more in releases.items():
            self.releases[name] += more
        self._arrays = {}

    def bills(self, event: str) -> Floats:
        """Return the bill of each release of an event, (n,) [EUR], or its debris without prices."""
        if event not in self._arrays:
            own = self.releases[event]
            found = [r.bill if self.priced else r.volume for r in own]
            self._arrays[event] = np.array(found, dtype=np.float64)
        return self._arrays[event]

    def mean(self, event: str) -> float:
        """Return the mean bill of an event [EUR].

        With few releases, it is a weighted mean with the expected bill.
        """
        own = self.bills(event)
        if len(own) >= TRUSTED:
            return float(own.mean())
        return float((own.sum() + (TRUSTED - len(own)) * self.expected[event]) / TRUSTED)

    def without(self, event: str) -> float:
        """Return the mean bill of an event without barriers, as known from the problem [EUR]."""
        rate = self.problem.site.rate(event, ())
        if not self.priced or rate == 0.0:
            return 0.0
        return self.problem.nothing.by_event[event] / rate

    def objective(self) -> float:
        """Return the estimate of Z [EUR per m and year]."""
        events = self.rates.items()
        return self.annual + math.fsum(rate * self.mean(name) for name, rate in events)

    def spread(self, event: str) -> float:
        """Return the standard deviation of the bill of an event [EUR], 0 for fewer than two."""
        own = self.bills(event)
        return float(own.std(ddof=1)) if len(own) > 1 else 0.0

    def shortfall(self) -> float:
        """Return the largest excess over a target [-], 0 if there is none.

        The excess is that of the estimate or, if `strict`, of its upper bound. The upper bound of a
        probability is 1 without releases.
        """
        return self.excess("upper" if self.strict else "value")

    def excess(self, end: End) -> float:
        """Return the largest excess over a target [-], 0 if there is none.

        It is that of upper bounds, estimates or lower bounds of the probabilities in design events
        and of the individual risk.
        """
        of = OF_COUNTS[end]
        targets = self.problem.targets
        over = [0.0]
        for event in self.problem.site.events:
            own = self.releases[event.name]
            if event.design and (own or self.strict):
                for greatest, which in self.limits:
                    count = sum(getattr(r, which) for r in own)
                    over.append(of(count, len(own)) - greatest)
        if targets.individual is not None:
            killed = {name: [r.fatalities for r in own] for name, own in self.releases.items()}
            risk = self.problem.individual_risk(self.layout, killed)
            over.append(excess(of_mean(risk, end), targets.individual))
        return max(over)

    def key(self) -> tuple[float, float]:
        """Return the sort key of candidates: the amount by which a target is missed, then Z."""
        return self.shortfall(), self.objective()


def _share(count: int, releases: int) -> float:
    return count / releases if releases else 1.0


OF_COUNTS: dict[End, Callable[[int, int], float]] = {
    "upper": upper_bound,
    "value": _share,
    "lower": lower_bound,
}
"""Functions of a count and the number of releases that return a probability or a bound of it."""


def best_of_ends(ends: Sequence[Arm]) -> Arm:
    """Return the best arm of a final, as `protocol.best_of_finals` does.

    Parameters
    ----------
    ends : sequence of Arm
        The arms, by their keys.
    """
    ends = [arm for arm in ends if arm.excess("lower") <= 0.0] or ends
    if any(arm.excess("value") <= 0.0 for arm in ends):
        return ends[0]
    most = ends[0].shortfall()
    return min((a for a in ends if a.excess("lower") <= most), key=lambda a: a.objective())


def remaining(arm: Arm, nothing: Arm) -> tuple[float, float]:
    """Return the estimated risk with the layout of an arm and the variance of the estimate.

    The risk is Z without the annual cost of the barriers [EUR per m and year]. Its estimate is a
    regression on the known cost without barriers, since the releases may by chance be more or less
    harmful than usual. An event without releases has its expected cost.

    Parameters
    ----------
    arm, nothing : Arm
        The arm, and the arm without barriers with the same releases.
    """
    value = variance = 0.0
    for name, rate in arm.rates.items():
        own, bare = arm.bills(name), nothing.bills(name)
        n, usual = len(own), arm.without(name)
        if n == 0:
            value += rate * arm.expected[name]
            variance += (rate * UNSEEN * usual) ** 2
            continue
        left, slope = own, 0.0
        if len(bare) == n and arm.priced:
            slope = _slope(own, bare)
            left = own - slope * bare
        value += rate * max(float(left.mean()) + slope * usual, 0.0)
        squares = float(np.square(left - left.mean()).sum()) + nothing.spread(name) ** 2
        variance += rate * rate * squares / n**2
    return value, variance


UNSEEN = 0.2
"""Standard deviation of a forecast cost of an event over its cost without barriers [-]."""


def _slope(own: Floats, bare: Floats) -> float:
    """Return the slope of the regression of bills on those without barriers, from 0 to 1."""
    if len(own) < 3:
        return 0.0
    apart = bare - bare.mean()
    squares = float(apart @ apart)
    return min(max(float(apart @ own) / squares, 0.0), 1.0) if squares > 0.0 else 0.0


def behind(arm: Arm, other: Arm, nothing: Arm) -> float:
    """Return by how many standard errors an arm is behind another arm with the same releases.

    The sample of the difference in each event is extended by one release that deviates by the
    standard deviation without barriers, because zero occurrences in n releases do not mean that the
    probability is zero.
    """
    variance = 0.0
    for name, rate in arm.rates.items():
        own, its = rate * arm.bills(name), other.rates[name] * other.bills(name)
        n = min(len(own), len(its))
        if n == 0:
            continue
        apart = own[:n] - its[:n]
        squares = float(((apart - apart.mean()) ** 2).sum()) + (rate * nothing.spread(name)) ** 2
        variance += squares / (n * n)
    gap = arm.objective() - other.objective()
    return gap / math.sqrt(variance) if variance > 0.0 else math.copysign(math.inf, gap)


def allocation(
    problem: DesignProblem, n: int, leaders: Sequence[Arm], nothing: Arm
) -> dict[str, int]:
    """Return the number of releases of each event, `n` in all, with fewer for stopped events.

    The basis is `DesignProblem.allocation`, which is proportional to the rate of an event times the
    standard deviation of its cost over the square root of its computing time. An event has fewer
    releases if its cost has a smaller standard deviation with the leaders than without barriers,
    because it then does not distinguish the candidates. An event with no more than the two releases
    of every plan has none; if this holds for all events, the most important ones have three. The
    simulation of a large mass takes as long as that of hundreds of blocks, and a few releases of it
    do not distinguish candidates. If there are targets, each design event has enough releases to
    decide whether they are met, up to half of all releases.
    """
    shares = {name: float(count) for name, count in problem.allocation(max(n, PLANNED)).items()}
    for name in shares:
        seen = [arm.spread(name) for arm in leaders if len(arm.bills(name)) >= TRUSTED]
        if seen and len(nothing.bills(name)) >= TRUSTED and nothing.spread(name) > 0.0:
            shares[name] *= min(1.0, max(LEFT, float(np.mean(seen)) / nothing.spread(name)))
    whole = sum(shares.values())
    counts = {name: int(n * share / whole) for name, share in shares.items()}  # never more than n
    if max(counts.values()) <= 2:  # many events: the most important ones have three
        order = sorted(shares, key=lambda name: -shares[name])
        counts = {name: 3 * (place < n // 3) for place, name in enumerate(order)}
    counts = {name: count if count > 2 else 0 for name, count in counts.items()}
    return _with_floors(counts, _floors(problem, n), n)


def _floors(problem: DesignProblem, n: int) -> dict[str, int]:
    """Return the least number of releases of each design event if a target is set.

    With this number, a target counts as met if the event occurs in none of the releases. The total
    is at most half of `n`.
    """
    asked = [t for t in (problem.targets.reach, problem.targets.failure) if t is not None]
    design = [event.name for event in problem.site.events if event.design]
    if not asked or not design:
        return {}
    enough = math.log(1.0 - CONFIDENCE) / math.log1p(-min(min(asked), 0.5))
    return dict.fromkeys(design, min(math.ceil(enough), n // (2 * len(design))))


def _with_floors(counts: Mapping[str, int], floors: Mapping[str, int], n: int) -> dict[str, int]:
    """Return counts raised to their floors, with the others reduced to a total of at most `n`."""
    raised = {name: max(count, floors.get(name, 0)) for name, count in counts.items()}
    spare = {name: count - floors.get(name, 0) for name, count in raised.items()}
    over = max(sum(raised.values()) - n, 0) / max(sum(spare.values()), 1)
    return {name: count - math.ceil(over * spare[name]) for name, count in raised.items()}


KEPT = 0.4
"""Largest share of the candidates that continue to the next round [-]."""

HOPELESS = 4.0
"""Number of standard errors behind the best from which a candidate is dropped at once. A candidate
that is as good as the best is dropped in about one of a hundred races of a hundred candidates."""

PROTECTED = 2
"""Number of candidates of every kind that the first round keeps unless they are far behind, so that
the second round compares different kinds."""


class Track:
    """Runs races with the releases of a ledger and counts the releases that are used up.

    Attributes
    ----------
    nothing : Arm
        The candidate without barriers, whose standard deviations are used for other candidates.
    seen : dict of Layout to Arm
        Every candidate with its releases of the last race in which it took part.
    expect : callable
        Returns the expected mean bill of each event with a layout [EUR], or None.
    """

    def __init__(self, ledger: Ledger):
        self.ledger, self.problem = ledger, ledger.problem
        self.nothing = Arm(ledger.problem, ())
        self.seen: dict[Layout, Arm] = {}
        self.expect: Callable[[Layout], Mapping[str, float] | None] = lambda _: None
        self._next: dict[tuple[str, str], int] = {}

    def race(
        self,
        layouts: Iterable[Layout],
        budget: int,
        first: int,
        keep: int,
        stage: str = "search",
        strict: bool = False,
    ) -> list[Arm]:
        """Return the best `keep` candidates of a race, or none if the budget is too small.

        Parameters
        ----------
        layouts : iterable of Layout
            The candidates. If the budget is too small for a first round of all of them, the last
            ones are left out.
        budget : int
            Largest number of releases.
        first : int
            Number of releases of each candidate in the first round.
        keep : int
            Number of candidates to return, the best first.
        stage : str
            Stream of the releases.
        strict : bool
            Whether a target counts as missed unless its upper bound meets it.
        """
        budget = min(budget, self.ledger.left)
        end = self.ledger.left - budget
        fresh = dict.fromkeys(layouts)
        alive = [Arm(self.problem, layout, strict, self.expect(layout)) for layout in fresh]
        if len(alive) > keep:  # the budget must suffice for a first and a second round
            alive = alive[: max(keep, int(budget / (first * (1.0 + KEPT))))]
        rounds = max(1, math.ceil(math.log(max(1.0, len(alive) / keep)) / -math.log(KEPT)))
        for done in range(rounds):
            each = (self.ledger.left - end) // ((rounds - done) * max(1, len(alive)))
            if done == 0 and rounds > 1:
                each = max(first, each)
            if not self._round(alive, each, end, stage, alive[: 2 * keep] if done else []):
                alive = alive if done else []
                break
            alive = self._survivors(alive, keep, done == rounds - 1, done == 0)
        return sorted(alive, key=lambda arm: arm.key())[:keep]

    def contest(
        self,
        layouts: Iterable[Layout],
        budget: int,
        first: int,
        step: int,
        stage: str,
        contenders: Callable[[Sequence[Arm]], list[Arm]],
    ) -> list[Arm]:
        """Return all candidates of a race that ends when it is decided, with their releases.

        Parameters
        ----------
        layouts, budget, first, stage
            As in `race`, but strict.
        step : int
            Number of releases of each later round, which the candidates share.
        contenders : callable
            Function of all candidates that returns those that continue; none if it is decided.
        """
        end = self.ledger.left - min(budget, self.ledger.left)
        arms = [Arm(self.problem, x, True, self.expect(x)) for x in dict.fromkeys(layouts)]
        alive, each = arms, first
        while alive and self._round(alive, each, end, stage, alive if alive != arms else []):
            alive = contenders(arms)
            each = step // max(len(alive), 1)
        return arms

    def look(self, layouts: Iterable[Layout], each: int, budget: int) -> list[Arm]:
        """Return candidates with `each` releases, as many as the budget allows."""
        budget = min(budget, self.ledger.left)
        fresh = dict.fromkeys(layouts)
        arms = [Arm(self.problem, layout, False, self.expect(layout)) for layout in fresh]
        arms = arms[: budget // max(1, each)]
        return arms if self._round(arms, each, self.ledger.left - budget, "search", []) else []

    def _round(
        self, alive: list[Arm], each: int, end: int, stage: str, leaders: Sequence[Arm]
    ) -> bool:
        """Evaluate all candidates on the same releases; return False if the budget is too small.

        Layouts with the strongest fences come first, because weaker fences may reuse their results.
        """
        least = 2 * len(self.problem.site.events)
        room = (self.ledger.left - end) // max(1, len(alive))
        counts = allocation(self.problem, max(min(each, room), least), leaders, self.nothing)
        if not alive or not 0 < sum(counts.values()) <= room:
            return False
        start = {name: self._next.get((stage, name), 0) for name in counts}
        for arm in sorted(alive, key=_strength, reverse=True):
            releases = self.ledger.sample(arm.layout, stage, start, counts).releases
            arm.add(releases)
            self.seen[arm.layout] = arm
            if not arm.layout and stage == "search":
                self.nothing = arm
        for name, n in counts.items():
            self._next[stage, name] = start[name] + n
        return True

    def _survivors(self, alive: list[Arm], keep: int, final: bool, protect: bool) -> list[Arm]:
        """Return the candidates that continue, the best first."""
        nothing = self.nothing
        order = sorted(alive, key=lambda arm: arm.key())
        if final:
            return order
        best, count = order[0], max(keep, math.ceil(KEPT * len(order)))
        taken: dict[tuple[str, ...], int] = {}
        kept = []
        for place, arm in enumerate(order):
            among = taken.get(arm.kinds, 0)
            wanted = place < count or (protect and among < PROTECTED)
            if wanted and (place < keep or behind(arm, best, nothing) < HOPELESS):
                kept.append(arm)
                taken[arm.kinds] = among + 1
        return kept


def _strength(arm: Arm) -> float:
    """Return the class of a candidate's strongest fence [kJ]; infinite without barriers."""
    if not arm.layout:
        return math.inf
    return max((b.energy_class or 0.0 for b in arm.layout if isinstance(b, Fence)), default=0.0)
