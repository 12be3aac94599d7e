"""Which of two layouts is better: by Z, and behind all others if a target is missed."""

from __future__ import annotations

from collections.abc import Sequence

from rigdda.envs import DesignProblem, Evaluation

MISSED = 1e6
"""What ranks layouts that miss a target behind all others [EUR per m and year]."""


def score(problem: DesignProblem, evaluation: Evaluation) -> tuple[float, float]:
    """Return what layouts are ranked by: how far a target is missed, then the objective.

    A target is missed by what the upper bound of its probability exceeds it; one that is met, or of
    which the releases do not tell, by nothing.
    """
    if evaluation.targets != "missed":
        return 0.0, evaluation.objective
    return shortfall(problem, evaluation), evaluation.objective


def final_score(problem: DesignProblem, evaluation: Evaluation) -> tuple[float, float]:
    """Return the same for finals, where what is undecided is not taken for met."""
    return shortfall(problem, evaluation), evaluation.objective


def shortfall(problem: DesignProblem, evaluation: Evaluation) -> float:
    """Return the most by which an upper bound of a design event exceeds its target [-]."""
    design = [event.name for event in problem.site.events if event.design]
    over = [0.0]
    for wanted, found in (
        (problem.targets.reach, evaluation.reach),
        (problem.targets.failure, evaluation.failure),
    ):
        if wanted is not None:
            over += [found[name].bound - wanted for name in design]
    return max(over)


def value(problem: DesignProblem, evaluation: Evaluation) -> float:
    """Return one number for searches that rank by one: those that miss a target come last."""
    missed, objective = score(problem, evaluation)
    if missed <= 0.0:
        return objective
    return max(objective, abs(problem.nothing.objective)) + MISSED * (1.0 + missed)


def ranked(problem: DesignProblem, evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the evaluations of different layouts, the best first."""
    order = sorted(evaluations, key=lambda e: score(problem, e))
    return list({e.layout: e for e in reversed(order)}.values())[::-1]
