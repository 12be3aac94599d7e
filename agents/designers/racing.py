"""Sequential halving of candidates on common releases (Karnin et al. 2013, ICML 28, 1238-1246).

All candidates of a race meet the same fresh releases; what each cost in them is kept event by
event. After each round the better part goes on, with more releases each; who is far behind goes at
once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda import Fence, Layout
from rigdda.agents.designers.protocol import Ledger
from rigdda.agents.designers.store import Release
from rigdda.envs import DesignProblem
from rigdda.envs.intervals import CONFIDENCE, upper_bound

Floats = NDArray[np.float64]

PLANNED = 1000
"""Releases of the plan whose shares are taken: of few, every event has two."""
LEFT = 0.3
"""Least share of the releases that an event has without leaders that leaders leave to it [-]: else
what they stop would not tell them from what does not stop it."""
TRUSTED = 8
"""Releases of an event below which a candidate borrows from the mean without barriers."""


class Arm:
    """A layout and its releases of this race.

    Z is estimated as in `DesignProblem`: what the barriers cost a year, and for each event its rate
    times the mean bill.

    Attributes
    ----------
    releases : dict of str to list of Release
        By name of event, in the order of the seeds, the same for all candidates of a race.
    scale : float
        What its mean bills are believed to be, over what they were.
    """

    def __init__(self, problem: DesignProblem, layout: Layout, strict: bool = False):
        site = problem.site
        self.problem, self.layout, self.strict = problem, layout, strict
        self.scale = 1.0
        self.priced = problem.nothing.objective > 0.0
        self.annual = site.annual(layout) if self.priced else 0.0
        self.rates = {name: site.rate(name, layout) for name in site.event_names}
        self.releases: dict[str, list[Release]] = {name: [] for name in site.event_names}
        self._arrays: dict[str, Floats] = {}

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of its barriers, downhill."""
        return tuple(barrier.kind for barrier in self.layout)

    def add(self, releases: Mapping[str, Iterable[Release]]) -> None:
        """Take more releases."""
        for name, more in releases.items():
            self.releases[name] += more
        self._arrays = {}

    def bills(self, event: str) -> Floats:
        """Return what each release of an event cost, (n,) [EUR]; without prices its debris [m3]."""
        if event not in self._arrays:
            own = self.releases[event]
            found = [r.bill if self.priced else r.volume for r in own]
            self._arrays[event] = np.array(found, dtype=np.float64)
        return self._arrays[event]

    def mean(self, event: str) -> float:
        """Return the mean bill of an event [EUR]; of few releases drawn towards that of nothing."""
        own = self.bills(event)
        if len(own) >= TRUSTED:
            return float(own.mean())
        return float((own.sum() + (TRUSTED - len(own)) * self._without(event)) / TRUSTED)

    def _without(self, event: str) -> float:
        """Return the mean bill of an event without barriers, known of the problem [EUR]."""
        rate = self.problem.site.rate(event, ())
        if not self.priced or rate == 0.0:
            return 0.0
        return self.problem.nothing.by_event[event] / rate

    def objective(self) -> float:
        """Return Z [EUR per m and year]."""
        events = self.rates.items()
        return self.annual + math.fsum(rate * self.mean(name) for name, rate in events)

    def spread(self, event: str) -> float:
        """Return the standard deviation of the bill of an event [EUR], 0 of less than two."""
        own = self.bills(event)
        return float(own.std(ddof=1)) if len(own) > 1 else 0.0

    def shortfall(self) -> float:
        """Return the most by which a design event exceeds a target, 0 if none does.

        By its estimate or, if it is to be strict, by its upper bound: 1 without releases.
        """
        targets = self.problem.targets
        over = [0.0]
        for event in self.problem.site.events:
            own = self.releases[event.name]
            if event.design and (own or self.strict):
                for wanted, which in ((targets.reach, "reached"), (targets.failure, "failed")):
                    if wanted is not None:
                        count = sum(getattr(r, which) for r in own)
                        share = upper_bound(count, len(own)) if self.strict else count / len(own)
                        over.append(share - wanted)
        return max(over)

    def key(self) -> tuple[float, float]:
        """Return what candidates are ranked by: how far a target is missed, then Z."""
        return self.shortfall(), self.objective()


def error(arm: Arm, nothing: Arm) -> float:
    """Return the variance of the estimate of Z of an arm, as if nothing had happened once more."""
    total = 0.0
    for name, rate in arm.rates.items():
        own = arm.bills(name)
        if len(own):
            squares = float(np.square(own - own.mean()).sum()) + nothing.spread(name) ** 2
            total += rate * rate * squares / len(own) ** 2
    return total


