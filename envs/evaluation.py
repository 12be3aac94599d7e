"""What a layout is worth on some releases, with intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from rigdda import Layout, Outcome

Interval = tuple[float, float]

CONFIDENCE = 0.95
"""Probability of every interval."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What a layout is worth on some releases.

    Parameters
    ----------
    layout : tuple of Barrier
        The barriers.
    seeds : tuple of int
        Seed of each release.
    objective, debris : float
        Means over the releases of the objective and of the debris fraction [-].
    ci, debris_ci : (float, float)
        Their 95 % intervals by Student's t; for one release (-inf, inf) and (0, 1). That of the
        debris fraction is cut to [0, 1]. Equal outcomes give an interval without width.
    cost : float
        Price of the layout, without the charge above the limit.
    outcomes : tuple of Outcome
        One for each seed.
    """

    layout: Layout
    seeds: tuple[int, ...]
    objective: float
    debris: float
    ci: Interval
    debris_ci: Interval
    cost: float
    outcomes: tuple[Outcome, ...]

    @property
    def typical(self) -> int:
        """Seed of the release whose debris fraction is nearest the mean, the first of equals."""
        fractions = np.array([outcome.debris_fraction for outcome in self.outcomes])
        return self.seeds[int(np.argmin(np.abs(fractions - self.debris)))]


def student_interval(values: ArrayLike) -> Interval:
    """Return the 95 % interval of the mean of independent values; one alone tells nothing."""
    sample = np.asarray(values, dtype=np.float64)
    if len(sample) < 2:
        return -math.inf, math.inf
    quantile = float(stdtrit(len(sample) - 1, 0.5 * (1.0 + CONFIDENCE)))
    half = quantile * float(sample.std(ddof=1)) / math.sqrt(len(sample))
    mean = float(sample.mean())
    return mean - half, mean + half
