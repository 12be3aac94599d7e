"""A hard case, the record of its run, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Scene, Simulation

Floats = NDArray[np.float64]

HOLDS, DEGRADES, REFUSES, FAILS = "holds", "degrades", "refuses", "fails"
"""Verdicts. holds: all criteria are met. degrades: the run ends and no block is lost, but a
criterion is missed. refuses: the run stops with an error that says what to change. fails: NaN, a
lost block, no end within the time limit, or another error."""


@dataclass(frozen=True)
class History:
    """Frames of a run.

    `times` (T,) [s], `poses` and `velocities` (T, N, 3) [m, rad; m/s, rad/s]; `energy` (T,) is the
    kinetic, potential and elastic energy less the work of loads and shaking [J]; `sim` is the
    simulation at the end.
    """

    scene: Scene
    times: Floats
    poses: Floats
    velocities: Floats
    energy: Floats
    sim: Simulation

    @property
    def moved(self) -> float:
        """Greatest displacement of a centroid from its start in any frame [m]."""
        way = self.poses[:, :, :2] - self.poses[0, :, :2]
        return float(np.hypot(way[..., 0], way[..., 1]).max())

    @property
    def speed(self) -> float:
        """Greatest speed of a centroid at the end [m/s]."""
        return float(np.hypot(*self.velocities[-1, :, :2].T).max())


@dataclass(frozen=True)
class Case:
    """One hard case.

    Parameters
    ----------
    name : str
        Its name.
    criterion : str
        Basis of the error, a closed form or an invariant, with its unit.
    scene : callable
        Returns the scene.
    duration : float
        Simulated time, a multiple of the longest step, 0.1 [s].
    error : callable
        Returns the error of a run, 0 if it is exact.
    bar : float
        Tolerance of the error.
    depth : float
        Tolerance of the penetration in any frame, over the mean block size [-].
    gain : float
        Tolerance of the energy growth, over the weight of all blocks times their mean size plus
        all dissipated energy [-]. Initial overlaps are pushed out, which lifts blocks.
    frame : float
        Interval of the frames, if it is longer than the step [s].
    settled : float
        Time from which penetration counts [s].
    settings : mapping
        Settings in addition to the step.
    refused : bool
        Whether the case has no answer and must be refused at any step.
    """

    name: str
    criterion: str
    scene: Callable[[], Scene]
    duration: float
    error: Callable[[History], float]
    bar: float
    depth: float = 0.01
    gain: float = 5e-3
    frame: float = 0.1
    settled: float = 0.0
    settings: Mapping[str, Any] = field(default_factory=dict)
    refused: bool = False


@dataclass(frozen=True)
class Result:
    """Result of a case at a step.

    Error and tolerance are in the unit of the criterion; penetration is over the mean block size,
    and energy growth is defined as in `Case` [-]; processor time is per simulated second [ms/s].
    """

    case: str
    dt: float
    verdict: str
    error: float = math.nan
    bar: float = math.nan
    penetration: float = math.nan
    gain: float = math.nan
    cpu_ms_per_s: float = math.nan
    note: str = ""


def judge(case: Case, error: float, penetration: float, gain: float, lost: int) -> tuple[str, str]:
    """Return the verdict on a completed run, and the criteria that it missed."""
    if lost:
        return FAILS, f"{lost} blocks lost"
    misses = [
        f"{what} {value:.2g}, bar {bar:.2g}"
        for what, value, bar in (
            ("error", error, case.bar),
            ("penetration", penetration, case.depth),
            ("gain of energy", gain, case.gain),
        )
        if not value <= bar
    ]
    return (DEGRADES if misses else HOLDS), "; ".join(misses)
