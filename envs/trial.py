"""Trials: what environments ask to be simulated, all of a batch at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from rigdda import Layout, Outcome
from rigdda.envs import reuse
from rigdda.envs.crew import Workers
from rigdda.envs.envelope import FIRST, barrier_free
from rigdda.envs.evaluation import Evaluation
from rigdda.envs.problem import DesignProblem
from rigdda.envs.reuse import Sample


class Ask(NamedTuple):
    """A layout to evaluate on the releases of `seeds`, and to look at in `looks` of every event."""

    problem: DesignProblem
    layout: Layout
    seeds: tuple[int, ...]
    looks: int


class Answer(NamedTuple):
    """What an ask gave.

    `evaluation`: of the releases of the seeds, None without seeds. `looked`: outcomes of others,
    that are never scored, the same for all layouts of a site.
    """

    evaluation: Evaluation | None
    looked: Sample


def simulate(asks: Sequence[Ask | None], workers: Workers | None = None) -> list[Answer | None]:
    """Simulate every ask, their releases together over all cores, or in `workers`.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    jobs: list[reuse.Job] = []
    ends = [0]
    for ask in asks:
        if ask is not None:
            events = ask.problem.plan(ask.seeds) if ask.seeds else ()
            drawn = [*zip(ask.seeds, events, strict=True), *_looks(ask)]
            jobs += [(ask.problem.site, ask.layout, seed, event) for seed, event in drawn]
            ends += [len(jobs) - len(drawn) + len(ask.seeds), len(jobs)]
    parts = iter(reuse.outcomes(jobs, workers).split(ends))
    return [None if ask is None else _answer(ask, next(parts), next(parts)) for ask in asks]


def _looks(ask: Ask) -> list[tuple[int, str]]:
    """Return seed and event of the releases in which a layout is looked at."""
    seeds = range(FIRST, FIRST + ask.looks)
    return [(seed, name) for name in ask.problem.site.event_names for seed in seeds]


def _answer(ask: Ask, scored: Sample, looked: Sample) -> Answer:
    judged = ask.problem.judge(ask.layout, scored, ask.seeds) if ask.seeds else None
    return Answer(judged, looked)


def look_ahead(
    sights: Sequence[tuple[DesignProblem, int]], workers: Workers | None = None
) -> list[Sample]:
    """Look at the sites of new episodes, all together: at their envelopes, and in releases.

    Parameters
    ----------
    sights : sequence of (DesignProblem, int)
        Of each episode its problem, and the releases of every event to look at without barriers.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    barrier_free([problem.site for problem, _ in sights], workers)
    answers = simulate([Ask(problem, (), (), looks) for problem, looks in sights], workers)
    return [answer.looked for answer in answers if answer is not None]


def plain(outcomes: Sequence[Outcome]) -> tuple[dict[str, Any], ...]:
    """Return what outcomes say of the road and of the barriers, as plain numbers."""
    return tuple(
        {
            "event": outcome.event,
            "reached": outcome.reached,
            "road_volume": outcome.road_volume,
            "released_volume": outcome.released_volume,
            "debris_fraction": outcome.debris_fraction,
            "max_energy_on_road": outcome.max_energy_on_road,
            "failed": sum(barrier.failed for barrier in outcome.barriers),
        }
        for outcome in outcomes
    )
