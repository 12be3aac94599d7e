"""The engineering rule: the cheapest fence that a code of practice requires.

The rule follows UNI 11211-4:2012 (Peila and Ronco 2009, Nat. Hazards Earth Syst. Sci. 9,
1291-1298), with values of the partial factors from memory. The design values at a station are the
95 % quantiles of the blocks of the design events that cross it. Speed and height are multiplied by
`SPEED` and the mass by `MASS`. A fence must satisfy

    E_d = 1/2 m_d v_d^2 < MEL / 1.2,   height >= h_d + freeboard

with a freeboard equal to the mean radius of the blocks, but at least 0.5 m. If no fence fits, the
rule uses the ditch of Ritchie (1963, Highway Research Record 17), or else an embankment or a wall
as high as the fence.
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
"""Factor on speeds and heights [-]: 1.10 for trajectories without calibration, times 1.02 for good
topographic data."""
MASS = 1.02
"""Factor on the mass, for blocks that were surveyed in detail [-]."""
ENERGY = 1.2
"""Safety factor on the energy of a class at its maximum energy level (MEL) [-]."""
FREEBOARD = 0.5
"""Least freeboard [m]."""

COVERED = 0.95
"""Least share of the design blocks that reach the road which must cross the station of a fence [-].
It prevents fences uphill of the sources."""

RELEASES = 4000
"""Largest number of releases for the evaluation of a layout that needs no search."""

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
    """Return the layout of the rule for an ensemble without barriers, and its evaluation.

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
    """Return the layout of the rule; it is empty if no design block reaches the road."""
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
    """Return the station [m], energy E_d [J] and height [m] that a fence needs, going downhill.

    Only those stations are returned that are crossed by the share `COVERED` of the blocks of the
    events which reach the road.
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
    """Return the design energy E_d of some crossings [J]."""
    speed = SPEED * np.quantile(crossings["speed"], QUANTILE)
    mass = MASS * np.quantile(crossings["mass"], QUANTILE)
    return float(0.5 * mass * speed**2)


def _height(crossings: NDArray[np.void]) -> float:
    """Return the height of a fence that some crossings require [m]."""
    freeboard = max(FREEBOARD, float(crossings["radius"].mean()))
    return float(SPEED * np.quantile(crossings["height"], QUANTILE)) + freeboard


def _may(menu: Menu, kind: str) -> bool:
    return kind in menu.problem.kinds


def _fences(menu: Menu, x: float, energy: float, height: float) -> Iterator[Fence]:
    """Yield the fences that may be built at a chainage and have enough energy and height."""
    wanted = math.ceil(2.0 * height - 1e-9) / 2.0  # in steps of half a metre
    for name, row in FENCE_CLASSES.items():
        tall = max(row.lowest, wanted)
        if energy < 1e3 * name / ENERGY and tall <= min(row.height, menu.zone.max_height):
            fence = menu.put(Fence(x, tall, energy_class=name), x)
            if isinstance(fence, Fence):
                yield fence


def instead(menu: Menu, x: float, height: float) -> Layout:
    """Return the layout if no fence fits: a ditch at the toe, or else a barrier of the height."""
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
    """Return the width and depth of the ditch in Ritchie's table for the slope of a site [m]."""
    points = np.array(site.slope.points)
    toe = site.slope.toe
    above = points[points[:, 0] < toe]
    rock = max(above[:, 1].max() - np.interp(toe, *points.T), 0.1)
    crest = above[above[:, 1] >= above[:, 1].max() - 0.1 * rock][-1]  # the crest of the cut
    steep = math.degrees(math.atan2(rock, max(toe - crest[0], 1e-3)))
    row = RITCHIE[min(RITCHIE, key=lambda angle: abs(angle - steep))]
    return row[int(np.searchsorted(HIGH, rock))]
