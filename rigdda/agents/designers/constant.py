"""The constant layout: the first barrier of a fixed list that fits into the barrier zone of a site.

The list has one barrier of each kind with fixed sizes and a fixed relative place; if none may be
built, the layout is mesh. The designer uses no other information on a site. It is the baseline that
a designer has to improve on.
"""

from __future__ import annotations

from rigdda import Barrier, Ditch, Embankment, Fence, GravityWall, Layout, Wall
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress
from rigdda.agents.designers.rule import UNSEARCHED_RELEASES
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem

CONSTANTS: tuple[tuple[Barrier, float], ...] = (
    (Ditch(0.0, 2.5, 5.0), 1.0),
    (Embankment(0.0, 2.5, 1.0), 1.0),
    (GravityWall(0.0, 2.0, 1.0), 1.0),
    (Fence(0.0, 2.0, energy_class=250), 0.5),
    (Wall(0.0, 2.0, 1.0), 1.0),
)
"""Barriers and their stations as fractions of the zone, the best first.

They were chosen by the mean relative distance (Z - Z_reference) / (Z_nothing - Z_reference) over
the six design sites with 1,000 releases each. A barrier that does not fit counts as no barrier.
Ditch: 0.54 (verge 0.14, bench 0.35, talus 0.74, narrow 1, cliff 0.98, shu-hwa 0.04), or 0.61 if it
is 2 m deep and 4 m wide, and 0.72 if it is 1.5 m deep and 3 m wide. Embankment: 0.57, or 0.63 if
it is 4 m high. Gravity wall: 0.79 if it is 1.5 m high. Fence: 0.81 with 500 kJ and a height of
3 m. The rigid wall was not tried.
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
    evaluation = ledger.evaluate(layout, "report", min(UNSEARCHED_RELEASES, ledger.left))
    return ledger.result(evaluation, "start")


def constant(problem: DesignProblem, menu: Menu) -> Layout:
    """Return the first of `CONSTANTS` that may be built, or mesh if nothing else is allowed."""
    for barrier, share in CONSTANTS:
        found = place(menu, barrier, share) if barrier.kind in problem.kinds else ()
        if found:
            return found
    first = next(iter(menu.singles("mesh")), None)
    return () if first is None else (first,)


def place(menu: Menu, barrier: Barrier, share: float) -> Layout:
    """Return a barrier as near as possible to a fraction of the zone; empty if it does not fit."""
    zone = menu.zone
    found = menu.nearest(barrier, zone.start + share * (zone.end - zone.start))
    return () if found is None else (found,)
