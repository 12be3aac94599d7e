"""Observed order of convergence of the smooth cases."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rigdda.validation.case import Case, evaluate

STEPS = (1e-2, 5e-3, 2.5e-3, 1.25e-3)
"""Time steps [s]."""

FLOOR = 1e-10
"""Error below which rounding dominates [-]."""


@dataclass(frozen=True, slots=True)
class Convergence:
    """Errors of one checked quantity at the steps `STEPS`, and their order.

    `order` is the slope of the least-squares line through the logarithms of error and step, over
    the errors above rounding; NaN if there are fewer than two.
    """

    case: str
    quantity: str
    errors: tuple[float, ...]

    @property
    def order(self) -> float:
        """Observed order of convergence [-]."""
        points = [(s, e) for s, e in zip(STEPS, self.errors, strict=True) if FLOOR < e < math.inf]
        if len(points) < 2:
            return math.nan
        step, error = np.log(np.array(points)).T
        return float(np.polyfit(step, error, 1)[0])


def converge(case: Case, seed: int = 0) -> tuple[Convergence, ...]:
    """Run a case with all steps."""
    runs = [evaluate(case, dt, seed) for dt in STEPS]
    return tuple(
        Convergence(case.name, check.quantity, tuple(run[i].error for run in runs))
        for i, check in enumerate(case.checks)
    )
