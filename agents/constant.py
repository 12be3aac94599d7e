"""The best constant: one barrier, the same for every site, where it stood best on the mean.

What a designer must beat to be worth its releases: it knows nothing of the site but its zone.
"""

from __future__ import annotations

from agents.menu import Menu
from agents.protocol import DesignResult, Ledger, Progress
from agents.rule import RELEASES
from agents.store import Store
from envs import DesignProblem
from rigdda import Barrier, Ditch, Embankment, Fence, GravityWall, Layout, Wall

CONSTANTS: tuple[tuple[Barrier, float], ...] = (
    (Embankment(0.0, 2.5, 1.0), 1.0),
    (Ditch(0.0, 1.0, 2.0), 0.3),
    (GravityWall(0.0, 2.0, 1.0), 1.0),
    (Fence(0.0, 2.0, energy_class=250), 0.5),
    (Wall(0.0, 2.0, 1.0), 1.0),
)
"""Barriers, wherever they stand, and their stations as shares of the zone, the best first.

Found over the six design sites, 150 releases each of 30 constants (three walls at the downhill end,
three ditches, three embankments and four fences at two or three stations each; what does not fit is
nothing), by the mean distance (Z - Z_race) / (Z_nothing - Z_race) from what `race` finds with 8000
releases: .64 (bench .58, talus .47, verge -.02, narrow 1, cliff 1, shu-hwa .81), .70, .77, .78. The
rigid wall was not tried.
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
        if barrier.kind in problem.kinds:
            return place(menu, barrier, share)
    first = next(iter(menu.lone("mesh")), None)
    return () if first is None else (first,)


def place(menu: Menu, barrier: Barrier, share: float) -> Layout:
    """Return a barrier at a share of the zone, or as near as it may stand; none where nowhere."""
    zone = menu.zone
    found = menu.nearest(barrier, zone.start + share * (zone.end - zone.start))
    return () if found is None else (found,)
