"""95 % confidence intervals of probabilities, mean costs and sums, valid for rare events, too.

A release costs little unless a block reaches the road or a barrier fails. The mean cost of an event
is therefore split into the probability of such a costly release, which has a useful interval even
if none of n was costly, and the mean costs of costly and cheap releases. The intervals of the parts
are combined by the method of Zou and Donner (MOVER), which adds the squared distances between
estimates and limits.

Sources: Zou and Donner, Construction of confidence limits about effect measures: a general
approach, Statistics in Medicine 27 (2008) 1693-1702; Berry and Armitage, Mid-P confidence
intervals: a brief review, The Statistician 44 (1995) 417-423; Clopper and Pearson, Biometrika 26
(1934) 404-413.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import betainc, betaincinv, stdtrit

Interval = tuple[float, float]

CONFIDENCE = 0.95
"""Confidence level of all intervals and one-sided bounds."""

BORROWED = 3
"""Weight of a prior spread relative to that of the sample, in releases. Two or three releases that
reach the road are too few to estimate a spread."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Probability of an occurrence, estimated from releases.

    Parameters
    ----------
    probability, low, high : float
        Share of the releases in which it occurred, and its 95 % interval; without releases nan and
        (0, 1).
    releases : int
        Number of releases.
    """

    probability: float
    low: float
    high: float
    releases: int

    @property
    def count(self) -> int:
        """Number of releases in which it occurred."""
        return round(self.probability * self.releases) if self.releases else 0

    @property
    def bound(self) -> float:
        """One-sided 95 % upper bound (Clopper and Pearson)."""
        return upper_bound(self.count, self.releases)

    @property
    def floor(self) -> float:
        """One-sided 95 % lower bound (Clopper and Pearson)."""
        return lower_bound(self.count, self.releases)


class Known(NamedTuple):
    """Prior knowledge of the cost of a costly release.

    The mean is used if the sample has no costly release; `variation` is the coefficient of
    variation [-].
    """

    mean: float
    variation: float

    @classmethod
    def of(cls, values: ArrayLike) -> Known:
        """Return the statistics of a non-empty sample of costs; the variation is 0 if all are 0."""
        sample = np.asarray(values, dtype=np.float64)
        mean = float(sample.mean())
        return cls(mean, float(sample.std() / mean) if mean > 0.0 else 0.0)

    def sample(self, count: int, releases: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return costs of releases with these statistics, and which of them are costly.

        Of `releases`, `count` are costly; the others cost 0.
        """
        costly = np.arange(releases) < count
        signs = np.resize([1.0, -1.0], count)
        signs[count - count % 2 :] = 0.0
        scale = math.sqrt(count / max(count - count % 2, 1))
        costs = np.zeros(releases)
        costs[:count] = self.mean * (1.0 + self.variation * scale * signs)
        return costs, costly


class Mean(NamedTuple):
    """A mean and its 95 % interval."""

    value: float
    low: float
    high: float

    def times(self, factor: float) -> Mean:
        """Return the mean multiplied by a factor >= 0."""
        return Mean(factor * self.value, factor * self.low, factor * self.high)

    def moved(self, by: float) -> Mean:
        """Return the mean shifted by `by`, with the interval extended to contain the new value."""
        value = self.value + by
        return Mean(value, min(self.low, value), max(self.high, value))

    def minus(self, other: Mean) -> Mean:
        """Return the difference from an independent mean.

        Its interval follows from the ends of both intervals (MOVER; Zou and Donner 2008, Statistics
        in Medicine 27).
        """
        value = self.value - other.value
        below = math.hypot(self.value - self.low, other.high - other.value)
        above = math.hypot(self.high - self.value, other.value - other.low)
        return Mean(value, value - below, value + above)

    @property
    def interval(self) -> Interval:
        """The 95 % interval."""
        return self.low, self.high


def estimate(count: int, releases: int) -> Estimate:
    """Return the estimated probability of what occurred in `count` of `releases`."""
    low, high = mid_p(count, releases)
    return Estimate(count / releases if releases else math.nan, low, high, releases)


@lru_cache(maxsize=1 << 16)
def mid_p(count: int, releases: int) -> Interval:
    """Return the mid-P interval of a probability; for 0 of n the upper limit is about 3/n.

    At each limit, the probability of more extreme counts plus half the probability of the observed
    count is 2.5 %.
    """
    if releases == 0:
        return 0.0, 1.0
    tail = 0.5 * (1.0 - CONFIDENCE)

    def beyond(p: float, least: int) -> float:
        """Return the probability of at least `least` occurrences."""
        if least <= 0:
            return 1.0
        return float(betainc(least, releases - least + 1, p)) if least <= releases else 0.0

    def above(p: float) -> float:
        return 0.5 * (beyond(p, count) + beyond(p, count + 1))

    low = brentq(lambda p: above(p) - tail, 0.0, 1.0) if count > 0 else 0.0
    high = brentq(lambda p: above(p) - (1.0 - tail), 0.0, 1.0) if count < releases else 1.0
    return low, high


