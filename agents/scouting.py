"""Singles of a catalogue, looked at where they promise most: the first part of a race.

At first barriers of every kind as different as can be, then in batches those that may be the best
as far as their neighbours tell, see `rigdda.agents.surface`: of least mean less one standard
deviation.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigdda import Barrier, Ditch, Layout
from rigdda.agents.arms import Arm, error
from rigdda.agents.catalogue import Catalogue, tabulate
from rigdda.agents.crossings import Ensemble
from rigdda.agents.menu import Menu, spread
from rigdda.agents.racing import Track
from rigdda.agents.surface import Surface

SPREAD_OUT = 0.5
"""Share of the budget that goes to barriers as different as can be."""
BATCHES = 4
"""In how many batches the rest goes to those that promise most."""
TRUST = {"fence": 0.7, "mesh": 1.0}
"""How far what the ensemble says of a kind is believed beforehand; of all others by half."""
NEAR = 0.05
"""Distance within which a ditch is dug at the toe [m]."""
BOLD = 1.0
"""Standard deviations below its mean that a barrier is hoped to be."""


@dataclass(frozen=True, slots=True, eq=False)
class Kind:
    """All barriers of a kind: what they cost a year, and what is known of the rest of Z."""

    barriers: list[Barrier]
    annual: list[float]
    surface: Surface
    order: list[int]

    def believed(self, hope: float) -> list[tuple[float, Barrier]]:
        """Return Z of every barrier, `hope` standard deviations below its mean."""
        left = self.surface.mean - hope * self.surface.deviation
        return list(zip((np.array(self.annual) + left).tolist(), self.barriers, strict=True))


def scout(
    track: Track, menu: Menu, ensemble: Ensemble, known: Sequence[Layout], budget: int, first: int
) -> list[Arm]:
    """Return what was looked at, singles and the `known`, what is believed to be the best first."""
    problem = track.problem
    lists = {kind: menu.lone(kind) for kind in problem.kinds}
    kinds = [_kind(track, menu, ensemble, barriers) for barriers in lists.values() if barriers]
    end = track.ledger.left - budget
    count = int(SPREAD_OUT * budget / first)
    arms = track.look([(), *known, *_apart(track, kinds, count)], first, budget)
    for i in range(BATCHES):
        _learn(kinds, arms, track.nothing)
        each = (track.ledger.left - end) // (BATCHES - i)
        wanted = _promising(kinds, arms, max(1, each // first), track.nothing)
        more = track.look(wanted, first, track.ledger.left - end)
        arms += more
    _learn(kinds, arms, track.nothing)
    value: dict[Layout, float] = {(b,): z for kind in kinds for z, b in kind.believed(0.0)}
    for arm in arms:
        left = arm.objective() - arm.annual
        if left > 0.0 and arm.layout in value:
            arm.scale = max(0.0, value[arm.layout] - arm.annual) / left
    return sorted(arms, key=lambda arm: (arm.shortfall(), value.get(arm.layout, arm.objective())))


def _kind(track: Track, menu: Menu, ensemble: Ensemble, barriers: list[Barrier]) -> Kind:
    """Return a kind with what the ensemble says of its barriers."""
    problem, nothing = track.problem, track.problem.nothing.objective
    annual = np.array([problem.site.annual((b,)) for b in barriers])
    barriers = [b for b, cost in zip(barriers, annual, strict=True) if cost < nothing] or barriers
    table: Catalogue = tabulate(problem, ensemble, barriers)
    annual = np.array([problem.site.annual((b,)) for b in barriers])
    without = float(table.weight @ table.base)
    share = (table.objective - annual) / without if without > 0.0 else np.ones(len(barriers))
    trust = TRUST.get(barriers[0].kind, 0.5)
    expected = nothing * (trust * share + 1.0 - trust)
    length = menu.zone.end - menu.zone.start
    order = np.argsort(table.objective, kind="stable").tolist()
    return Kind(barriers, annual.tolist(), Surface(barriers, expected, nothing, length), order)


def _apart(track: Track, kinds: Sequence[Kind], n: int) -> list[Layout]:
    """Return different barriers of every kind."""
    each = max(2, n // max(1, len(kinds)))
    toe = track.problem.site.slope.toe
    lists = [_different(kind, each, toe) for kind in kinds]
    mixed = [(b,) for row in itertools.zip_longest(*lists) for b in row if b is not None]
    return [layout for layout in mixed if track.problem.fits(layout)]


def _different(kind: Kind, n: int, toe: float) -> list[Barrier]:
    """Return about `n` barriers of a kind as different as can be, half of them where they belong.

    Of fences that half are those of the best size at their station, as the ensemble sees it; of
    ditches those that are dug at the toe, the deepest of each width.
    """
    own: dict[float, Barrier] = {}
    if kind.barriers[0].kind == "fence":
        for i in kind.order:
            own.setdefault(kind.barriers[i].x, kind.barriers[i])
    elif kind.barriers[0].kind == "ditch":
        dug = [b for b in kind.barriers if isinstance(b, Ditch) and abs(b.x - toe) < NEAR]
        own = {b.width: b for b in sorted(dug, key=lambda b: b.depth)}
    lists = spread(list(own.values()), (n + 1) // 2), spread(kind.barriers, n // 2 if own else n)
    both = [b for row in itertools.zip_longest(*lists) for b in row if b is not None]
    return list(dict.fromkeys(both))


def _learn(kinds: Sequence[Kind], arms: Sequence[Arm], nothing: Arm) -> None:
    """Let every kind learn from what was seen of its barriers."""
    for kind in kinds:
        kind.surface.learn(_seen(kind, arms, nothing))


def _seen(kind: Kind, arms: Sequence[Arm], nothing: Arm) -> list[tuple[Barrier, float, float]]:
    return [
        (arm.layout[0], arm.objective() - arm.annual, error(arm, nothing))
        for arm in arms
        if len(arm.layout) == 1 and kind.surface.knows(arm.layout[0])
    ]


def _promising(kinds: Sequence[Kind], arms: Sequence[Arm], n: int, nothing: Arm) -> list[Layout]:
    """Return the `n` barriers that may be the best, each as if the ones before were as expected."""
    seen = {id(kind): _seen(kind, arms, nothing) for kind in kinds}
    taken = {arm.layout for arm in arms}
    noise = float(np.median([error(arm, nothing) for arm in arms])) if arms else 1.0
    found: list[Layout] = []
    for _ in range(n):
        offers = [
            (z, i, k)
            for k, kind in enumerate(kinds)
            for i, (z, b) in enumerate(kind.believed(BOLD))
            if (b,) not in taken
        ]
        if not offers:
            break
        _, i, k = min(offers)
        kind = kinds[k]
        barrier = kind.barriers[i]
        found.append((barrier,))
        taken.add((barrier,))
        seen[id(kind)].append((barrier, float(kind.surface.mean[i]), noise))
        kind.surface.learn(seen[id(kind)])
    return found
