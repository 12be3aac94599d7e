"""Search for the front of a site: layouts from the cheapest to the one with the least Z.

A designer finds the layout with the least annual cost Z. If several sites share a budget, money is
scarce and each site needs cheaper layouts as well: those with the least Z + price x capital for
some price of capital [1/year]. The search explores as the designer `race` does, but for several
prices in turn, and it also tries barriers that are smaller than those of the catalogue. The result
is a list of layouts to be compared on other releases.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigdda import Layout
from rigdda.agents.designers.convex import unsearched
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import Ledger, Progress
from rigdda.agents.designers.race import explore, forecast_pool
from rigdda.agents.designers.racing import Track
from rigdda.agents.designers.store import Store
from rigdda.agents.designers.surrogate import Surrogate
from rigdda.envs import DesignProblem

PRICES = (0.0, 0.03, 0.1, 0.3, 1.0)
"""Prices of capital for which layouts are sought [1/year]. A price of 1 means that a euro is spent
only if it saves a euro per year."""

MOST_LAYOUTS = 12
"""Largest number of layouts of a front, including no barrier."""


@dataclass(frozen=True, slots=True)
class SearchedFront:
    """Result of a search for a front.

    Parameters
    ----------
    layouts : tuple of Layout
        The layouts, from no barrier, the cheapest, to that of the least Z.
    releases : int
        Number of releases that were used, including those without barriers.
    """

    layouts: tuple[Layout, ...]
    releases: int


def layouts(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> tuple[Layout, ...]:
    """Return the layouts of `search`.

    Raises
    ------
    BadInput, Diverged
        As `search` does.
    """
    return search(problem, simulations, seed, progress, store).layouts


def search(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> SearchedFront:
    """Return up to `MOST_LAYOUTS` layouts, from no barrier, the cheapest, to that of the least Z.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    menu, track = Menu(problem), Track(ledger)
    known = unsearched(problem, menu)
    surrogate = forecast_pool(ledger, menu, known)
    surrogate.add((barrier,) for barrier in menu.smallest())
    track.expect = surrogate.expect
    explore(track, surrogate, ledger.left, PRICES)
    found = dict.fromkeys([(), *known, *front(surrogate, MOST_LAYOUTS - 1 - len(known))])
    order = sorted(found, key=lambda layout: (problem.site.capital(layout), len(layout)))
    return SearchedFront(tuple(order), ledger.used)


def front(surrogate: Surrogate, most: int) -> list[Layout]:
    """Return at most `most` layouts that are best for some price of capital.

    If there are fewer, those that are nearly as good for one of the prices are added, because the
    estimates of a search are uncertain.
    """
    grid = (0.0, *np.geomspace(0.01, 10.0, 24).tolist())
    ranked = [surrogate.best(most, price) for price in grid]
    chosen: dict[Layout, None] = {}
    for row in zip(*ranked, strict=True):
        for layout in row:
            if len(chosen) < most:
                chosen[layout] = None
    return list(chosen)