def upper_bound(count: int, releases: int) -> float:
    """Return the one-sided 95 % upper bound of a probability (Clopper and Pearson)."""
    if count >= releases:
        return 1.0
    return float(betaincinv(count + 1, releases - count, CONFIDENCE))


def lower_bound(count: int, releases: int) -> float:
    """Return the one-sided 95 % lower bound of a probability (Clopper and Pearson)."""
    if count == 0:
        return 0.0
    return float(betaincinv(count, releases - count + 1, 1.0 - CONFIDENCE))


def student_interval(values: ArrayLike) -> Interval:
    """Return Student's 95 % interval of the mean of independent values.

    For fewer than two values it is infinite.
    """
    sample = np.asarray(values, dtype=np.float64)
    if len(sample) < 2:
        return -math.inf, math.inf
    mean, half = float(sample.mean()), _half(sample, None)
    return mean - half, mean + half


def mean_cost(values: ArrayLike, costly: ArrayLike, known: Known | None = None) -> Mean:
    """Return the mean of costs that are small unless a release is `costly`.

    mean = c + p (d - c), where c and d are the mean costs of the cheap and of the costly releases
    and p is the share of the latter. p has a mid-P interval, c and d have Student's intervals.

    Parameters
    ----------
    values : (n,) array
        Cost of each release, at least 0.
    costly : (n,) array of bool
        Whether the release did harm on the road or a barrier failed.
    known : Known, optional
        Prior knowledge of the cost of a costly release; its mean is used only if the sample has
        none.
    """
    sample, which = np.asarray(values, dtype=np.float64), np.asarray(costly, dtype=bool)
    if not len(sample):
        return Mean(math.nan, 0.0, math.inf)
    high, low = sample[which], sample[~which]
    share = len(high) / len(sample)
    least, most = mid_p(len(high), len(sample))
    rest = float(low.mean()) if len(low) else 0.0
    top = float(high.mean()) if len(high) else (known.mean if known else 0.0)
    jump = abs(top - rest)
    of_high, of_low = _half(high, known), _half(low, None)
    common = (share * of_high) ** 2 + ((1.0 - share) * of_low) ** 2
    value = float(sample.mean())
    below = math.sqrt((jump * (share - least)) ** 2 + common)
    above = math.sqrt((jump * (most - share)) ** 2 + common)
    return Mean(value, max(value - below, 0.0), value + above)


def _half(sample: NDArray[np.float64], known: Known | None) -> float:
    """Return half the width of Student's interval of a mean, including a prior spread if given.

    For a single value without a prior spread it is the absolute value itself.
    """
    n = len(sample)
    if n == 0:
        return 0.0
    mean, borrowed = float(sample.mean()), BORROWED if known else 0
    freedom = n - 1 + borrowed
    if freedom == 0:
        return abs(mean)
    squares = float(np.square(sample - mean).sum())
    if known:
        squares += borrowed * (known.variation * mean) ** 2
    return float(quantile(freedom)) * math.sqrt(squares / freedom / n)


def quantile(freedom: int) -> float:
    """Return the 97.5 % quantile of Student's t distribution."""
    return float(stdtrit(freedom, 0.5 * (1.0 + CONFIDENCE)))


def total(parts: Iterable[Mean]) -> Mean:
    """Return the sum of independent mean costs; interval limits combine by root sum of squares."""
    value = below = above = 0.0
    for part in parts:
        value += part.value
        below += (part.value - part.low) ** 2
        above += (part.high - part.value) ** 2
    return Mean(value, max(value - math.sqrt(below), 0.0), value + math.sqrt(above))


def pair(one: Mean, two: Mean, correlation: float) -> Mean:
    """Return the sum of two means over the same releases, given the correlation of their values."""

    def reach(a: float, b: float) -> float:
        return math.sqrt(max(a * a + b * b + 2.0 * correlation * a * b, 0.0))

    value = one.value + two.value
    below = reach(one.value - one.low, two.value - two.low)
    above = reach(one.high - one.value, two.high - two.value)
    return Mean(value, max(value - below, 0.0), value + above)
