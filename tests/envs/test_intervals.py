"""Intervals hold the true value as often as they say, rare outcomes included."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from rigdda.envs import Targets, intervals
from rigdda.envs import cost as costs
from rigdda.envs.cost import Account, Facts
from rigdda.envs.intervals import (
    Estimate,
    Known,
    Mean,
    estimate,
    mean_cost,
    mid_p,
    pair,
    student_interval,
    total,
)
from rigdda.envs.problem import MET, MISSED, UNDECIDED


def test_none_of_n_has_three_over_n_as_its_upper_end() -> None:
    for n in (30, 300, 3000):
        low, high = mid_p(0, n)
        assert low == 0.0
        assert high == pytest.approx(3.0 / n, rel=0.06)
        assert mid_p(n, n) == pytest.approx((1.0 - high, 1.0))


@pytest.mark.parametrize(("count", "releases"), [(1, 4), (3, 100), (50, 100), (299, 300)])
def test_mid_p_leaves_two_and_a_half_percent_at_each_end(count: int, releases: int) -> None:
    low, high = mid_p(count, releases)
    half = 0.5 * stats.binom.pmf(count, releases, [low, high])
    assert stats.binom.sf(count, releases, low) + half[0] == pytest.approx(0.025, rel=1e-6)
    assert stats.binom.cdf(count - 1, releases, high) + half[1] == pytest.approx(0.025, rel=1e-6)


def test_one_sided_bounds_are_clopper_and_pearson_s() -> None:
    for count, releases in ((0, 59), (2, 60), (60, 60)):
        seen = estimate(count, releases)
        exact = stats.binomtest(count, releases, alternative="less").proportion_ci(0.95)
        assert seen.bound == pytest.approx(exact.high)
        exact = stats.binomtest(count, releases, alternative="greater").proportion_ci(0.95)
        assert seen.floor == pytest.approx(exact.low)
        assert seen.count == count
    assert estimate(0, 59).bound < 0.05 < estimate(0, 58).bound


@pytest.mark.parametrize("events", [("a",), ("a", "b")])
@pytest.mark.parametrize("releases", [1, 30, 59])
def test_a_sound_layout_misses_a_target_in_5_percent_for_each_event(
    events: tuple[str, ...], releases: int
) -> None:
    """Counted over all that may be seen by a layout that meets its target exactly."""
    counts = range(releases + 1)
    seen = [estimate(k, releases) for k in counts]
    shares = []
    for p in (0.01, 0.02, 0.05, 0.2):
        chances = stats.binom.pmf(counts, releases, p)
        shares.append(
            sum(
                math.prod(chances[k] for k in drawn)
                for drawn in itertools.product(counts, repeat=len(events))
                if decide_all(events, [seen[k] for k in drawn], p) == MISSED
            )
        )
    assert 0.0 < max(shares) <= 0.05 * len(events)
    assert len(events) == 1 or releases < 30 or max(shares) > 0.05


def decide_all(events: tuple[str, ...], seen: list[Estimate], target: float) -> str | None:
    """Return whether the probabilities of all events are at most a target."""
    return Targets(reach=target).state(events, dict(zip(events, seen, strict=True)), {}, None)


def test_without_releases_nothing_is_known() -> None:
    none = estimate(0, 0)
    assert math.isnan(none.probability)
    assert (none.low, none.high, none.count, none.bound, none.floor) == (0.0, 1.0, 0, 1.0, 0.0)


@pytest.mark.parametrize("p", [0.005, 0.05, 0.5])
@pytest.mark.parametrize("releases", [200, 300, 400])
def test_probabilities_are_held_in_90_to_99_percent(p: float, releases: int) -> None:
    """Counted over all that may be seen, not drawn."""
    counts = np.arange(releases + 1)
    held = [low <= p <= high for low, high in (mid_p(int(k), releases) for k in counts)]
    share = stats.binom.pmf(counts, releases, p) @ np.array(held)
    assert 0.90 <= share <= 0.995


def test_students_interval_covers_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    samples = rng.normal(3.0, 2.0, (4000, 6))
    covered = [low <= 3.0 <= high for low, high in map(student_interval, samples)]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.012)
    assert student_interval([1.0]) == (-math.inf, math.inf)


def test_a_cost_that_was_not_seen_is_borrowed() -> None:
    none = mean_cost(np.zeros(300), np.zeros(300, bool), Known(1e4, 0.3))
    assert (none.value, none.low) == (0.0, 0.0)
    assert none.high == pytest.approx(1e4 * mid_p(0, 300)[1])
    one = mean_cost([8e3, *[0.0] * 299], [True, *[False] * 299], Known(1e4, 0.3))
    assert one.value == pytest.approx(8e3 / 300)
    assert 0.0 <= one.low < one.value < one.high
    assert mean_cost([], []).interval == (0.0, math.inf)


def test_one_release_alone_is_uncertain_by_itself() -> None:
    found = mean_cost([500.0], [True])
    assert found.low < 250.0
    assert found.high >= 1000.0


def test_sums_by_the_distances_of_the_ends() -> None:
    one, two = Mean(10.0, 7.0, 14.0), Mean(5.0, 1.0, 8.0)
    assert total([one, two]) == pytest.approx((15.0, 10.0, 20.0))
    assert pair(one, two, 0.0) == pytest.approx((15.0, 10.0, 20.0))
    assert pair(one, two, 1.0) == pytest.approx((15.0, 8.0, 22.0))
    assert one.times(2.0) == (20.0, 14.0, 28.0)


def test_differences_by_the_distances_of_the_ends() -> None:
    one, other = Mean(5.0, 2.0, 9.0), Mean(1.0, -3.0, 13.0)
    found = one.minus(other)
    assert found.value == 4.0
    assert found.low == pytest.approx(4.0 - math.hypot(3.0, 12.0))
    assert found.high == pytest.approx(4.0 + math.hypot(4.0, 4.0))
    back = other.minus(one)
    assert (back.value, back.low, back.high) == (-found.value, -found.high, -found.low)
    assert one.minus(Mean(0.0, 0.0, 0.0)) == one


CASES = {
    "common": (0.5, 8.0, 0.4, 0.3, 0.1),
    "one in twenty": (0.05, 8.0, 0.5, 0.2, 0.05),
    "rare": (0.005, 9.0, 0.4, 0.2, 0.02),
    "always": (1.0, 30.0, 0.5, 0.5, 1.0),
}
"""P(reach), mean harm then, its coefficient of variation, P(failure) then, emptying."""


@pytest.mark.parametrize("names", [tuple(CASES), ("one in twenty",), ("common", "rare")])
def test_costs_are_held_in_90_to_99_percent(names: tuple[str, ...]) -> None:
    rng, releases, repeats = np.random.default_rng(7), 100, 1500
    mend, true = 15.0, 0.0
    for p, mean, _, fails, emptying in (CASES[name] for name in names):
        true += p * mean + emptying + p * fails * mend
    held = 0
    for _ in range(repeats):
        parts = []
        for p, mean, variation, fails, emptying in (CASES[name] for name in names):
            reached = rng.random(releases) < p
            spread = math.sqrt(math.log1p(variation**2))
            factor = np.exp(spread * rng.standard_normal(releases) - 0.5 * spread**2)
            failed = reached & (rng.random(releases) < fails)
            repair = 2.0 * emptying * rng.random(releases) + mend * failed
            harm = mean_cost(mean * factor * reached, reached, Known(1.2 * mean, variation))
            both = pair(harm, mean_cost(repair, failed, Known(mend, 0.2)), 0.5)
            parts.append(both)
        found = total(parts)
        held += found.low <= true <= found.high
    assert 0.92 <= held / repeats <= 0.99


def test_quantiles_are_student_s() -> None:
    assert intervals.quantile(7) == pytest.approx(stats.t.ppf(0.975, 7))


def test_harm_without_a_block_on_the_road_is_rare_harm() -> None:
    """A wall that slides onto the road: seen in none of 16, it may still come."""
    known = Facts(100, 50, Known(1000.0, 0.1), Known(1.0, 0.1), 1.0, 1.0)
    harm = np.array([900.0] + [0.0] * 15)
    none, failed = np.zeros(16, dtype=bool), np.eye(1, 16, dtype=bool)[0]
    own = Account(np.full(16, "block"), harm, np.zeros(16), np.zeros(16), none, failed)
    mean = costs._means(own, known, 0.0)[0]
    assert mean.interval == mean_cost(harm, harm > 0.0, known.harm).interval
    assert mean.high > 3.0 * mean.value


def test_a_target_of_failure_is_met_if_no_barrier_can_fail() -> None:
    few = {"block": estimate(0, 5)}
    assert Targets(failure=0.1).state(["block"], few, few, None) == UNDECIDED
    assert Targets(failure=0.1).state(["block"], few, {}, None) == MET
    assert Targets(reach=0.1, failure=0.1).state(["block"], few, {}, None) == UNDECIDED
    assert Targets().state(["block"], few, {}, None) is None
    assert Targets(failure=0.1).excess(few.values(), (), None) == 0.0


def test_a_target_of_the_individual_risk_is_never_ignored() -> None:
    with pytest.raises(AssertionError, match="traffic"):
        Targets(individual=1e-6).state([], {}, {}, None)
