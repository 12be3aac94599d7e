"""The engineering rule: the cheapest fence that a code of practice asks for.

UNI 11211-4:2012 (Peila and Ronco 2009, Nat. Hazards Earth Syst. Sci. 9, 1291-1298), values of the
partial factors from memory: of the blocks of the design events that cross a station, speed and
height at the 95 % quantile are raised by `SPEED`, the mass by `MASS`. A fence takes

    E_d = 1/2 m_d v_d^2 < MEL / 1.2,   height >= h_d + freeboard

with a freeboard of the blocks' mean radius, at least 0.5 m. Where none fits, the ditch of Ritchie
(1963, Highway Research Record 17), else an embankment or a wall as high as the fence.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rigdda import Ditch, Embankment, Fence, GravityWall, Layout, Site, Wall
from rigdda.agents.designers.catalogue import CrossingEnsemble, ensemble_for
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress
from rigdda.agents.designers.store import Store
from rigdda.barriers import FENCE_CLASSES
from rigdda.barriers.base import MIN_HEIGHT
from rigdda.envs import DesignProblem

QUANTILE = 0.95

SPEED = 1.10 * 1.02
"""Factor on speeds and heights: trajectories that were not calibrated, times good topography."""
MASS = 1.02
"""Factor on the mass: blocks surveyed in detail."""
ENERGY = 1.2
"""Factor on the energy that a class takes at its maximum energy level."""
FREEBOARD = 0.5
"""Least freeboard [m]."""

COVERED = 0.95
"""Share of the design blocks that would reach the road which a fence must meet: it does not stand
uphill of where they start."""

RELEASES = 4000
"""Releases that a layout which needs no search is evaluated on, at most."""

RITCHIE = {
    85.0: ((3.7, 1.0), (4.6, 1.2), (6.1, 1.2), (6.1, 1.2)),
    75.0: ((3.7, 1.0), (4.6, 1.2), (6.1, 1.8), (7.6, 1.8)),
    63.0: ((3.7, 1.2), (4.6, 1.8), (6.1, 1.8), (7.6, 2.7)),
    53.0: ((3.7, 1.0), (4.6, 1.2), (4.6, 1.8), (4.6, 1.8)),
    45.0: ((3.7, 1.0), (3.7, 1.5), (4.6, 1.8), (4.6, 1.8)),
}
"""Width and depth of a ditch [m] by inclination of the slope [deg], for slopes up to 10, 20 and
30 m high and for higher ones; from memory."""
HIGH = (10.0, 20.0, 30.0)


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the layout of the rule, from one barrier-free ensemble, and its evaluation.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger, menu = Ledger(problem, simulations, seed, progress, store), Menu(problem)
    layout = rule(problem, ensemble_for(ledger, menu.stations), menu)
    evaluation = ledger.evaluate(layout, "report", min(RELEASES, ledger.left))
    return ledger.result(evaluation, "start")


def rule(problem: DesignProblem, ensemble: CrossingEnsemble, menu: Menu) -> Layout:
    """Return the layout of the rule, none where no design block reaches the road."""
    events = problem.site.events
    design = [i for i, event in enumerate(events) if event.design] or list(range(len(events)))
    asked = demands(ensemble, design)
    if not asked:
        return ()
    fences = [f for x, e, h in asked for f in _fences(menu, x, e, h)] if _may(menu, "fence") else []
    if fences:
        return (min(fences, key=lambda fence: problem.site.capital((fence,))),)
    return instead(menu, *asked[-1][::2])


def demands(ensemble: CrossingEnsemble, events: list[int]) -> list[tuple[float, float, float]]:
    """Return station [m], energy E_d [J] and height [m] that are asked of a fence, downhill.

    Only stations that enough of the blocks of some events cross which reach the road.
    """
    table = ensemble.crossings
    which = np.isin(ensemble.event[table["release"]], events)
    dangerous = table[which & ensemble.reach_road()]
    wanted = COVERED * np.count_nonzero(dangerous["station"] == len(ensemble.stations))
    found = []
    for k, x in enumerate(ensemble.stations.tolist()):
        own = table[which & (table["station"] == k)]
        if wanted > 0 and np.count_nonzero(dangerous["station"] == k) >= wanted:
            found.append((x, _energy(own), _height(own)))
    return found


def _energy(crossings: NDArray[np.void]) -> float:
    """Return E_d of some crossings [J]."""
    speed = SPEED * np.quantile(crossings["speed"], QUANTILE)
    mass = MASS * np.quantile(crossings["mass"], QUANTILE)
    return float(0.5 * mass * speed**2)


def _height(crossings: NDArray[np.void]) -> float:
    """Return the height that some crossings ask for [m]."""
    freeboard = max(FREEBOARD, float(crossings["radius"].mean()))
    return float(SPEED * np.quantile(crossings["height"], QUANTILE)) + freeboard


def _may(menu: Menu, kind: str) -> bool:
    return kind in menu.problem.kinds


def _fences(menu: Menu, x: float, energy: float, height: float) -> Iterator[Fence]:
    """Yield the fences that may stand at a chainage and take an energy at a height."""
    wanted = math.ceil(2.0 * height - 1e-9) / 2.0  # in steps of half a metre
    for name, row in FENCE_CLASSES.items():
        tall = max(row.lowest, wanted)
        if energy < 1e3 * name / ENERGY and tall <= min(row.height, menu.zone.max_height):
            fence = menu.put(Fence(x, tall, energy_class=name), x)
            if isinstance(fence, Fence):
                yield fence


def instead(menu: Menu, x: float, height: float) -> Layout:
    """Return what is built where no fence fits: a ditch at the toe, else what is as high."""
    zone, toe = menu.zone, menu.problem.site.slope.toe
    width, depth = ritchie(menu.problem.site)
    width = min(max(width, zone.min_width), zone.max_width)
    tall = min(max(height, MIN_HEIGHT), zone.max_height)
    thick = Embankment.least_crest(zone)
    for barrier, at in (
        (Ditch(x, min(depth, zone.max_depth), width), toe),
        (Embankment(x, tall, thick), x),
        (GravityWall(x, tall, thick), x),
        (Wall(x, tall, thick), x),
    ):
        found = menu.nearest(barrier, at) if _may(menu, barrier.kind) else None
        if found is not None:
            return (found,)
    return ()


def ritchie(site: Site) -> tuple[float, float]:
    """Return width and depth of the ditch of Ritchie's table for a site's slope [m]."""
    points = np.array(site.slope.points)
    toe = site.slope.toe
    above = points[points[:, 0] < toe]
    rock = max(above[:, 1].max() - np.interp(toe, *points.T), 0.1)
    crest = above[above[:, 1] >= above[:, 1].max() - 0.1 * rock][-1]  # from which the cut falls
    steep = math.degrees(math.atan2(rock, max(toe - crest[0], 1e-3)))
    row = RITCHIE[min(RITCHIE, key=lambda angle: abs(angle - steep))]
    return row[int(np.searchsorted(HIGH, rock))]
