"""The best constant: one barrier, the same for every site, where it stood best on the mean.

What a designer must beat to be worth its releases: it knows nothing of the site but its zone.
"""

from __future__ import annotations

from rigdda import Barrier, Ditch, Embankment, Fence, GravityWall, Layout, Wall
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress
from rigdda.agents.designers.rule import RELEASES
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem

CONSTANTS: tuple[tuple[Barrier, float], ...] = (
    (Ditch(0.0, 2.5, 5.0), 1.0),
    (Embankment(0.0, 2.5, 1.0), 1.0),
    (GravityWall(0.0, 2.0, 1.0), 1.0),
    (Fence(0.0, 2.0, energy_class=250), 0.5),
    (Wall(0.0, 2.0, 1.0), 1.0),
)
"""Barriers, wherever they stand, and their stations as shares of the zone, best first.

The mean distance (Z - Z_reference) / (Z_nothing - Z_reference) over the six design sites, 1,000
releases each: ditch .54 (verge .14, bench .35, talus .74, narrow 1, cliff .98, shu-hwa .04), .61
if 2 m deep and 4 m wide, .72 if 1.5 and 3 m; embankment .57, .63 if 4 m high; gravity wall .79 if
1.5 m high; fence .81 if of 500 kJ and 3 m high. What does not fit is nothing. The rigid wall was
not tried.
"""


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the best constant that the problem's kinds allow, and its evaluation.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    layout = constant(problem, Menu(problem))
    evaluation = ledger.evaluate(layout, "report", min(RELEASES, ledger.left))
    return ledger.result(evaluation, "start")


def constant(problem: DesignProblem, menu: Menu) -> Layout:
    """Return the first of `CONSTANTS` that may be built; mesh, where nothing else is allowed."""
    for barrier, share in CONSTANTS:
        found = place(menu, barrier, share) if barrier.kind in problem.kinds else ()
        if found:
            return found
    first = next(iter(menu.lone("mesh")), None)
    return () if first is None else (first,)


def place(menu: Menu, barrier: Barrier, share: float) -> Layout:
    """Return a barrier at a share of the zone, or as near as it may stand; none where nowhere."""
    zone = menu.zone
    found = menu.nearest(barrier, zone.start + share * (zone.end - zone.start))
    return () if found is None else (found,)
