"""Means and quantiles of blocks in releases, with 95 % intervals.

The interval of a quantile lies between two order statistics and makes no assumption about the
distribution: of n independent values, the number below the true quantile is binomial. Blocks of one
release are not independent, and events have different weights. Both are accounted for by an
effective number of values: the one at which the binomial variance of the share below the quantile
equals its variance between releases (Woodruff 1952; Korn and Graubard 1998). For single blocks of
one event it is the number of blocks, and the interval is exact.

Sources: David and Nagaraja, Order Statistics, 3rd ed., Wiley 2003, section 7.1; Woodruff,
Confidence intervals for medians and other position measures, Journal of the American Statistical
Association 47 (1952) 635-646; Korn and Graubard, Confidence intervals for proportions with small
expected number of positive counts estimated from survey data, Survey Methodology 24 (1998) 193-201.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr, bdtrik

from rigdda.envs import intervals
from rigdda.envs.intervals import CONFIDENCE, Mean

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WEIGHT_ROUNDING = 1e-12
"""Error of sums of weights, relative to their total [-]."""

TAIL = 0.5 * (1.0 - CONFIDENCE)
"""Probability that a quantile is beyond one end of its interval."""


class Quantile(NamedTuple):
    """A quantile and its 95 % interval; an end is NaN where there are too few values for it."""

    value: float
    low: float
    high: float


class BlockSample(NamedTuple):
    """Values of blocks in releases of one or several events.

    Parameters
    ----------
    values : (n,) array
        A value of each block.
    release : (n,) array of int
        Index of the release of each block.
    event : (R,) array of int
        Index of the event of each release, including releases without a block.
    rate : (E,) array
        How often each event happens [1/year], in any unit of length.
    size : (n,) array, optional
        Size of each block, such as its mass. Blocks count in proportion to it; by default all count
        the same.
    """

    values: Floats
    release: Ints
    event: Ints
    rate: Floats
    size: Floats | None = None

    @property
    def weight(self) -> Floats:
        """Weight of each block, (n,).

        It is the rate of its event over the number of releases of the event, times its size.
        """
        counts = np.bincount(self.event, minlength=len(self.rate))
        each = self.rate / np.maximum(counts, 1)
        weight = each[self.event][self.release]
        return weight if self.size is None else weight * self.size

    def variance(self, residuals: Floats) -> float:
        """Return the variance of a weighted mean with these residuals, between releases.

        Parameters
        ----------
        residuals : (n,) array
            Value of each block minus the mean.
        """
        weight = self.weight
        share = np.bincount(self.release, weight * residuals, len(self.event)) / weight.sum()
        out = 0.0
        for event in np.unique(self.event):
            own = share[self.event == event]
            if len(own) > 1:
                out += len(own) * float(own.var(ddof=1))
        return out


def mean(sample: BlockSample) -> Mean:
    """Return the mean with Student's interval; NaN where there are too few values."""
    if not len(sample.values):
        return Mean(math.nan, math.nan, math.nan)
    value = float(np.average(sample.values, weights=sample.weight))
    releases = len(np.unique(sample.release))
    if releases < 2:
        return Mean(value, math.nan, math.nan)
    half = intervals.quantile(releases - 1) * math.sqrt(sample.variance(sample.values - value))
    return Mean(value, value - half, value + half)


def quantiles(sample: BlockSample, levels: ArrayLike) -> list[Quantile]:
    """Return quantiles with their intervals.

    A quantile is the smallest value that at least this share of the weight does not exceed.

    Parameters
    ----------
    levels : (Q,) array
        Shares between 0 and 1.
    """
    wanted = np.asarray(levels, dtype=np.float64).tolist()
    if not len(sample.values):
        return [Quantile(math.nan, math.nan, math.nan) for _ in wanted]
    order = np.argsort(sample.values, kind="stable")
    values, share = sample.values[order], np.cumsum(sample.weight[order])
    share /= share[-1]

    def at(level: float) -> float:
        return float(
            values[min(int(np.searchsorted(share, level - WEIGHT_ROUNDING)), len(values) - 1)]
        )

    out = []
    for level in wanted:
        low, high = _ranks(_effective(sample, at(level), level), level)
        ends = (at(end) if 0.0 < end < 1.0 else math.nan for end in (low, high))
        out.append(Quantile(at(level), *ends))
    return out


def _effective(sample: BlockSample, value: float, level: float) -> int:
    """Return the number of independent values that determine a quantile as well as the sample."""
    n, releases = len(sample.values), len(np.unique(sample.release))
    weight = sample.weight
    if releases == n and np.ptp(weight) == 0.0:
        return n
    below = (sample.values <= value).astype(np.float64)
    share = float(np.average(below, weights=weight))
    variance = sample.variance(below - share)
    if variance == 0.0:
        return releases
    return max(1, min(n, math.floor(level * (1.0 - level) / variance)))


def _ranks(n: int, level: float) -> tuple[float, float]:
    """Return the shares at which the two order statistics lie, outside 0 to 1 if there is none."""
    low, high = binomial_quantile(TAIL, n, level), binomial_quantile(1.0 - TAIL, n, level) + 1
    return (low - 0.5) / n, (high - 0.5) / n


def binomial_quantile(tail: float, n: int, p: float) -> int:
    """Return the least number of successes with at least a probability of `tail` up to it.

    It equals `scipy.stats.binom.ppf` for 0 < tail < 1. The import of scipy.stats takes as long as a
    small evaluation.
    """
    found = bdtrik(tail, n, p)
    if math.isnan(found):  # no success is possible
        return 0
    count = math.ceil(found)
    return count - 1 if count > 0 and bdtr(count - 1, n, p) >= tail else count
