"""The events of a run, put together by what they happened to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from rigdda.dynamics.monitors import CROSSING, HIT
from rigdda.dynamics.run import Run


class Log(NamedTuple):
    """The events of a run: what happened to each barrier, and when blocks first passed stations."""

    hits: list[list[tuple[float, float]]]  # energy [J] and height [m] of each hit of a barrier
    passed: dict[float, list[float]]  # by station: when each block passed it, inf if it did not [s]


def log_of(run: Run, lines: Sequence[float]) -> Log:
    """Return the events of a run that watched some stations [m]."""
    barriers, blocks = len(run.scene.barriers), len(run.scene.blocks)
    log = Log(
        [[] for _ in range(barriers)],
        {line: [math.inf] * blocks for line in lines},
    )
    for time, kind, block, target, _, _, height, _, energy in run.events.tolist():
        if kind == HIT:
            log.hits[target].append((energy, height))
        elif kind == CROSSING:
            log.passed[lines[target]][block] = time
    return log
