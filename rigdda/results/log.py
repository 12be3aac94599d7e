"""The events of a run, put together by what they happened to."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from rigdda.dynamics.monitors import CROSSING, FAILED, HIT


class Log(NamedTuple):
    """The events of a run: what happened to each barrier, and when blocks first passed stations."""

    hits: list[list[tuple[float, float]]]  # energy [J] and height [m] of each hit of a barrier
    failed: list[float]  # when each barrier failed, inf if it did not [s]
    passed: dict[float, list[float]]  # by station: when each block passed it, inf if it did not [s]


def log_of(
    events: Iterable[tuple[Any, ...]], barriers: int, blocks: int, lines: Sequence[float]
) -> Log:
    """Return what happened in a run of so many barriers and blocks that watched some stations.

    Parameters
    ----------
    events : iterable of tuple
        Events in order of time, each with the fields of `rigdda.dynamics.run.EVENT`.
    barriers, blocks : int
        Their numbers.
    lines : sequence of float
        The stations, ascending [m].
    """
    log = Log(
        [[] for _ in range(barriers)],
        [math.inf] * barriers,
        {line: [math.inf] * blocks for line in lines},
    )
    for time, kind, block, target, _, _, height, _, energy in events:
        if kind == HIT:
            log.hits[target].append((energy, height))
        elif kind == CROSSING:
            log.passed[lines[target]][block] = time
        elif kind == FAILED:
            log.failed[target] = min(log.failed[target], time)
    return log
