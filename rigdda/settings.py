"""How a scene is computed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigdda import check
from rigdda.errors import BadInput

LARGEST_DT = 0.02
"""Largest step at which nothing passes a wall 0.2 m thick at up to 100 m/s [s]."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Numerical settings of a simulation.

    Parameters
    ----------
    dt : float
        Time step [s], at most 0.02. 5 ms keeps a 20 m/s block within 0.1 m a step and the outcome
        of a rockfall within the scatter of its releases. Contacts are foreseen along straight
        paths, but an eccentric impact at 100 m/s leaves a block spinning at up to 65 rad/s, a
        radian in 0.02 s. Of 200 random blocks shot at a wall 0.2 m thick at 5 to 100 m/s, the
        deepest corner went 1 cm into it at 5 and 10 ms and 6 cm at 20 ms; at 50 ms two blocks
        passed.
    penetration : float or None
        Wanted penetration of a contact under the load it carries [m]; the penalty stiffness
        follows from it. None: 1e-4 of the mean block size (the root of its area), small enough
        for tall stacks and large enough for conjugate gradients to converge in few iterations.
    tolerance : float
        Relative residual at which conjugate gradients stop. 1e-7: looser, and the small forces at
        the top of a tall stack drown in the error of the large ones at its base.
    open_close_iterations : int
        Most open-close iterations in a step; nearly all steps need 1 to 3.
    sleeping : bool
        Let blocks at rest sleep until they are disturbed. They cost nothing then.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    dt: float = 5e-3
    penetration: float | None = None
    tolerance: float = 1e-7
    open_close_iterations: int = 12
    sleeping: bool = True

    def __post_init__(self) -> None:
        if isinstance(self.dt, int | float) and LARGEST_DT < self.dt < math.inf:
            raise BadInput(
                "dt",
                self.dt,
                f"give at most {LARGEST_DT:g} s: in a longer step a block struck at 100 m/s turns "
                "too far, and may pass a thin wall",
            )
        check.number("dt", self.dt, 0.0, open_low=True)
        if self.penetration is not None:
            check.number("penetration", self.penetration, 0.0, open_low=True)
        check.number("tolerance", self.tolerance, 0.0, 1e-2, open_low=True)
        check.integer("open_close_iterations", self.open_close_iterations, 1)
