"""The default designer, which races single barriers, pairs of barriers and their neighbours.

First, single barriers of every allowed kind are evaluated. The first of them are as different as
possible. The next ones are chosen in batches by a Gaussian process for each kind, which has the
estimates from an ensemble without barriers as its prior mean. The barriers with the lowest mean
minus one standard deviation are evaluated next.

Then the costs of pairs of the best barriers of each kind are predicted, assuming that each barrier
lets pass the same share of the rock as it does alone. The most promising pairs race on common
releases (`rigdda.agents.designers.racing`). After them, the neighbours of the best layouts race:
layouts with other stations and sizes, with decreasing steps, and with one barrier more or less.

Each race uses new releases. The final among the best few layouts and no barrier has separate
releases. The chosen layout is evaluated on further releases that did not affect the choice, so that
its evaluation is unbiased.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Ditch, Layout, Mesh
from rigdda.agents.designers.catalogue import Catalogue, CrossingEnsemble, ensemble_for, tabulate
from rigdda.agents.designers.convex import offered, unsearched
from rigdda.agents.designers.menu import FINEST, Menu, spread
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress, search
from rigdda.agents.designers.racing import Arm, Track, best_of_ends, error
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem

Floats = NDArray[np.float64]

NEAR, SHARE = 2.0, 0.06
"""Correlation length of the Gaussian process over stations [m], and the same as a share of the zone
[-]. The greater of the two is used. Benches are a few metres long."""
SIZES = 0.35
"""Correlation length over sizes, as a share of the range of each size [-]."""
SPREAD = 0.3
"""Prior standard deviation of the remaining risk, over Z without barriers [-]."""


class KindSurrogate:
    """Gaussian process for the remaining risk (Z without capital) with barriers of one kind.

    Parameters
    ----------
    barriers : sequence of n barriers
        Barriers of one kind.
    expected : (n,) array
        Prior mean of the remaining risk with each barrier [EUR per m and year].
    nothing : float
        Z without barriers [EUR per m and year].
    length : float
        Length of the zone [m].
    """

    def __init__(
        self, barriers: Sequence[Barrier], expected: Floats, nothing: float, length: float
    ):
        table = np.array([b.numbers for b in barriers])
        scale = SIZES * np.maximum(np.ptp(table, axis=0), 1e-9)
        mesh = isinstance(barriers[0], Mesh)  # options of mesh are not correlated
        scale[0] = 1e-6 if mesh else max(NEAR, SHARE * length)
        self._table = table / scale
        self._prior, self._variance = expected, (SPREAD * nothing) ** 2
        self._index = {barrier: i for i, barrier in enumerate(barriers)}
        self.mean, self.deviation = expected, np.full(len(barriers), SPREAD * nothing)

    def knows(self, barrier: Barrier) -> bool:
        """Return whether a barrier is one of those of the process."""
        return barrier in self._index

    def learn(self, seen: Sequence[tuple[Barrier, float, float]]) -> None:
        """Compute mean and deviation anew from barriers, their remaining risks and variances."""
        rows = np.array([self._index[barrier] for barrier, _, _ in seen], dtype=np.int64)
        if not len(rows):
            return
        left, noise = np.array([(value, error) for _, value, error in seen]).T
        among = self._alike(rows)[:, rows] + np.diag(noise + 1e-9 * self._variance)
        weight = np.linalg.solve(among, self._alike(rows))
        self.mean = self._prior + weight.T @ (left - self._prior[rows])
        explained = np.einsum("ij,ij->j", weight, self._alike(rows))
        self.deviation = np.sqrt(np.maximum(self._variance - explained, 0.0))

    def _alike(self, rows: NDArray[np.int64]) -> Floats:
        """Return the covariance of some barriers with all barriers, (m, n)."""
        apart = self._table[rows][:, None] - self._table
        alike: Floats = self._variance * np.exp(-0.5 * np.square(apart).sum(axis=2))
        return alike


SPREAD_OUT = 0.5
"""Share of the budget for the first barriers, which are as different as possible [-]."""
BATCHES = 4
"""Number of batches in which the rest of this budget is spent on the most promising barriers."""
TRUST = {"fence": 0.7, "mesh": 1.0}
"""Weight of the estimate from the ensemble in the prior mean of a kind [-]; 0.5 for other kinds."""
NEIGHBOURHOOD = 0.05
"""Distance from the toe within which a ditch counts as a ditch at the toe [m]."""
BOLD = 1.0
"""Number of standard deviations below the mean by which barriers are ranked for evaluation [-]."""


@dataclass(frozen=True, slots=True, eq=False)
class Kind:
    """All barriers of a kind with their costs and the surrogate of their remaining risk."""

    barriers: list[Barrier]
    annual: list[float]
    capital: list[float]
    surface: KindSurrogate
    order: list[int]

    def believed(self, hope: float, price: float = 0.0) -> list[tuple[float, Barrier]]:
        """Return Z of every barrier at `hope` standard deviations below its mean.

        `price` is an additional annual cost per capital cost [1/year], as scarce money has it.
        """
        left = self.surface.mean - hope * self.surface.deviation
        costs = np.array(self.annual) + price * np.array(self.capital)
        return list(zip((costs + left).tolist(), self.barriers, strict=True))


def scout(
    track: Track,
    menu: Menu,
    ensemble: CrossingEnsemble,
    known: Sequence[Layout],
    budget: int,
    first: int,
    prices: Sequence[float] = (0.0,),
) -> tuple[list[Arm], list[Kind]]:
    """Evaluate single barriers and the `known` layouts.

    Parameters
    ----------
    prices : sequence of float
        Prices of capital [1/year] for which promising barriers are sought, see `Kind.believed`.

    Returns
    -------
    arms : list of Arm
        The evaluated layouts by their estimated Z, the best first.
    kinds : list of Kind
        The barriers of each kind with the estimates of the surrogates.
    """
    problem = track.problem
    lists = {kind: menu.lone(kind) for kind in problem.kinds}
    kinds = [_kind(track, menu, ensemble, barriers) for barriers in lists.values() if barriers]
    end = track.ledger.left - budget
    count = int(SPREAD_OUT * budget / first)
    arms = track.look([(), *known, *_apart(track, kinds, count)], first, budget)
    for i in range(BATCHES):
        _learn(kinds, arms, track.nothing)
        each = (track.ledger.left - end) // (BATCHES - i)
        wanted = _promising(
            kinds, arms, max(1, each // first), track.nothing, prices[i % len(prices)]
        )
        more = track.look(wanted, first, track.ledger.left - end)
        arms += more
    _learn(kinds, arms, track.nothing)
    value: dict[Layout, float] = {(b,): z for kind in kinds for z, b in kind.believed(0.0)}
    for arm in arms:
        left = arm.objective() - arm.annual
        if left > 0.0 and arm.layout in value:
            arm.scale = max(0.0, value[arm.layout] - arm.annual) / left
    arms.sort(key=lambda arm: (arm.shortfall(), value.get(arm.layout, arm.objective())))
    return arms, kinds


def _kind(track: Track, menu: Menu, ensemble: CrossingEnsemble, barriers: list[Barrier]) -> Kind:
    """Return a kind with the estimates of its barriers from the ensemble."""
    problem, nothing = track.problem, track.problem.nothing.objective
    annual = np.array([problem.site.annual((b,)) for b in barriers])
    barriers = [b for b, cost in zip(barriers, annual, strict=True) if cost < nothing] or barriers
    table: Catalogue = tabulate(problem, ensemble, barriers)
    annual = np.array([problem.site.annual((b,)) for b in barriers])
    without = float(table.weight @ table.base)
    more = annual - problem.site.annual(())
    share = (table.objective - more) / without if without > 0.0 else np.ones(len(barriers))
    trust = TRUST.get(barriers[0].kind, 0.5)
    expected = nothing * (trust * share + 1.0 - trust)
    length = menu.zone.end - menu.zone.start
    order = np.argsort(table.objective, kind="stable").tolist()
    capital = [problem.site.capital((b,)) for b in barriers]
    surface = KindSurrogate(barriers, expected, nothing, length)
    return Kind(barriers, annual.tolist(), capital, surface, order)


def _apart(track: Track, kinds: Sequence[Kind], n: int) -> list[Layout]:
    """Return layouts with one barrier each, about `n` in all, which differ as much as possible."""
    each = max(2, n // max(1, len(kinds)))
    toe = track.problem.site.slope.toe
    lists = [_different(kind, each, toe) for kind in kinds]
    mixed = [(b,) for row in itertools.zip_longest(*lists) for b in row if b is not None]
    return [layout for layout in mixed if track.problem.fits(layout)]


def _different(kind: Kind, n: int, toe: float) -> list[Barrier]:
    """Return about `n` barriers of a kind that differ as much as possible.

    For fences, half of them have the best size at their station according to the ensemble. For
    ditches, half of them are at the toe and have the greatest depth for their width.
    """
    own: dict[float, Barrier] = {}
    if kind.barriers[0].kind == "fence":
        for i in kind.order:
            own.setdefault(kind.barriers[i].x, kind.barriers[i])
    elif kind.barriers[0].kind == "ditch":
        dug = [b for b in kind.barriers if isinstance(b, Ditch) and abs(b.x - toe) < NEIGHBOURHOOD]
        own = {b.width: b for b in sorted(dug, key=lambda b: b.depth)}
    lists = spread(list(own.values()), (n + 1) // 2), spread(kind.barriers, n // 2 if own else n)
    both = [b for row in itertools.zip_longest(*lists) for b in row if b is not None]
    return list(dict.fromkeys(both))


def _learn(kinds: Sequence[Kind], arms: Sequence[Arm], nothing: Arm) -> None:
    """Update the surrogate of every kind with the evaluations of its barriers."""
    for kind in kinds:
        kind.surface.learn(_seen(kind, arms, nothing))


def _seen(kind: Kind, arms: Sequence[Arm], nothing: Arm) -> list[tuple[Barrier, float, float]]:
    return [
        (arm.layout[0], arm.objective() - arm.annual, error(arm, nothing))
        for arm in arms
        if len(arm.layout) == 1 and kind.surface.knows(arm.layout[0])
    ]


def _promising(
    kinds: Sequence[Kind], arms: Sequence[Arm], n: int, nothing: Arm, price: float
) -> list[Layout]:
    """Return the `n` most promising barriers at a price of capital.

    After each choice, the surrogate is updated as if the barrier had its expected value.
    """
    seen = {id(kind): _seen(kind, arms, nothing) for kind in kinds}
    taken = {arm.layout for arm in arms}
    noise = float(np.median([error(arm, nothing) for arm in arms])) if arms else 1.0
    found: list[Layout] = []
    for _ in range(n):
        offers = [
            (z, i, k)
            for k, kind in enumerate(kinds)
            for i, (z, b) in enumerate(kind.believed(BOLD, price))
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


SINGLES, PAIRS, NEARBY, FINAL = 0.36, 0.14, 0.30, 0.10
"""Shares of the budget for single barriers, for the race of pairs, for the races of neighbours and
for the final [-]. The rest is for the ensemble and the report."""

RELEASES = 30
"""Mean number of releases per event before a candidate may be dropped."""
FEWEST = 8
"""The same number for a small budget."""
FIELD = 150
"""Least budget per event for `RELEASES`, as a multiple of `RELEASES`."""

FINALISTS = 7
"""Number of layouts in the final, including no barrier, the rule and the constant."""
LEADERS = 5
"""Number of layouts that the race of pairs keeps."""
ROUNDS = 6
"""Largest number of rounds of neighbours. The step is halved after a round without improvement."""
LEAST = 8
"""Desired number of candidates in a round of neighbours."""
ADDED = 3
"""Number of additional barriers that are tried with the best layout in every round."""
AS_GOOD = 0.02
"""Largest excess of Z over the best, divided by Z without barriers, with which a layout with fewer
barriers is preferred [-]. A final cannot resolve smaller differences."""
BEST_OF = 8
"""Number of single barriers of each kind from which pairs are formed."""


def first_round(problem: DesignProblem, simulations: int) -> int:
    """Return the number of releases of a candidate before it may be dropped, for a budget."""
    events = len(problem.site.events)
    return min(RELEASES, max(FEWEST, simulations // (FIELD * events))) * events


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best layout that racing finds within the budget.

    If the budget is too small for races, the best of the starting layouts is returned.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    first = first_round(problem, simulations)
    if simulations < 27 * first:  # the budget would not suffice for the final
        return search(ledger, offered(ledger))
    menu, track = Menu(problem), Track(ledger)
    ensemble = ensemble_for(ledger, menu.stations)
    known = unsearched(problem, menu)
    lone, _ = scout(track, menu, ensemble, known, int(SINGLES * simulations), first)
    ledger.starts |= {arm.layout for arm in lone}
    pairs = foretold(problem, lone, lone, track.nothing, int(PAIRS * simulations / first))
    seen = [arm.layout for arm in lone if arm.layout]
    field = [*(arm.layout for arm in _first_of_kinds(lone, 1)), *seen[:3], *pairs]
    budget, leaders = int(PAIRS * simulations), lone[:LEADERS]
    best = track.race(field, budget, first, keep=LEADERS, leaders=leaders)
    seen = [*(arm.layout for arm in best), *seen[:2]]
    near = nearby(track, menu, best, lone, int(NEARBY * simulations), first // 2)
    last = [arm.layout for arm in near]
    fewer = [less for layout in last[:1] for less in _fewer(layout) if less]
    finalists = list(dict.fromkeys([(), *known, *last[:1], *fewer, *last[1:], *seen]))[:FINALISTS]
    budget, keep = int(FINAL * simulations), len(finalists)
    ends = track.race(finalists, budget, first, keep, stage="final", strict=True)
    return ledger.result(ledger.evaluate(simplest(ends, track.nothing), "report", ledger.left))


def simplest(ends: Sequence[Arm], nothing: Arm) -> Layout:
    """Return the best layout, or one that is nearly as good and has fewer barriers (at least 1)."""
    if not ends:
        return ()
    best = best_of_ends(ends)
    most = best.objective() + AS_GOOD * nothing.objective()
    as_good = [
        arm
        for arm in ends
        if arm.layout and arm.shortfall() <= best.shortfall() and arm.objective() < most
    ]
    return min([best, *as_good], key=lambda arm: len(arm.layout)).layout


def foretold(
    problem: DesignProblem,
    arms: Sequence[Arm],
    others: Sequence[Arm],
    nothing: Arm,
    n: int,
    price: float = 0.0,
) -> list[Layout]:
    """Return at most `n` combinations of two arms, with the lowest predicted Z first.

    The mean bill of an event with both is predicted as the product of their mean bills divided by
    the bill without barriers. At most a third of the combinations have the same kinds of barriers.
    `price` is an additional annual cost per capital cost [1/year].
    """
    firsts, seconds = _first_of_kinds(arms, BEST_OF), _first_of_kinds(others, BEST_OF)
    found: dict[Layout, float] = {}
    for one, two in itertools.product(firsts, seconds):
        both = tuple(sorted((*one.layout, *two.layout), key=lambda b: b.x))
        if both in found or len(both) > problem.max_barriers or not problem.fits(both):
            continue
        value = one.annual + two.annual - nothing.annual
        value += price * problem.site.capital(both) if price else 0.0
        for name in problem.site.event_names:
            base = nothing.mean(name)
            both_pass = one.scale * one.mean(name) * two.scale * two.mean(name)
            share = both_pass / base if base > 0.0 else 0.0
            value += problem.site.rate(name, both) * share
        found[both] = value
    chosen: list[Layout] = []
    kinds: Counter[tuple[str, ...]] = Counter()
    for both in sorted(found, key=lambda layout: found[layout]):
        alike = tuple(barrier.kind for barrier in both)
        if kinds[alike] < max(2, n // 3):
            chosen.append(both)
            kinds[alike] += 1
    return chosen[:n]


def _first_of_kinds(arms: Sequence[Arm], n: int) -> list[Arm]:
    """Return the first `n` arms of every combination of kinds, without the arm of no barrier."""
    kept: dict[tuple[str, ...], list[Arm]] = {}
    for arm in arms:
        if arm.layout and len(kept.setdefault(arm.kinds, [])) < n:
            kept[arm.kinds].append(arm)
    return [arm for group in kept.values() for arm in group]


def nearby(
    track: Track, menu: Menu, best: list[Arm], lone: list[Arm], budget: int, first: int
) -> list[Arm]:
    """Return the best candidates of several rounds of neighbours of the best, the best first."""
    zone = menu.zone
    step, level = max(FINEST, (zone.end - zone.start) / 16.0), 2
    centres, raced, tried = _leaders(best), best, set(track.seen)
    if not centres:
        return []
    end = track.ledger.left - budget
    rounds = min(ROUNDS, max(1, budget // (LEAST * first)))
    for i in range(rounds):
        left = track.ledger.left - end
        around = itertools.chain.from_iterable(_around(track, menu, centres, lone, step, level))
        layouts = [layout for layout in dict.fromkeys(around) if layout not in tried]
        field = [*(arm.layout for arm in centres), *layouts]
        found = track.race(field, left // (rounds - i), first, keep=3, leaders=raced)
        if not found:
            break
        raced = found
        tried |= set(track.seen)
        if found[0].layout == centres[0].layout:
            step, level = max(FINEST, 0.5 * step), 1
        centres = _leaders(found) or centres
    return raced


def _leaders(arms: Sequence[Arm]) -> list[Arm]:
    """Return the best arm and then the best arm with other kinds of barriers."""
    return _first_of_kinds(arms, 1)[:2]


def _fewer(layout: Layout) -> list[Layout]:
    """Return the layouts that result if one barrier of a layout is removed."""
    return [(*layout[:i], *layout[i + 1 :]) for i in range(len(layout))]


def _around(
    track: Track, menu: Menu, centres: list[Arm], lone: list[Arm], step: float, level: int
) -> Iterator[Iterable[Layout]]:
    """Yield groups of candidates: one barrier more, one less, and neighbours of the centres."""
    layout = centres[0].layout
    yield foretold(menu.problem, centres[:1], lone, track.nothing, ADDED)
    if len(layout) > 1:
        yield _fewer(layout)
    for centre in centres:
        yield menu.neighbours(centre.layout, step, level)
