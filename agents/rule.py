"""The engineering rule: one barrier where blocks arrive with least energy, higher than they bounce.

After UNI 11211-4:2012 (Peila and Ronco 2009, Nat. Hazards Earth Syst. Sci. 9, 1291-1298): the
95 % quantile of the bounce height and a freeboard of at least 0.5 m. Here the bounce height is that
of the blocks' tops, so that the freeboard, otherwise half a block, is the larger of 0.5 m and half
the mean circumscribed radius. A fence has the capacity for all that a release brings below its top,
in 95 % of the releases: what it takes adds up, block after block.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.crossings import Ensemble, ensemble_for
from agents.protocol import DesignResult, Ledger, Progress
from agents.store import Store
from envs import DesignProblem
from rigdda import Fence, Site, Wall, check

QUANTILE = 0.95
FREEBOARD = 0.5
"""Least freeboard [m]."""


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the layout of the rule, from one barrier-free ensemble, and its evaluation.

    At most 48 simulations are used: 16 to look at, 32 to evaluate.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2, the seed out of range or neither fences nor walls are among the
        kinds; if a simulation diverges.
    """
    kind = kind_for(problem)
    ledger = Ledger(problem, simulations, seed, progress, store)
    layout = rule(problem.site, ensemble_for(ledger), kind)
    return ledger.result(ledger.evaluate(layout, "final", min(32, ledger.left)))


def kind_for(problem: DesignProblem) -> str:
    """Return the kind of barrier that the rule builds: a fence, or a wall where fences may not.

    Raises
    ------
    BadInput
        If neither may be built.
    """
    if "fence" in problem.kinds:
        return "fence"
    return check.one_of("kind of the rule's barrier", "wall", problem.kinds)


def rule(site: Site, ensemble: Ensemble, kind: str) -> tuple[Wall | Fence, ...]:
    """Return one barrier where the 95 % energy of the crossing blocks is least.

    Stations that would need a higher one than the site allows are passed over; if all would, it
    is as high as it may be. Among equal energies the station nearest the toe is taken. Where no
    block crosses a station there is nothing to stop, and no barrier.
    """
    zone, stations = site.barrier_zone, range(len(ensemble.stations))
    crossed = [k for k in stations if len(ensemble.at(k))]
    if not crossed:
        return ()
    energy = {k: np.quantile(ensemble.at(k)["energy"], QUANTILE) for k in crossed}
    height = {k: height_at(ensemble, k) for k in crossed}
    allowed = [k for k in crossed if height[k] <= zone.max_height] or crossed
    best = min(allowed, key=lambda k: (energy[k], abs(ensemble.stations[k] - site.slope.toe)))
    x, tall = float(ensemble.stations[best]), min(height[best], zone.max_height)
    if kind == "wall":
        return (Wall(x, tall, zone.min_thickness),)
    capacity = float(np.quantile(energies(ensemble, best, tall), QUANTILE))
    return (Fence(x, tall, min(max(capacity, zone.min_capacity), zone.max_capacity)),)


def height_at(ensemble: Ensemble, station: int) -> float:
    """Return the 95 % bounce height of block tops at a station, and the freeboard [m]."""
    crossings = ensemble.at(station)
    bounce = np.quantile(crossings["height"] + crossings["radius"], QUANTILE)
    return float(bounce + max(FREEBOARD, ensemble.radius / 2.0))


def energies(ensemble: Ensemble, station: int, height: float) -> NDArray[np.float64]:
    """Return the energy that each release brings across a station below a height, (R,) [J]."""
    crossings = ensemble.at(station)
    low = crossings[crossings["height"] <= height]
    total = np.zeros(len(ensemble.mass))
    np.add.at(total, low["release"], low["energy"])
    return total
