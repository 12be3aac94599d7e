"""How a scene is computed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import check

USUAL_DT = 5e-3
"""Step of a simulation, and of a site that does not say [s]: the outcome of a rockfall is within
the scatter of its releases, and a block of 20 m/s moves by 0.1 m."""

LARGEST_DT = 0.1
"""Largest step [s]: in it a block at rest falls by 5 cm; more was hardly meant in seconds."""

SHORTEST_DT = 1e-6
"""Shortest step [s]: a thousandth of what the accuracy of an outcome needs, days of computing."""

LONGEST_STEP = 0.08
"""Longest step over the time in which a block falls by half its size, sqrt(size / g) [-], with the
mean size of the blocks: 25 ms for blocks of 1 m. Contacts sink in in longer ones: with steps of 25
to 100 ms 20 of 141 hard cases did too deep."""

SMALLEST = 0.5
"""The same for the smallest block [-], which falls by an eighth of its size in it. With 0.56 thin
blocks sink into one another, with 0.7 they go through the ground."""

EARTH = 9.81
"""Gravity that gives scenes without any their scale [m/s2]."""

SOLVERS = ("pcg", "block-pcg", "sor", "direct")


@dataclass(frozen=True, slots=True)
class Settings:
    """Numerical settings of a simulation.

    Parameters
    ----------
    dt : float
        Time step [s], 1e-6 to 0.1. 5 ms keeps a 20 m/s block within 0.1 m a step and the outcome
        of a rockfall within the scatter of its releases. A scene is refused whose blocks are too
        small for it: a step is at most 0.08 sqrt(size / g) of the mean block, 25 ms for 1 m, and
        0.5 sqrt(size / g) of the smallest. What flies a good part of its size in a step may strike
        what was not foreseen, and pass what is thin.
    penetration : float or None
        Wanted penetration of a contact under the load it carries [m]; the penalty stiffness
        follows from it. None: 1e-4 of the mean block size (the root of its area), small enough
        for tall stacks and large enough for conjugate gradients to converge in few iterations.
    tolerance : float
        Relative residual at which conjugate gradients stop. 1e-7: looser, and the small forces at
        the top of a tall stack drown in the error of the large ones at its base.
    sweep_tolerance : float
        Islands of several blocks in motion take a step in eight substeps. In each their contacts
        are swept over until no velocity changes by more than this times the number of blocks but
        one [m/s], nor by more than 2 % of the greatest speed, up to 100 times.
    open_close_iterations : int
        Most open-close iterations in a step; nearly all steps need 1 to 3. What has not settled
        then is relaxed.
    mode : {"dynamic", "static"}
        "static" starts every step at rest: steps are then increments of load, not of time.
    solver : {"pcg", "block-pcg", "sor", "direct"}
        Of islands of more than two blocks at rest; one or two are solved directly, with their
        friction. "pcg": conjugate gradients with the inverse diagonal, the paper's;
        "block-pcg": with the inverse 3x3 blocks; "sor": the original successive over-relaxation;
        "direct": Cholesky factors within the profile, a third of the time for a stack of 100.
    relaxation : float
        Over-relaxation factor of "sor" [-], above 0 and below 2.
    post_correction : bool
        Turn blocks exactly after each step. False moves their corners by the linear displacement
        function of the solve, so that blocks expand as they turn (Figs 1 to 3).
    islands : bool
        Solve each cluster of blocks that touch on its own. False: all blocks in one system.
    sleeping : bool
        Let blocks at rest sleep until they are disturbed. They cost nothing then.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    dt: float = USUAL_DT
    penetration: float | None = None
    tolerance: float = 1e-7
    sweep_tolerance: float = 0.005
    open_close_iterations: int = 12
    mode: str = "dynamic"
    solver: str = "pcg"
    relaxation: float = 1.5
    post_correction: bool = True
    islands: bool = True
    sleeping: bool = True

    def __post_init__(self) -> None:
        check.set_number(self, "dt", SHORTEST_DT, LARGEST_DT)
        if self.penetration is not None:
            check.set_number(self, "penetration", 0.0, open_low=True)
        check.set_number(self, "tolerance", 0.0, 1e-2, open_low=True)
        check.set_number(self, "sweep_tolerance", 0.0, open_low=True)
        iterations = check.integer("open_close_iterations", self.open_close_iterations, 1)
        object.__setattr__(self, "open_close_iterations", iterations)
        check.one_of("mode", self.mode, ("dynamic", "static"))
        check.one_of("solver", self.solver, SOLVERS)
        check.set_number(self, "relaxation", 0.0, 1.99, open_low=True)
        check.set_booleans(self, "post_correction", "islands", "sleeping")


def longest_step(areas: NDArray[np.float64], gravity: float) -> float:
    """Return the longest step [s] that suits free blocks of these areas [m2].

    A scene with a longer one is refused (`rigdda.dynamics.packing.check_step`), a site
    divides its step (`Site.settings`).

    Without gravity as under that of the earth.
    """
    return _longest_step(np.add.reduce(areas) / len(areas), areas.min(), gravity)


def longest_step_of_single(area: float, gravity: float) -> float:
    """Return the longest step [s] that suits a single block of this area [m2]."""
    return _longest_step(area, area, gravity)


def _longest_step(mean_area: float, least_area: float, gravity: float) -> float:
    mean, least, g = math.sqrt(mean_area), math.sqrt(least_area), gravity or EARTH
    return min(LONGEST_STEP * math.sqrt(mean / g), SMALLEST * math.sqrt(least / g))
