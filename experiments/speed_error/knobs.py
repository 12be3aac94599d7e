"""Settings that are varied, one at a time from the defaults."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from rigdda import Settings
from rigdda.dynamics.constants import PENETRATION_RATIO

DEFAULT = Settings()

STEPS = (2e-2, 1e-2, 5e-3, 2.5e-3)
"""Steps [s]; the longest one is the frame interval of a rockfall."""

COMPRESSIONS = (1e-2, 1e-3, 1e-4, 1e-5)
"""Compressions of contacts under their load over the mean block size [-], `Settings.penetration`.
The stiffness is the load over the compression."""

TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-10)
"""Tolerances of conjugate gradients, `Settings.tolerance` [-]."""

SWEEP_TOLERANCES = (1.0, 0.02, 0.005, 1e-3, 1e-4)
"""Tolerances of relaxation, `Settings.sweep_tolerance`, per block [m/s]."""

OPEN_CLOSE = (1, 3, 12, 50)
"""Maximum numbers of open-close iterations per step."""

STEP, STIFFNESS, TOLERANCE, ITERATIONS = "step", "compression", "tolerance", "open-close"
SWEEPS = "sweep tolerance"


@dataclass(frozen=True)
class Choice:
    """Settings that differ from the defaults in one knob: its name, value and settings."""

    knob: str
    value: float
    settings: dict[str, Any]
    default: bool = False


def choices(size: float, steps: Sequence[float] = STEPS) -> Iterator[Choice]:
    """Yield all choices for a scene with a mean block size [m], the default once."""
    yield Choice(STEP, DEFAULT.dt, {"dt": DEFAULT.dt}, default=True)
    for dt in steps:
        if dt != DEFAULT.dt:
            yield Choice(STEP, dt, {"dt": dt})
    for ratio in COMPRESSIONS:
        if ratio != PENETRATION_RATIO:
            yield Choice(STIFFNESS, ratio, {"penetration": ratio * size})
    for tolerance in TOLERANCES:
        if tolerance != DEFAULT.tolerance:
            yield Choice(TOLERANCE, tolerance, {"tolerance": tolerance})
    for change in SWEEP_TOLERANCES:
        if change != DEFAULT.sweep_tolerance:
            yield Choice(SWEEPS, change, {"sweep_tolerance": change})
    for most in OPEN_CLOSE:
        if most != DEFAULT.open_close_iterations:
            yield Choice(ITERATIONS, most, {"open_close_iterations": most})
