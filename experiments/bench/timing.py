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
from experiments.bench.levels import CORE, Row
from rigdda import Scene
from rigdda.errors import BadInput, Diverged

TIE = 1.3
"""Ratio of first times up to which a setting is timed again, since it may be the cheapest at a
level."""

ENOUGH = 0.25
"""Fraction of the finest error level, and of the patience, below which no finer step is tried."""

LEAST = 0.01
"""Least processor time of a measurement [s]; shorter runs are repeated."""

LONG = 0.5
"""Processor time above which the run for the error also counts as a measurement [s]."""


@dataclass(frozen=True)
class Effort:
    """Limits on the effort for a case.

    `patience` is the processor time of a scene [s] above which no finer step is tried with the same
    options, `repeats` the processor time of all repeated runs together [s], and `most` and `fewest`
    are the numbers of runs of a setting that may decide a level.
    """

    patience: float
    repeats: float
    most: int
    fewest: int


FULL = Effort(patience=5.0, repeats=20.0, most=15, fewest=5)
QUICK = Effort(patience=1.0, repeats=1.0, most=5, fewest=3)


@dataclass
class Setting:
    """An engine with options and a step, and its measured error and times."""

    engine: ModuleType
    dt: float
    options: dict[str, Any]
    error: float = np.inf
    greatest: float = np.nan
    cpu: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        """Median processor time [s]."""
        return float(np.median(self.cpu))

    def load(self, scene: Scene, sleeping: bool) -> Any:
        """Return the engine with a scene loaded."""
        return self.engine.Engine(scene, self.dt, sleeping, **self.options)

    def row(self, case: Case) -> Row:
        """Return the measurements as a row, with times per simulated second of one scene."""
        simulated = 1e-6 * case.duration * len(case.scenes)
        return Row(
            case.name,
            self.engine.NAME,
            self.dt,
            " ".join(f"{k}={v}" for k, v in self.options.items()),
            self.error,
            self.greatest,
            self.median / simulated,
            min(self.cpu) / simulated,
            max(self.cpu) / simulated,
            len(self.cpu),
        )


def first_run(setting: Setting, case: Case) -> None:
    """Set the errors of a setting, infinite if a scene diverges, and its first time."""
    stride = 1 if case.every is None else round(case.every / setting.dt)
    frames = round(case.duration / setting.dt) // stride
    errors, greatest, cpu = [], [], 0.0
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
        times = np.array([k * stride * setting.dt for k in range(len(poses))])
        path = np.array(poses)
        finite = np.isfinite(path).all()
        errors.append(case.error(scene, times, path) if finite else np.inf)
        if case.greatest is not None:
            greatest.append(case.greatest(scene, times, path) if finite else np.inf)
    setting.error = case.total(errors)
    if greatest:
        setting.greatest = case.total(greatest)
    setting.cpu.append(cpu if cpu > LONG else stepping(setting, case))


def stepping(setting: Setting, case: Case) -> float:
    """Return the processor time of the steps of all scenes of a case [s].

    Loading is excluded and nothing is read in between. This core and MuJoCo take all steps in one
    call; pymunk and Box2D need one call per step, which is part of using them from Python.
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
    """Measure a case: errors first, then times in rounds for settings that may decide a level.

    The machine is shared: in rounds, all engines are exposed to the same disturbances, and medians
    are used.
    """
    settings: list[Setting] = []
    for engine in engines:
        say(f"{case.name}: {engine.NAME}")
        for options in engine.OPTIONS[: case.options]:
            settings.extend(_refine(case, engine, options, effort))
    good = contenders(settings, case.levels)
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
    """Yield ever finer steps until they take too long, or are accurate enough."""
    for part in case.parts:
        setting = Setting(engine, LONGEST / part, options)
        try:
            first_run(setting, case)
        except BadInput:  # the core refuses steps that are too long for the blocks
            continue
        yield setting
        enough = setting.error < ENOUGH * min(case.levels)
        if setting.cpu[0] > len(case.scenes) * effort.patience * (ENOUGH if enough else 1.0):
            return


def contenders(settings: list[Setting], levels: tuple[float, ...]) -> list[Setting]:
    """Return the settings that may be the cheapest of the core or of the peers at a level."""
    chosen = []
    for core in (True, False):
        side = [s for s in settings if (s.engine.NAME == CORE) is core]
        for error in levels:
            good = [s for s in side if s.error <= error]
            least = min((s.cpu[0] for s in good), default=0.0)
            chosen += [s for s in good if s.cpu[0] <= TIE * least and s not in chosen]
    return chosen