def behind(arm: Arm, other: Arm, nothing: Arm) -> float:
    """Return by how many standard errors an arm is behind another of the same releases.

    The variance of the difference of an event is that of a sample with one more release, which
    differs by the spread of nothing: none of n is not never.
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
    """Return how many of `n` releases go to each event: fewer to what the leaders stop.

    Releases go where rate times spread is large, over the root of their time, see
    `DesignProblem.allocation`. An event whose cost with the leaders spreads less than without them
    has less: what the leaders stop tells them apart no more. An event that would have no more than
    the two of every plan has none: a large mass takes as long as hundreds of blocks, and is the
    same for all candidates until there are releases enough to tell. If something is asked of design
    events, each has as many as can tell whether it is met, as far as half of all go.
    """
    shares = {name: float(count) for name, count in problem.allocation(max(n, PLANNED)).items()}
    for name in shares:
        seen = [arm.spread(name) for arm in leaders if len(arm.bills(name)) >= TRUSTED]
        if seen and len(nothing.bills(name)) >= TRUSTED and nothing.spread(name) > 0.0:
            shares[name] *= min(1.0, max(LEFT, float(np.mean(seen)) / nothing.spread(name)))
    whole = sum(shares.values())
    counts = {name: int(n * share / whole) for name, share in shares.items()}  # never more than n
    counts = {name: count if count > 2 else 0 for name, count in counts.items()}
    return _with_floors(counts, _floors(problem, n), n)


def _floors(problem: DesignProblem, n: int) -> dict[str, int]:
    """Return how many of `n` releases each design event has at least, if a target is set.

    So many that a target counts as met if it happens in none, at most an equal share of half.
    """
    asked = [t for t in (problem.targets.reach, problem.targets.failure) if t is not None]
    design = [event.name for event in problem.site.events if event.design]
    if not asked or not design:
        return {}
    enough = math.log(1.0 - CONFIDENCE) / math.log1p(-min(min(asked), 0.5))
    return dict.fromkeys(design, min(math.ceil(enough), n // (2 * len(design))))


def _with_floors(counts: Mapping[str, int], floors: Mapping[str, int], n: int) -> dict[str, int]:
    """Return counts raised to their floors; the others have less, so that there are at most `n`."""
    raised = {name: max(count, floors.get(name, 0)) for name, count in counts.items()}
    spare = {name: count - floors.get(name, 0) for name, count in raised.items()}
    over = max(sum(raised.values()) - n, 0) / max(sum(spare.values()), 1)
    return {name: count - math.ceil(over * spare[name]) for name, count in raised.items()}


KEPT = 0.4
"""Share of the candidates that goes on to the next round, at most."""

HOPELESS = 4.0
"""Standard errors behind the best with which a candidate goes at once. One that is as good is that
far behind once in some hundred races of a hundred candidates."""

PROTECTED = 2
"""Candidates of every kind that the first round keeps, unless they are hopeless: pairs are made of
the best of each."""


class Track:
    """Where races run: a ledger, and how much of its streams of releases is used up.

    Attributes
    ----------
    nothing : Arm
        No barriers, with the releases of the first race: what spreads are borrowed from.
    seen : dict of Layout to Arm
        Every candidate with its releases of the last race that it took part in.
    """

    def __init__(self, ledger: Ledger):
        self.ledger, self.problem = ledger, ledger.problem
        self.nothing = Arm(ledger.problem, ())
        self.seen: dict[Layout, Arm] = {}
        self._next: dict[tuple[str, str], int] = {}

    def race(
        self,
        layouts: Iterable[Layout],
        budget: int,
        first: int,
        keep: int,
        stage: str = "search",
        strict: bool = False,
        leaders: Sequence[Arm] = (),
    ) -> list[Arm]:
        """Return the best `keep` candidates of a race, the best first; none if none can be paid.

        Parameters
        ----------
        layouts : iterable of Layout
            The candidates. If the budget does not pay for the first round of all, the last ones are
            left out.
        budget : int
            Releases at most.
        first : int
            Releases of each in the first round.
        keep : int
            How many are wanted.
        stage : str
            Stream of the releases.
        strict : bool
            Whether a target counts as missed unless its upper bound meets it.
        leaders : sequence of Arm
            Who led the races before: they tell which events are left.
        """
        budget = min(budget, self.ledger.left)
        end = self.ledger.left - budget
        alive = [Arm(self.problem, layout, strict) for layout in dict.fromkeys(layouts)]
        if len(alive) > keep:  # a first round of all, and a second one of those it keeps
            alive = alive[: max(keep, int(budget / (first * (1.0 + KEPT))))]
        rounds = max(1, math.ceil(math.log(max(1.0, len(alive) / keep)) / -math.log(KEPT)))
        for done in range(rounds):
            each = (self.ledger.left - end) // ((rounds - done) * max(1, len(alive)))
            if done == 0 and rounds > 1:
                each = max(first, each)
            if not self._round(alive, each, end, stage, alive[: 2 * keep] if done else leaders):
                alive = alive if done else []
                break
            alive = self._survivors(alive, keep, done == rounds - 1, done == 0)
        return sorted(alive, key=lambda arm: arm.key())[:keep]

    def look(self, layouts: Iterable[Layout], each: int, budget: int) -> list[Arm]:
        """Return candidates that were given as many releases each, as far as a budget goes."""
        budget = min(budget, self.ledger.left)
        arms = [Arm(self.problem, layout) for layout in dict.fromkeys(layouts)]
        arms = arms[: budget // max(1, each)]
        return arms if self._round(arms, each, self.ledger.left - budget, "search", []) else []

    def _round(
        self, alive: list[Arm], each: int, end: int, stage: str, leaders: Sequence[Arm]
    ) -> bool:
        """Give every candidate the same releases; False if they cannot be paid.

        Of fences the strongest come first: what they hold serves the weaker ones.
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
        """Return who goes on, the best first."""
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
    """Return the class of a candidate's strongest fence [kJ], infinite of nothing."""
    if not arm.layout:
        return math.inf
    return max((b.energy_class or 0.0 for b in arm.layout if isinstance(b, Fence)), default=0.0)
