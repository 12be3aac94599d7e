"""Measured rows, and the fronts and comparisons at equal error that follow from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from experiments.bench.cases import Case
from experiments.front import front

CORE = "rigdda"


@dataclass(frozen=True)
class Row:
    """One engine with one setting on one case.

    The error and the greatest error in any frame (not a number if it is not recorded) are in the
    unit of the case. The processor time of the steps per simulated second [us/s] is given as
    median, minimum and maximum of the runs.
    """

    case: str
    engine: str
    dt: float
    options: str
    error: float
    greatest: float
    cpu_us_per_simulated_s: float
    cpu_min: float
    cpu_max: float
    runs: int

    @property
    def label(self) -> str:
        """Engine, step and options."""
        return f"{self.engine} 1/{1.0 / self.dt:.0f} s {self.options}".rstrip()


@dataclass(frozen=True)
class Level:
    """Comparison of this core with the cheapest peer at one error.

    Processor times are per simulated second [us/s], infinite if the error is not reached. The ratio
    requires both. If no peer reaches the error, the targets are met if this core does.
    """

    case: str
    error: float
    peer: str
    peer_cpu: float
    core: str
    core_cpu: float
    ratio: float
    must: bool
    aim: bool


def on_front(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that no other row beats in both error and time, cheapest first."""
    return front(rows, lambda r: (r.cpu_us_per_simulated_s, r.error))


def cheapest(rows: Iterable[Row], error: float) -> Row | None:
    """Return the cheapest row with at most this error."""
    good = (r for r in rows if r.error <= error)
    return min(good, key=lambda r: r.cpu_us_per_simulated_s, default=None)


def level(case: Case, error: float, rows: Sequence[Row]) -> Level:
    """Compare the engines at one error of a case."""
    here = [r for r in rows if r.case == case.name]
    core = cheapest((r for r in here if r.engine == CORE), error)
    peer = cheapest((r for r in here if r.engine != CORE), error)
    core_cpu, peer_cpu = (math.inf if r is None else r.cpu_us_per_simulated_s for r in (core, peer))
    ratio = core_cpu / peer_cpu if core and peer else math.nan
    alone = core is not None and peer is None
    return Level(
        case.name,
        error,
        peer.label if peer else "-",
        peer_cpu,
        core.label if core else "-",
        core_cpu,
        ratio,
        alone or ratio <= case.must,
        alone or ratio <= case.aim,
    )


def levels(cases: Iterable[Case], rows: Sequence[Row]) -> list[Level]:
    """Compare the engines at every level of every case."""
    return [level(case, error, rows) for case in cases for error in case.levels]
