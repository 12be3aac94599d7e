"""Small verifications on simulated releases hold what very many give."""

from __future__ import annotations

from collections import defaultdict

import pytest

from rigdda import Fence, Layout
from rigdda.envs.problem import DesignProblem

TRUE, SMALL, REPEATS = 20_000, 300, 100


def verify(
    problem: DesignProblem, layout: Layout, true: int = TRUE, small: int = SMALL
) -> dict[str, int]:
    """Return how many of the intervals hold the value of very many releases, for Z and reach."""
    counts = problem.allocation(true)
    known = problem.judge(layout, problem.sample(layout, {k: range(n) for k, n in counts.items()}))
    each = problem.allocation(small)
    seeds = {k: range(10**6, 10**6 + REPEATS * n) for k, n in each.items()}
    sample = problem.sample(layout, seeds)
    pool = {name: iter([o for o in sample if o.event == name]) for name in each}
    held: dict[str, int] = defaultdict(int)
    for _ in range(REPEATS):
        found = problem.judge(layout, [next(pool[k]) for k, n in each.items() for _ in range(n)])
        held["Z"] += found.ci[0] <= known.objective <= found.ci[1]
        for name, seen in found.reach.items():
            held[name] += seen.low <= known.reach[name].probability <= seen.high
    return dict(held)


@pytest.mark.slow
def test_90_to_99_of_100_small_verifications_hold_the_true_cost() -> None:
    held = verify(DesignProblem("narrow"), (Fence(10.29, 3.0, energy_class=250),))
    assert 90 <= held["Z"] <= 99
    assert all(count >= 88 for count in held.values())
