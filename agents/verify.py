"""Verification: a layout on releases that no search draws."""

from __future__ import annotations

from rigdda import Layout
from rigdda.agents.seeds import release_seeds
from rigdda.agents.store import Store
from rigdda.envs import DesignProblem, Evaluation


def verify(
    problem: DesignProblem,
    layout: Layout,
    releases: int = 64,
    seed: int = 0,
    store: Store | None = None,
) -> Evaluation:
    """Return the evaluation of a layout on `releases` fresh releases.

    The seeds come from a stream of their own, so that the evaluation is unbiased whatever search
    found the layout. Layouts verified with the same `seed` meet the same releases.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    seeds = release_seeds("verification", seed, releases)
    return (store or Store()).evaluate(problem, layout, seeds)
