"""What an exam says of designers: means over sites, and intervals of two kinds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.exam import Score, ahead
from envs import DesignProblem
from envs.evaluation import student_interval

SITES, RELEASES = 5, 8


@pytest.fixture(scope="module")
def scores() -> list[Score]:
    """Two designers on five sites: the second is ahead by 0.1 and something of site and release."""
    problem = DesignProblem("quick")
    nothing = problem.evaluate((), range(RELEASES))
    draw = np.random.default_rng(0).uniform
    by_site, by_release = draw(-0.05, 0.05, SITES), draw(-0.02, 0.02, RELEASES)
    found = []
    for k in range(SITES):
        for name, more in (("rule", np.zeros(RELEASES)), ("policy", by_site[k] + by_release + 0.1)):
            outcomes = tuple(
                replace(outcome, debris_fraction=0.5 - share)
                for outcome, share in zip(nothing.outcomes, more.tolist(), strict=True)
            )
            built = problem.judge((), nothing.seeds, outcomes)
            found.append(Score(f"site {k}", name, 1, nothing, built))
    return found


def test_over_sites_and_over_releases(scores: list[Score]) -> None:
    """Sites that differ do not widen what is said of these very sites."""
    debris = np.array([[o.debris_fraction for o in s.built.outcomes] for s in scores])
    apart = debris[::2] - debris[1::2]
    mean, any_site, these = ahead(scores, "policy", "rule")
    assert mean == pytest.approx(apart.mean())
    assert any_site == pytest.approx(student_interval(apart.mean(axis=1)))
    assert these == pytest.approx(student_interval(apart.mean(axis=0)))
    assert these[1] - these[0] < any_site[1] - any_site[0]


def test_none_is_ahead_of_itself(scores: list[Score]) -> None:
    assert ahead(scores, "rule", "rule") == (0.0, (0.0, 0.0), (0.0, 0.0))
