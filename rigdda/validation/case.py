"""Cases of the validation suite, their results, and the observed order of convergence."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigdda.dynamics.simulation import Simulation
from rigdda.errors import Diverged
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings


class Lab:
    """Environment of a case: its step, its random numbers and a meter of its processor time.

    Parameters
    ----------
    dt : float
        Time step [s].
    seed : int
        Seed of the random shapes, velocities and offsets of a case.

    Attributes
    ----------
    cpu, simulated : float
        Processor time spent in steps, and the simulated time [s].
    """

    def __init__(self, dt: float, seed: int = 0):
        self.dt, self.seed = dt, seed
        self.cpu, self.simulated = 0.0, 0.0

    def simulate(self, scene: Scene, dt: float | None = None, **settings: Any) -> Metered:
        """Return a simulation of a scene, with the step of the lab or with `dt` [s]."""
        return Metered(self, scene, Settings(dt=dt or self.dt, **settings))

    def random(self, *which: int) -> np.random.Generator:
        """Return the random number generator of one of the experiments of a case."""
        return np.random.default_rng((self.seed, *which))

    def steps(self, duration: float) -> int:
        """Return the number of steps in `duration` [s]."""
        return round(duration / self.dt)


class Metered(Simulation):
    """A simulation that measures the processor time of its steps only."""

    def __init__(self, lab: Lab, scene: Scene, settings: Settings, **monitors: Any):
        super().__init__(scene, settings, **monitors)
        self._lab = lab

    def step(self, n: int = 1) -> None:
        """Take `n` steps and measure their processor time."""
        before = time.process_time()
        super().step(n)
        self._lab.cpu += time.process_time() - before
        self._lab.simulated += n * self.settings.dt


class Measured(NamedTuple):
    """One or several computed values, and the exact value of each."""

    computed: ArrayLike
    exact: ArrayLike = 0.0


@dataclass(frozen=True, slots=True)
class Check:
    """One checked quantity of a case.

    Parameters
    ----------
    quantity : str
        Name of the quantity.
    closed_form : str
        The equation for its exact value, and the source.
    unit : str
        Unit of the quantity; a relative error has none.
    bar : float
        Error tolerance.
    error : {"relative", "absolute", "bound"}
        Definition of the error: relative to the exact value, absolute in the unit, or the
        computed value itself if it should be zero.
    """

    quantity: str
    closed_form: str
    unit: str
    bar: float
    error: Literal["relative", "absolute", "bound"]

    def errors(self, computed: np.ndarray, exact: np.ndarray) -> np.ndarray:
        """Return the error of each value, infinite for NaN."""
        error = computed if self.error == "bound" else np.abs(computed - exact)
        if self.error == "relative":
            error = error / np.abs(exact)
        return np.where(np.isnan(error), math.inf, error)


@dataclass(frozen=True, slots=True)
class Case:
    """One computed experiment.

    Parameters
    ----------
    name : str
        Its name on the command line.
    checks : sequence of Check
        Its checked quantities.
    measure : callable
        Function that simulates in a `Lab` and returns one `Measured` for each check.
    dt : float, optional
        Step that replaces the default one [s].
    slow : bool
        Whether it takes more than a few seconds.
    smooth : bool
        Whether its error has an order of convergence in the step.
    """

    name: str
    checks: tuple[Check, ...]
    measure: Callable[[Lab], Sequence[Measured]]
    dt: float | None = None
    slow: bool = False
    smooth: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """Result of one check of a case; for several values, that with the largest error.

    `cpu` is the processor time of the case's steps per simulated time [us/s].
    """

    case: str
    check: Check
    exact: float
    computed: float
    error: float
    cpu: float

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error <= self.check.bar

    def __str__(self) -> str:
        c = self.check
        unit = "" if c.error == "relative" else f" {c.unit}"
        return (
            f"{self.case}, {c.quantity}: {self.computed:.6g} for {self.exact:.6g} {c.unit}, "
            f"{c.error} error {self.error:.3g}{unit}, bar {c.bar:g}"
        )


def evaluate(case: Case, dt: float | None = None, seed: int = 0) -> tuple[Result, ...]:
    """Run a case and return the results of its checks.

    Parameters
    ----------
    case : Case
        The case.
    dt : float, optional
        Time step [s]; by default that of the case or the default step.
    seed : int
        Seed of the random shapes, velocities and offsets.
    """
    lab = Lab(dt or case.dt or Settings().dt, seed)
    try:
        measured = case.measure(lab)
    except Diverged:
        measured = [Measured(math.nan, math.nan)] * len(case.checks)
    cpu = 1e6 * lab.cpu / lab.simulated if lab.simulated else math.nan
    return tuple(
        _result(case.name, check, one, cpu)
        for check, one in zip(case.checks, measured, strict=True)
    )


def _result(name: str, check: Check, measured: Measured, cpu: float) -> Result:
    pairs = np.broadcast_arrays(
        np.asarray(measured.computed, dtype=np.float64),
        np.asarray(measured.exact, dtype=np.float64),
    )
    computed, exact = (np.atleast_1d(a).ravel() for a in pairs)
    error = check.errors(computed, exact)
    k = int(error.argmax())
    return Result(name, check, float(exact[k]), float(computed[k]), float(error[k]), cpu)


STEPS = (1e-2, 5e-3, 2.5e-3, 1.25e-3)
"""Time steps [s]."""

FLOOR = 1e-10
"""Error below which rounding dominates [-]."""


@dataclass(frozen=True, slots=True)
class Convergence:
    """Errors of one checked quantity at the steps `STEPS`, and their order.

    `order` is the slope of the least-squares line through the logarithms of error and step, over
    the errors above rounding; NaN if there are fewer than two.
    """

    case: str
    quantity: str
    errors: tuple[float, ...]

    @property
    def order(self) -> float:
        """Observed order of convergence [-]."""
        points = [(s, e) for s, e in zip(STEPS, self.errors, strict=True) if FLOOR < e < math.inf]
        if len(points) < 2:
            return math.nan
        step, error = np.log(np.array(points)).T
        return float(np.polyfit(step, error, 1)[0])


def converge(case: Case, seed: int = 0) -> tuple[Convergence, ...]:
    """Run a case with all steps."""
    runs = [evaluate(case, dt, seed) for dt in STEPS]
    return tuple(
        Convergence(case.name, check.quantity, tuple(run[i].error for run in runs))
        for i, check in enumerate(case.checks)
    )
