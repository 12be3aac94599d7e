"""The default designer: a catalogue of all kinds, raced; pairs of the best; their neighbours.

Singles of every allowed kind over stations and sizes are looked at where they promise most, as far
as a barrier-free ensemble and their neighbours tell, see `rigdda.agents.scouting`. Pairs of the
best of each kind are foretold from them: of what one lets past, the other lets past its share. The
promising ones race on common releases, see `rigdda.agents.racing`, and then neighbours of the best:
other stations and sizes, with ever smaller steps, a barrier more or less. Each race meets fresh
releases. The best few, and no barrier at all, are chosen from on releases of their own, and the
chosen one is reported on others again, which chose nothing: so its value does not flatter.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from rigdda import Layout
from rigdda.agents.arms import Arm
from rigdda.agents.crossings import ensemble_for
from rigdda.agents.menu import FINEST, Menu
from rigdda.agents.protocol import DesignResult, Ledger, Progress
from rigdda.agents.racing import Track
from rigdda.agents.scouting import scout
from rigdda.agents.searching import search
from rigdda.agents.starts import offered, unsearched
from rigdda.agents.store import Store
from rigdda.envs import DesignProblem

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
