"""The default designer: a catalogue of all kinds, raced; pairs of the best; their neighbours.

Singles of every allowed kind are looked at where they promise most. At first these are barriers of
every kind as different as can be, then in batches those that may be the best: of least mean less
one standard deviation of a Gaussian process for each kind, which learns from their neighbours and
starts from a barrier-free ensemble.

Pairs of the best of each kind are foretold from them: of what one lets past, the other lets past
its share. The promising ones race on common releases (`rigdda.agents.designers.racing`), and then
neighbours of the best: other stations and sizes, with ever smaller steps, a barrier more or less.
Each race meets fresh releases. The best few, and no barrier at all, are chosen from on releases of
their own, and the chosen one is reported on others again, which chose nothing: so its value does
not flatter.
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
from rigdda.agents.designers.racing import Arm, Track, error
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem

Floats = NDArray[np.float64]

NEAR, SHARE = 2.0, 0.06
"""Distance of stations over which what they are worth is alike [m], and the same as a share of the
zone: the greater counts. Benches are a few metres long."""
SIZES = 0.35
"""The same of sizes, as a share of the range of each."""
SPREAD = 0.3
"""Standard deviation of what is left of Z about what is expected, over Z of nothing [-]."""


class KindSurrogate:
    """What is left of Z behind each of some barriers of one kind.

    Parameters
    ----------
    barriers : sequence of n barriers
        All of one kind.
    expected : (n,) array
        What they are expected to leave of Z, their own cost not included [EUR per m and year].
    nothing : float
        Z of nothing [EUR per m and year].
    length : float
        Length of the zone [m].
    """

    def __init__(
        self, barriers: Sequence[Barrier], expected: Floats, nothing: float, length: float
    ):
        table = np.array([b.numbers for b in barriers])
        scale = SIZES * np.maximum(np.ptp(table, axis=0), 1e-9)
        mesh = isinstance(barriers[0], Mesh)  # options have nothing to do with each other
        scale[0] = 1e-6 if mesh else max(NEAR, SHARE * length)
        self._table = table / scale
        self._prior, self._variance = expected, (SPREAD * nothing) ** 2
        self._index = {barrier: i for i, barrier in enumerate(barriers)}
        self.mean, self.deviation = expected, np.full(len(barriers), SPREAD * nothing)

    def knows(self, barrier: Barrier) -> bool:
        """Tell whether a barrier is one of them."""
        return barrier in self._index

    def learn(self, seen: Sequence[tuple[Barrier, float, float]]) -> None:
        """Learn from barriers, what each left of Z, and the variance of that; all over again."""
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
        """Return the covariance of some barriers with all, (m, n)."""
        apart = self._table[rows][:, None] - self._table
        alike: Floats = self._variance * np.exp(-0.5 * np.square(apart).sum(axis=2))
        return alike


SPREAD_OUT = 0.5
"""Share of the budget that goes to barriers as different as can be."""
BATCHES = 4
"""In how many batches the rest goes to those that promise most."""
TRUST = {"fence": 0.7, "mesh": 1.0}
"""How far what the ensemble says of a kind is believed beforehand; of all others by half."""
NEIGHBOURHOOD = 0.05
"""Distance within which a ditch is dug at the toe [m]."""
BOLD = 1.0
"""Standard deviations below its mean that a barrier is hoped to be."""


@dataclass(frozen=True, slots=True, eq=False)
class Kind:
    """All barriers of a kind: what they cost a year, and what is known of the rest of Z."""

    barriers: list[Barrier]
    annual: list[float]
    surface: KindSurrogate
    order: list[int]

    def believed(self, hope: float) -> list[tuple[float, Barrier]]:
        """Return Z of every barrier, `hope` standard deviations below its mean."""
        left = self.surface.mean - hope * self.surface.deviation
        return list(zip((np.array(self.annual) + left).tolist(), self.barriers, strict=True))


def scout(
    track: Track,
    menu: Menu,
    ensemble: CrossingEnsemble,
    known: Sequence[Layout],
    budget: int,
    first: int,
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


def _kind(track: Track, menu: Menu, ensemble: CrossingEnsemble, barriers: list[Barrier]) -> Kind:
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
    return Kind(
        barriers, annual.tolist(), KindSurrogate(barriers, expected, nothing, length), order
    )


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
        dug = [b for b in kind.barriers if isinstance(b, Ditch) and abs(b.x - toe) < NEIGHBOURHOOD]
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


SINGLES, PAIRS, NEARBY, FINAL = 0.36, 0.14, 0.30, 0.10
"""Shares of the budget: singles, races of pairs and of neighbours, and the choice among the best;
the rest is for the ensemble and the report."""

RELEASES = 30
"""Releases an event, on average, before anything is dropped."""
FEWEST = 8
"""The same with a small budget."""
FIELD = 150
"""A budget that is this many times as large affords `RELEASES`."""

FINALISTS = 7
"""Layouts of the final: nothing, the rule's and the constant among them."""
LEADERS = 5
"""Layouts that a race of pairs keeps."""
ROUNDS = 6
"""Rounds of neighbours: at each at which none is better the step is halved."""
LEAST = 8
"""Candidates that a round of neighbours should have."""
ADDED = 3
"""Barriers that are tried beside the best layout in every round."""
AS_GOOD = 0.02
"""Share of Z of nothing within which of the best a layout with fewer barriers is built instead:
a final cannot tell less apart."""
BEST_OF = 8
"""Singles of a kind of which pairs are made."""


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best layout that racing finds within the budget.

    With a budget that is too small for races, it is the best of the layouts that need no search.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    events = len(problem.site.events)
    first = min(RELEASES, max(FEWEST, simulations // (FIELD * events))) * events
    if simulations < 27 * first:  # or it would not pay for the final
        return search(ledger, offered(ledger))
    menu, track = Menu(problem), Track(ledger)
    ensemble = ensemble_for(ledger, menu.stations)
    known = unsearched(problem, ensemble, menu)
    lone = scout(track, menu, ensemble, known, int(SINGLES * simulations), first)
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
    """Return the layout of the best, or of one as good with fewer barriers (but not none)."""
    if not ends:
        return ()
    most = ends[0].objective() + AS_GOOD * nothing.objective()
    as_good = [
        arm
        for arm in ends
        if arm.layout and arm.shortfall() <= ends[0].shortfall() and arm.objective() < most
    ]
    return min([*ends[:1], *as_good], key=lambda arm: len(arm.layout)).layout


def foretold(
    problem: DesignProblem, arms: Sequence[Arm], others: Sequence[Arm], nothing: Arm, n: int
) -> list[Layout]:
    """Return at most `n` layouts of one arm and another together, the most promising first.

    Of an event the mean bill of both is foretold as the product of theirs over that of nothing. At
    most a third are of the same kinds.
    """
    firsts, seconds = _first_of_kinds(arms, BEST_OF), _first_of_kinds(others, BEST_OF)
    found: dict[Layout, float] = {}
    for one, two in itertools.product(firsts, seconds):
        both = tuple(sorted((*one.layout, *two.layout), key=lambda b: b.x))
        if both in found or len(both) > problem.max_barriers or not problem.fits(both):
            continue
        value = one.annual + two.annual
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
    """Return the first `n` arms of every kind, nothing left out; the best come first."""
    kept: dict[tuple[str, ...], list[Arm]] = {}
    for arm in arms:
        if arm.layout and len(kept.setdefault(arm.kinds, [])) < n:
            kept[arm.kinds].append(arm)
    return [arm for group in kept.values() for arm in group]


def nearby(
    track: Track, menu: Menu, best: list[Arm], lone: list[Arm], budget: int, first: int
) -> list[Arm]:
    """Return the best of rounds of neighbours around the best, the best first."""
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
    """Return the best arm, and the best one of other kinds; the best come first."""
    return _first_of_kinds(arms, 1)[:2]


def _fewer(layout: Layout) -> list[Layout]:
    """Return a layout without each of its barriers."""
    return [(*layout[:i], *layout[i + 1 :]) for i in range(len(layout))]


def _around(
    track: Track, menu: Menu, centres: list[Arm], lone: list[Arm], step: float, level: int
) -> Iterator[Iterable[Layout]]:
    """Yield what may be tried: a barrier more, one less, neighbours of the best and of the next."""
    layout = centres[0].layout
    yield foretold(menu.problem, centres[:1], lone, track.nothing, ADDED)
    if len(layout) > 1:
        yield _fewer(layout)
    for centre in centres:
        yield menu.neighbours(centre.layout, step, level)
