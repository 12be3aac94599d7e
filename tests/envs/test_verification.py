"""Small verifications on simulated releases hold what very many give."""

from __future__ import annotations

from collections import defaultdict

import cases
import numpy as np
import pytest

from rigdda import Fence, Layout
from rigdda.envs.comparison import difference_of_accounts
from rigdda.envs.cost import Account, Facts
from rigdda.envs.intervals import Known
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


def test_intervals_of_differences_hold_where_signs_change() -> None:
    """Each release costs more with one of two layouts, as often with the first as the second."""
    site = cases.cut()
    one, two = ((Fence(x, 2.0, energy_class=250),) for x in (12.0, 13.0))
    true = site.annual(one) - site.annual(two)
    names = site.event_names
    event = np.repeat(names, 50)
    none = np.zeros(len(event), dtype=bool)
    facts = {name: Facts(1, 1, Known(1.0, 1.0), Known(1.0, 1.0), 1.0, 1.0) for name in names}
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(1000):
        harm = rng.exponential(1000.0, len(event)) * np.sign(rng.random(len(event)) - 0.5)
        sides = [
            Account(event, np.maximum(s * harm, 0.0), 0.0 * harm, 0.0 * harm, none, none)
            for s in (1.0, -1.0)
        ]
        found = difference_of_accounts(site, (one, two), (sides[0], sides[1]), facts)
        held += found.ci[0] <= true <= found.ci[1]
    assert 930 <= held <= 985
