"""Sequential halving of candidates on common releases (Karnin et al. 2013, ICML 28, 1238-1246).

All candidates of a race meet the same fresh releases. After each round the better part goes on,
with more releases each; who is far behind goes at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from rigdda import Fence, Layout
from rigdda.agents.arms import Arm, allocation, behind
from rigdda.agents.protocol import Ledger

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
