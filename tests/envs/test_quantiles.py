"""Means and quantiles of blocks: order statistics, clusters and weights."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom

from rigdda.envs.quantiles import BlockSample, binomial_quantile, mean, quantiles

LEVELS = (0.5, 0.9, 0.95, 0.99)


def single(values: np.ndarray) -> BlockSample:
    """Return a sample of one event, one value a release."""
    n = len(values)
    return BlockSample(values, np.arange(n), np.zeros(n, dtype=int), np.ones(1))


@pytest.mark.parametrize("n", [1, 20, 59, 100, 373, 1000])
def test_single_blocks_have_the_exact_interval_of_order_statistics(n: int) -> None:
    values = np.random.default_rng(n).lognormal(size=n)
    ordered = np.sort(values)
    for level, found in zip(LEVELS, quantiles(single(values), LEVELS), strict=True):
        assert found.value == np.quantile(values, level, method="inverted_cdf")
        # the interval of ranks l to u holds the quantile if l <= Binomial(n, level) < u
        low = np.flatnonzero(ordered == found.low) + 1 if not math.isnan(found.low) else [0]
        high = np.flatnonzero(ordered == found.high) + 1 if not math.isnan(found.high) else [n + 1]
        l, u = int(low[0]), int(high[0])  # noqa: E741
        assert binom.cdf(l - 1, n, level) < 0.025 or l == 0
        assert binom.cdf(u - 1, n, level) >= 0.975
        assert l == 0 or binom.cdf(l, n, level) >= 0.025  # no narrower interval would do
        assert u == 1 or binom.cdf(u - 2, n, level) < 0.975


def test_an_end_is_missing_where_no_order_statistic_bounds_it() -> None:
    values = np.arange(1.0, 31.0)
    median, *_, extreme = quantiles(single(values), LEVELS)
    assert median.low < median.value < median.high
    assert math.isnan(extreme.high) and extreme.value == 30.0


def test_no_blocks_give_no_numbers() -> None:
    empty = BlockSample(np.zeros(0), np.zeros(0, dtype=int), np.zeros(5, dtype=int), np.ones(1))
    assert math.isnan(mean(empty).value)
    assert all(math.isnan(end) for end in quantiles(empty, [0.5])[0])


def test_the_mean_of_single_blocks_has_the_interval_of_student() -> None:
    from scipy.stats import t

    values = np.random.default_rng(0).normal(5.0, 2.0, size=40)
    found = mean(single(values))
    half = t.ppf(0.975, 39) * values.std(ddof=1) / math.sqrt(40)
    assert found.value == pytest.approx(values.mean())
    assert found.high - found.value == pytest.approx(half)


def test_rates_weigh_values() -> None:
    rng = np.random.default_rng(3)
    values = np.concatenate([rng.normal(1.0, 0.1, 90), rng.normal(9.0, 0.1, 10)])
    event = np.repeat([0, 1], [90, 10])
    sample = BlockSample(values, np.arange(100), event, np.array([0.5, 1.5]))
    weights = np.where(event == 0, 0.5 / 90, 1.5 / 10)
    expected = np.quantile(values, LEVELS, method="inverted_cdf", weights=weights)
    assert [q.value for q in quantiles(sample, LEVELS)] == expected.tolist()
    assert mean(sample).value == pytest.approx(np.average(values, weights=weights))


def covered(draw, level: float, truth: float, runs: int) -> float:
    """Return the share of the intervals that hold the truth."""
    found = [quantiles(draw(np.random.default_rng(seed)), [level])[0] for seed in range(runs)]
    held = [not x.low > truth and not x.high < truth for x in found]
    return float(np.mean(held))


def cluster(rng: np.random.Generator) -> BlockSample:
    """Return 80 releases of 10 blocks each that nearly all behave alike."""
    common = np.repeat(rng.normal(size=80), 10)
    values = common + 0.1 * rng.normal(size=800)
    return BlockSample(values, np.repeat(np.arange(80), 10), np.zeros(80, dtype=int), np.ones(1))


def test_blocks_of_a_release_count_as_one_where_they_are_alike() -> None:
    truth = 1.2815515655446004 * math.sqrt(1.01)
    assert covered(cluster, 0.9, truth, 400) > 0.92
    own = cluster(np.random.default_rng(0))
    apart = single(own.values)
    wide, narrow = (quantiles(s, [0.9])[0] for s in (own, apart))
    assert wide.high - wide.low > 1.5 * (narrow.high - narrow.low)


def test_intervals_of_single_blocks_hold_the_quantile() -> None:
    def draw(rng: np.random.Generator) -> BlockSample:
        return single(rng.exponential(size=300))

    assert 0.93 < covered(draw, 0.95, -math.log(0.05), 1000) < 0.99


@pytest.mark.parametrize("p", [0.0, 1e-300, 1.0, 0.001, 0.05, 0.5, 0.9, 0.95, 0.99])
@pytest.mark.parametrize("tail", [0.025, 0.975])
def test_quantiles_of_a_binomial_are_those_of_scipy(p: float, tail: float) -> None:
    for n in [*range(60), 100, 2000, 100_000]:
        assert binomial_quantile(tail, n, p) == binom.ppf(tail, n, p)
