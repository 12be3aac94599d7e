"""Processor time of an answer within a level, from a sample of releases and the reference."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from experiments.outcome_cost.sample import Floats, Release, outcomes

CERTAIN = 1.645
"""Half width of a 90 % interval in standard errors, within which a bias must be known."""

RESAMPLES = 300


class Sample(NamedTuple):
    """Results of a setting: means (3,), resampled means (RESAMPLES, 3), time per release [s]."""

    means: Floats
    resampled: Floats
    cpu: float
    releases: int

    @property
    def error(self) -> Floats:
        """Standard errors of the means, (3,)."""
        return self.resampled.std(axis=0)


class Cost(NamedTuple):
    """Processor time of an answer within a level [s], and its resampled values."""

    value: float
    resampled: Floats

    @property
    def known(self) -> bool:
        """Whether the bias is known with the accuracy of the level."""
        return not math.isnan(self.value)

    def ends(self) -> tuple[float, float]:
        """Return the 95 % interval [s]."""
        low, high = np.quantile(self.resampled, (0.025, 0.975), method="nearest")
        return float(low), float(high)


class Verdict(NamedTuple):
    """Relative bias from the reference, its standard error, and scatter of a release; (3,) each."""

    bias: Floats
    error: Floats
    scatter: Floats


def sampled(releases: list[Release], seed: int = 0) -> Sample:
    """Return the sample of some releases; `seed` is that of the resampling."""
    rng = np.random.default_rng([seed, len(releases)])
    picks = rng.integers(len(releases), size=(RESAMPLES, len(releases)))
    resampled = np.array([outcomes([releases[i] for i in pick]) for pick in picks])
    cpu = float(np.mean([r.cpu for r in releases]))
    return Sample(outcomes(releases), resampled, cpu, len(releases))


def judge(sample: Sample, reference: Sample) -> Verdict:
    """Return bias and scatter of a sample."""
    error = np.hypot(sample.error, reference.error) / reference.means
    scatter = sample.error * math.sqrt(sample.releases) / reference.means
    return Verdict(sample.means / reference.means - 1.0, error, scatter)


def needed(bias: Floats, noise: Floats, scatter: Floats, level: float) -> Floats:
    """Return the releases that each outcome needs to be within a level, inf if impossible.

    Parameters
    ----------
    bias, noise, scatter : (..., 3) arrays
        Estimated bias, its standard error, and scatter of one release.
    """
    left = level**2 - np.maximum(bias**2 - noise**2, 0.0)
    releases = np.divide(scatter**2, left, out=np.full(left.shape, math.inf), where=left > 0.0)
    return np.maximum(releases, 1.0)


def cost(sample: Sample, reference: Sample, level: float) -> Cost:
    """Return the processor time of an answer within a level.

    It is infinite if the bias is certainly greater. It is NaN if the bias is not known with the
    accuracy of the level; the resampled values are then those of an unbiased setting, a lower
    bound.
    """
    bias, error, scatter = judge(sample, reference)
    half = CERTAIN * error
    none = np.zeros(3)
    if (half > level).any() and not (np.abs(bias) - half > level).any():
        least = sample.cpu * float(needed(none, none, scatter, level).max())
        return Cost(math.nan, np.full(RESAMPLES, least))
    found = needed(bias, error, scatter, level).max()
    each = sample.resampled / reference.resampled - 1.0
    resampled = needed(each, math.sqrt(2.0) * error, scatter, level).max(axis=1)
    return Cost(sample.cpu * float(found), sample.cpu * resampled)
