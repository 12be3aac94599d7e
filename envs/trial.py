"""Trials: what environments ask to be simulated, all of a batch at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from envs.baseline import outcomes
from envs.crew import Workers
from envs.envelope import SEEDS, Envelope, barrier_free, standing
from envs.evaluation import Evaluation
from envs.problem import DesignProblem
from rigdda import Layout


class Ask(NamedTuple):
    """A layout to evaluate on the releases of `seeds`, and to look at on others if it `looks`."""

    problem: DesignProblem
    layout: Layout
    seeds: tuple[int, ...]
    looks: bool


class Answer(NamedTuple):
    """What an ask gave.

    `envelope`: what passes the layout in at most 4 releases, as many as were asked for, that are
    not the scored ones; without a layout in all 4; None if it was not to be looked at.
    """

    evaluation: Evaluation
    envelope: Envelope | None


def simulate(asks: Sequence[Ask | None], workers: Workers | None = None) -> list[Answer | None]:
    """Simulate every ask, their releases together in threads over all cores, or in `workers`.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    real = [ask for ask in asks if ask is not None]
    jobs = [(ask.problem.site, ask.layout, seed) for ask in real for seed in ask.seeds]
    found, looked = iter(outcomes(jobs, workers)), iter(_envelopes(real, workers))
    answers: list[Answer | None] = []
    for ask in asks:
        if ask is None:
            answers.append(None)
            continue
        own = tuple(next(found) for _ in ask.seeds)
        judged = ask.problem.judge(ask.layout, ask.seeds, own)
        answers.append(Answer(judged, next(looked) if ask.looks else None))
    return answers


def _envelopes(asks: Sequence[Ask], workers: Workers | None) -> list[Envelope]:
    """Return the envelope of every ask that looks, in order."""
    asks = [ask for ask in asks if ask.looks]
    free = iter(barrier_free([ask.problem.site for ask in asks if not ask.layout], workers))
    cases = [(a.problem.site, a.layout, SEEDS[: len(a.seeds)]) for a in asks if a.layout]
    with_barriers = iter(standing(cases, workers))
    return [next(with_barriers if ask.layout else free) for ask in asks]
