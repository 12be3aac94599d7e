"""Numerical settings of simulations, and limits of their time steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.errors import BadInput

USUAL_DT = 5e-3
"""Default time step [s]. The error of the outcome of a rockfall is below the scatter between
releases, and a block at 20 m/s moves by 0.1 m per step."""

LARGEST_DT = 0.1
"""Maximum time step [s]; a block falls by 5 cm from rest in it. Larger values are probably not in
seconds."""

SHORTEST_DT = 1e-6
"""Minimum time step [s]: a thousandth of what accurate outcomes need; runs would take days."""

LONGEST_STEP = 0.16
"""Maximum time step relative to sqrt(size / g), where size is the mean block size [-]; 51 ms for
blocks of 1 m. A block falls by half its size in a time of sqrt(size / g). With steps of 50 ms, this
limit refuses 17 of 47 difficult cases, and two of the others miss their tolerance: 1,000 blocks
that fall into a hopper at 15 m/s penetrate by 0.64 of their size. With steps of 20 ms, two of 47
miss it. The releases of a site take shorter steps (`site_step`)."""

SMALLEST = 0.5
"""Maximum time step relative to sqrt(size / g) of the smallest block [-], which falls by an eighth
of its size in it. At 0.56 thin blocks penetrate each other; at 0.7 they pass through the ground."""

EARTH = 9.81
"""Gravity used for the time scale of scenes without gravity [m/s2]."""

SOLVERS = ("pcg", "block-pcg", "sor", "direct")


@dataclass(frozen=True, slots=True)
class Settings:
    """Numerical settings of a simulation.

    Parameters
    ----------
    dt : float
        Time step [s], 1e-6 to 0.1. With 5 ms a block at 20 m/s moves by 0.1 m per step, and the
        error of the outcome of a rockfall is below the scatter between releases. The step must not
        exceed 0.16 sqrt(size / g) of the mean block (51 ms for 1 m) or 0.5 sqrt(size / g) of the
        smallest block; otherwise the scene is rejected. A block that moves by a large part of its
        size in a step may hit objects that were not detected and pass through thin ones.
    penetration : float or None
        Target penetration of a contact under its load [m], which determines the penalty stiffness.
        None: 1e-4 of the mean block size (square root of the area), small enough for tall stacks
        and large enough for fast convergence of conjugate gradients.
    tolerance : float
        Relative residual at which conjugate gradients stop. With values above 1e-7 the errors of
        large forces at the base of a tall stack exceed the small forces at its top.
    sweep_tolerance : float
        Convergence tolerance for islands of several moving blocks, which take a step in eight
        substeps. In each substep the contacts are swept until no velocity changes by more than this
        value times the number of blocks minus one [m/s], nor by more than 2 % of the greatest
        speed, or for at most 100 sweeps.
    open_close_iterations : int
        Maximum number of open-close iterations per step; nearly all steps need 1 to 3. If they have
        not converged, relaxation is used.
    mode : {"dynamic", "static"}
        "static" starts every step at rest: steps are then increments of load instead of time.
    solver : {"pcg", "block-pcg", "sor", "direct"}
        Solver for islands of several blocks that are solved as a whole; a single block is solved
        directly. "pcg": conjugate gradients preconditioned by the diagonal, as in the
        paper; "block-pcg": preconditioned by the 3x3 blocks; "sor": the original successive
        over-relaxation; "direct": Cholesky factorisation within the profile, which takes a third of
        the time for a stack of 100.
    relaxation : float
        Over-relaxation factor of "sor" [-], above 0 and below 2.
    post_correction : bool
        Whether blocks are rotated exactly after each step. If False, their corners move by the
        linear displacement function of the solution, so that blocks expand as they rotate (Figs 1
        to 3).
    islands : bool
        Whether each cluster of touching blocks is solved separately; otherwise all blocks form one
        system.
    sleeping : bool
        Whether blocks at rest sleep, at no cost, until they are disturbed. In static mode and in
        scenes with ground motion, bolts or fixed points, no block sleeps.

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
    """Return the maximum time step [s] for free blocks of these areas [m2].

    A scene with a longer step is rejected (`rigdda.dynamics.packing.check_step`). Without gravity,
    that of the Earth is used.
    """
    mean, least = math.sqrt(np.add.reduce(areas) / len(areas)), math.sqrt(areas.min())
    g = gravity or EARTH
    return min(LONGEST_STEP * math.sqrt(mean / g), SMALLEST * math.sqrt(least / g))


def site_step(dt: float, areas: NDArray[np.float64], gravity: float) -> float:
    """Return the time step [s] of a release of a site with a step of `dt` [s].

    It is `dt` divided by the least whole number that makes it at most half of the longest step for
    free blocks of these areas [m2]. Contacts of small stones are then as accurate as those of large
    blocks, and no release is rejected.
    """
    return dt / max(1, math.ceil(dt / (0.5 * longest_step(areas, gravity))))


def check_damping(damping: float, when: str, prefix: str = "") -> None:
    """Check that mass-proportional damping [1/s] acts always, if there is any.

    Raises
    ------
    BadInput
        If it is to act in contact only; `prefix` precedes the name of the field.
    """
    if damping > 0.0 and when == "contact":
        hint = (
            "losses in contact are described by rolling resistance: leave out the damping and give "
            '`rolling` to the surfaces, or use "always"'
        )
        raise BadInput(f"{prefix}damping_when", when, hint)
