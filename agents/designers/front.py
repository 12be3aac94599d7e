"""Search for the front of a site: layouts from the cheapest to the one with the least Z.

A designer finds the layout with the least annual cost Z. If several sites share a budget, money is
scarce and each site needs cheaper layouts as well: those with the least Z + price x capital for
some price of capital [1/year]. The search explores single barriers as the designer `race` does,
but for several prices. Then pairs of barriers and neighbours of the best layouts for each price
are evaluated on new releases. The result is a list of layouts to be compared on other releases.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from rigdda import Layout
from rigdda.agents.designers.catalogue import ensemble_for
from rigdda.agents.designers.convex import unsearched
from rigdda.agents.designers.menu import FINEST, Menu
from rigdda.agents.designers.protocol import Ledger, Progress
from rigdda.agents.designers.race import Kind, first_round, foretold, scout
from rigdda.agents.designers.racing import Arm, Track
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem

PRICES = (0.0, 0.03, 0.1, 0.3, 1.0)
"""Prices of capital for which layouts are sought [1/year]. A price of 1 means that a euro is spent
only if it saves a euro per year."""

MOST = 12
"""Largest number of layouts of a front, including no barrier."""

SINGLES, PAIRS = 0.5, 0.25
"""Shares of the budget for single barriers and for pairs; the rest is for neighbours [-]."""


def layouts(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> tuple[Layout, ...]:
    """Return at most `MOST` layouts from the cheapest, no barrier, to that with the least Z.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    first = first_round(problem, simulations)
    menu, track = Menu(problem), Track(ledger)
    ensemble = ensemble_for(ledger, menu.stations)
    known = [layout for layout in unsearched(problem, menu) if problem.fits(layout)]
    budget = int(SINGLES * simulations)
    lone, kinds = scout(track, menu, ensemble, known, budget, first, PRICES)
    pairs = [foretold(problem, lone, lone, track.nothing, MOST // 2, price) for price in PRICES[:3]]
    singles = _believed(kinds, {arm.layout for arm in lone})
    wanted = [layout for row in itertools.zip_longest(*pairs, singles) for layout in row if layout]
    seen = lone + track.look(_new(wanted, track), first, int(PAIRS * simulations))
    around = _neighbours(menu, front(seen, MOST // 2))
    seen += track.look(_new(around, track), first, ledger.left)
    chosen = [arm.layout for arm in front(seen, MOST - 1 - len(known))]
    found = dict.fromkeys([(), *known, *chosen])
    return tuple(sorted(found, key=lambda layout: (problem.site.capital(layout), len(layout))))


def _new(wanted: Iterable[Layout], track: Track) -> list[Layout]:
    """Return the layouts that have not been evaluated yet."""
    return [layout for layout in dict.fromkeys(wanted) if layout not in track.seen]


def _believed(kinds: Sequence[Kind], seen: set[Layout]) -> list[Layout]:
    """Return the single barriers with the least expected cost of each kind for each price."""
    found: dict[Layout, None] = {}
    for price in PRICES:
        for kind in kinds:
            _, barrier = min(kind.believed(0.0, price), key=lambda pair: pair[0])
            if (barrier,) not in seen:
                found[(barrier,)] = None
    return list(found)


def _neighbours(menu: Menu, arms: Sequence[Arm]) -> Iterator[Layout]:
    """Yield the neighbours of layouts in turn: other stations and sizes, and one barrier less."""
    step = max(FINEST, (menu.zone.end - menu.zone.start) / 24.0)
    groups = [
        [
            *(
                (*arm.layout[:i], *arm.layout[i + 1 :])
                for i in range(len(arm.layout))
                if len(arm.layout) > 1
            ),
            *menu.neighbours(arm.layout, step, 1),
        ]
        for arm in arms
        if arm.layout
    ]
    for row in itertools.zip_longest(*groups):
        yield from (layout for layout in row if layout)


def front(arms: Sequence[Arm], most: int) -> list[Arm]:
    """Return at most `most` arms that are best for some price of capital, the cheapest first.

    If there are fewer, those that are nearly as good for one of the prices are added, because the
    estimates of a search are uncertain.
    """
    if not arms:
        return []
    site = arms[0].problem.site
    capital = np.array([site.capital(arm.layout) for arm in arms])
    value = np.array([arm.annual + arm.scale * (arm.objective() - arm.annual) for arm in arms])
    missed = np.array([arm.shortfall() for arm in arms])
    grid = (0.0, *np.geomspace(0.01, 10.0, 24).tolist())
    ranks = [np.lexsort((value + price * capital, missed)) for price in grid]
    chosen: dict[int, None] = {}
    for place in range(len(arms)):
        for rank in ranks:
            if len(chosen) < most:
                chosen[int(rank[place])] = None
        if len(chosen) >= most:
            break
    return sorted((arms[i] for i in chosen), key=lambda arm: float(site.capital(arm.layout)))
