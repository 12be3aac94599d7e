"""Closed forms: error against processor time of every setting, and of the peers where possible."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np

from experiments.bench import cases as bench
from experiments.bench import timing
from experiments.bench.engines import core as engine
from experiments.speed_error.knobs import DEFAULT, STEP, STEPS, Choice, choices
from rigdda.errors import BadInput, Diverged
from rigdda.model.scene import Scene
from rigdda.validation import assemblies, single_block
from rigdda.validation.case import Case, Lab, Metered
from rigdda.validation.scenes import block_size

MORE_STEPS = (*STEPS, 1e-3)
"""Steps of the closed forms, including a shorter one [s]."""

PEER_PARTS = (5, 10, 20, 50, 100, 200)
"""Steps of the peers, as divisors of the longest step."""

ALONE = ("newmark", "16-gon", "arch-stands")
"""Cases of the validation suite without an adapter for the peers."""

QUICK_ALONE = ("newmark",)


@dataclass(frozen=True)
class Point:
    """Error of a setting, in the unit of `quantity`, and CPU time per simulated second [us/s].

    `default` marks the default settings. For peers, `options` are their options.
    """

    case: str
    quantity: str
    engine: str
    knob: str
    value: float
    dt: float
    error: float
    cpu_us_per_simulated_s: float
    default: bool
    options: str = ""


class TunedLab(Lab):
    """A lab whose simulations all use the settings of a choice."""

    def __init__(self, choice: Choice):
        self._settings = {k: v for k, v in choice.settings.items() if k != "dt"}
        super().__init__(choice.settings.get("dt", DEFAULT.dt))

    def simulate(self, scene: Scene, dt: float | None = None, **settings: Any) -> Metered:
        """Return a simulation with the settings of the choice.

        Its penetration is in units of the mean block size.
        """
        chosen = dict(self._settings)
        if "penetration" in chosen:
            chosen["penetration"] *= block_size(scene)
        return super().simulate(scene, dt, **(settings | chosen))


def with_peers(quick: bool) -> list[bench.Case]:
    """Return the closed-form cases on which the bench compares engines."""
    found = [c for c in bench.all_cases() if not c.name.startswith("rockfall")]
    return [replace(c, scenes=c.scenes[:1]) for c in found] if quick else found


def sweep(case: bench.Case) -> Iterator[Point]:
    """Yield a point for each choice on a case of the bench."""
    for choice in choices(block_size(case.scenes[0]), MORE_STEPS):
        settings = dict(choice.settings)
        dt = settings.pop("dt", DEFAULT.dt)
        done = timing.Setting(engine, dt, settings)
        try:
            timing.first_run(done, case)
        except BadInput:  # the step is too long for the blocks
            continue
        row = done.row(case)
        yield Point(
            case.name, case.quantity, engine.NAME, choice.knob, choice.value, dt, row.error,
            row.cpu_us_per_simulated_s, choice.default,
        )  # fmt: skip


def sweep_peers(
    case: bench.Case, peers: list[ModuleType], say: Callable[[str], None]
) -> Iterator[Point]:
    """Yield the points of the peers, each with its first options."""
    short = replace(case, options=1, parts=PEER_PARTS)
    for done in timing.sweep(short, peers, timing.QUICK, say):
        row = done.row(case)
        yield Point(
            case.name, case.quantity, row.engine, STEP, row.dt, row.dt, row.error,
            row.cpu_us_per_simulated_s, False, row.options,
        )  # fmt: skip


def sweep_alone(case: Case) -> Iterator[Point]:
    """Yield a point for each choice on the first check of a case of the validation suite."""
    check = case.checks[0]
    what = f"{check.quantity} [{'-' if check.error == 'relative' else check.unit}]"
    for choice in choices(1.0, MORE_STEPS):
        lab = TunedLab(choice)
        try:
            measured = case.measure(lab)[0]
            computed, exact = np.broadcast_arrays(
                np.atleast_1d(measured.computed), np.atleast_1d(measured.exact)
            )
            error = float(check.errors(computed, exact).max())
        except BadInput:
            continue
        except Diverged:
            error = math.inf
        cpu = 1e6 * lab.cpu / lab.simulated if lab.simulated else math.nan
        yield Point(
            case.name, what, engine.NAME, choice.knob, choice.value, lab.dt, error, cpu,
            choice.default,
        )  # fmt: skip


def alone(quick: bool) -> list[Case]:
    """Return the cases of the validation suite that are computed without peers."""
    cases = (*single_block.SLIDING, *single_block.ROLLING, *assemblies.ARCHES)
    return [c for c in cases if c.name in (QUICK_ALONE if quick else ALONE)]
