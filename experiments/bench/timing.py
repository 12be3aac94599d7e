"""Error and processor time of every setting of every engine on a case."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np

from experiments.bench.cases import LONGEST, Case
from experiments.bench.levels import Row
from rigdda import Scene
from rigdda.errors import Diverged

TIE = 1.2
"""A setting is timed again if none of its engine has less error at 1/1.2 of its first time."""

LEAST = 0.01
"""Processor time that a measurement lasts at least [s]; shorter runs are repeated back to back."""

LONG = 0.5
"""Processor time from which the run that gives the error is timed too, not another one [s]."""


@dataclass(frozen=True)
class Effort:
    """How much is spent on a case.

    Processor time [s] after which no finer step is tried with the same options, and of all repeated
    runs together; most and fewest runs of a setting on a front.
    """

    patience: float
    repeats: float
    most: int
    fewest: int


FULL = Effort(patience=10.0, repeats=25.0, most=15, fewest=3)
QUICK = Effort(patience=1.0, repeats=1.0, most=5, fewest=2)


@dataclass
class Setting:
    """An engine with its options and a step; what it erred and took so far."""

    engine: ModuleType
    dt: float
    options: dict[str, Any]
    error: float = np.inf
    cpu: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        """Median processor time [s]."""
        return float(np.median(self.cpu))

    def load(self, scene: Scene, sleeping: bool) -> Any:
        """Return the engine with a scene in it."""
        return self.engine.Engine(scene, self.dt, sleeping, **self.options)

    def row(self, case: Case) -> Row:
        """Return what was measured; times per simulated second, of one scene."""
        simulated = 1e-6 * case.duration * len(case.scenes)
        return Row(
            case.name,
            self.engine.NAME,
            self.dt,
            " ".join(f"{k}={v}" for k, v in self.options.items()),
            self.error,
            self.median / simulated,
            min(self.cpu) / simulated,
            max(self.cpu) / simulated,
            len(self.cpu),
        )


def first_run(setting: Setting, case: Case) -> None:
    """Set the error of a setting, infinite where a scene diverges, and its first time."""
    stride = 1 if case.every is None else round(case.every / setting.dt)
    frames = round(case.duration / setting.dt) // stride
    errors, cpu = [], 0.0
    for scene in case.scenes:
        engine = setting.load(scene, case.sleeping)
        poses = [engine.poses()]
        try:
            for _ in range(frames):
                before = time.process_time()
                engine.advance(stride)
                cpu += time.process_time() - before
                poses.append(engine.poses())
        except Diverged:
            poses[-1] = np.full_like(poses[0], np.nan)
        times = np.arange(len(poses)) * stride * setting.dt
        finite = np.isfinite(poses).all()
        errors.append(case.error(scene, times, np.array(poses)) if finite else np.inf)
    setting.error = case.total(errors)
    setting.cpu.append(cpu if cpu > LONG else stepping(setting, case))


def stepping(setting: Setting, case: Case) -> float:
    """Return the processor time of the steps of all scenes of a case [s].

    Loading is left out, and nothing is read in between: this core and MuJoCo take all steps in one
    call; pymunk and Box2D need a call a step, which is part of using them from Python.
    """
    total, rounds = 0.0, 0
    while total < LEAST:
        rounds += 1
        for scene in case.scenes:
            engine = setting.load(scene, case.sleeping)
            before = time.process_time()
            with contextlib.suppress(Diverged):
                engine.advance(round(case.duration / setting.dt))
            total += time.process_time() - before
    return total / rounds


def sweep(
    case: Case, engines: list[ModuleType], effort: Effort, say: Callable[[str], None]
) -> list[Setting]:
    """Measure a case: errors first, then times in rounds that go through all engines' fronts.

    The machine is shared: interleaved, engines meet the same disturbances, and medians count.
    """
    settings: list[Setting] = []
    for engine in engines:
        say(f"{case.name}: {engine.NAME}")
        for options in engine.OPTIONS[: case.options]:
            settings.extend(_refine(case, engine, options, effort))
    good = [s for e in engines for s in _on_front([s for s in settings if s.engine is e])]
    say(f"{case.name}: {len(good)} of {len(settings)} settings again")
    spent = 0.0
    for n in range(1, effort.most):
        if n >= effort.fewest and spent > effort.repeats:
            break
        for setting in good:
            setting.cpu.append(stepping(setting, case))
            spent += setting.cpu[-1]
    return settings


def _refine(
    case: Case, engine: ModuleType, options: dict[str, Any], effort: Effort
) -> Iterator[Setting]:
    """Yield ever finer steps until they take too long."""
    for part in case.parts:
        setting = Setting(engine, LONGEST / part, options)
        first_run(setting, case)
        yield setting
        if setting.cpu[0] > effort.patience:
            return


def _on_front(settings: list[Setting]) -> list[Setting]:
    """Return the settings that may be on the front of their engine, judged by one run each."""
    return [
        s
        for s in settings
        if np.isfinite(s.error)
        and not any(o.error < s.error and TIE * o.cpu[0] < s.cpu[0] for o in settings)
    ]
