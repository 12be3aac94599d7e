"""Effect of each constant of the mechanics, found by neutralising it.

`python -m experiments.ablated [--out DIR]`.

Each constant is set to a value at which it has no effect, or if there is none, to a very different
value. For each of these variants, the script runs the closed-form cases, the hard cases at 10 ms,
tests of fences, thrust, foreseen contacts, walls, lone blocks, sleeping and supports, and a
rockfall of 120 blocks. With two variants at a time it takes 40 minutes.

`python -m experiments.ablated NAME=VALUE ...` runs once with changed constants and prints JSON. It
must be a separate process: kernels compile constants in, so constants are changed before any kernel
is imported, and kernels are compiled into a temporary folder.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import click

VARIANTS = (
    "RIGID=1e4",
    "NEW_SHARE=1",
    "AT_ONCE=2e-2",
    "ROUNDING=0",
    "RECOVERY_SWEEPS=0",
    "SETTLED=1e9",
    "SUBSTEPS=3",
    "MOST_SWEEPS=10",
    "SET_OF_SWEEPS=1000",
    "PROGRESS=0",
    "SAME_NORMAL=-2",
    "SAME_FACE=0.9",
    "PENETRATION_RATIO=1e-3",
    "MARGIN_RATIO=1e-4",
    "SLEEP_SPEED=0.1",
    "SLEEP_TIME=0.05",
    "GROWN=1e9",
)
"""Changed value of each constant, except for those that only stop a run or warn."""

EXPENSIVE = ("collisions", "eccentric-hits", "ritchie", "silo")
"""Prefixes of the names of expensive closed-form cases, which are left out because almost any
constants satisfy them."""

KEPT = "silo-10ms"
"""Expensive case that is computed all the same, because some constants fail only there."""

TESTS = ("test_fences", "test_thrust", "test_foreseen", "test_gravity_walls", "test_lone_block",
         "test_sleeping", "test_loads_and_supports", "test_locked_wedges")  # fmt: skip
"""Additional tests from tests/physics."""

HARD_STEP = 1e-2
"""Step of the hard cases [s]."""

TABLE = "constants.csv"
USUAL, NOTHING = "as it is", "MOST_SWEEPS=100"
"""Name of the row without changes, and an assignment that changes nothing."""

Row = dict[str, Any]


def change(changes: list[str]) -> None:
    """Replace `rigdda.dynamics.constants` by a changed copy before kernels import it."""
    place = importlib.util.find_spec("rigdda")  # for a submodule, this would import kernels
    assert place is not None and place.submodule_search_locations is not None
    path = Path(place.submodule_search_locations[0], "dynamics", "constants.py")
    spec = importlib.util.spec_from_file_location("rigdda.dynamics.constants", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for one in changes:
        name, value = one.split("=")
        usual = getattr(module, name)
        setattr(module, name, type(usual)(float(value)))
    sys.modules["rigdda.dynamics.constants"] = module


class Failures:
    """Pytest plugin that collects the names of failed tests."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Add the name of a failed test."""
        if report.failed:
            self.names.append(report.nodeid.split("::")[-1])


def measure() -> dict[str, Any]:
    """Return the failures among cases and tests, and the cost and penetration of rockfalls."""
    import numpy as np
    import pytest

    from experiments.bench.cases import rockfall_scene
    from experiments.hard_cases.study import allowed
    from experiments.hard_cases.suite import CASES as HARD
    from experiments.hard_cases.trial import trial
    from rigdda import Settings, Simulation
    from rigdda.validation.case import evaluate
    from rigdda.validation.suite import CASES

    amiss = []
    for case in CASES:
        if (not case.slow and not case.name.startswith(EXPENSIVE)) or case.name == KEPT:
            amiss += [f"{r.case} {r.error:.2g}" for r in evaluate(case) if not r.passed]
    for hard in HARD:
        result = trial(hard, HARD_STEP)
        if result.verdict not in allowed(hard.refused, HARD_STEP):
            amiss.append(f"{hard.name} {result.verdict}: {result.note.split(';')[0][:60]}")
    failures = Failures()
    paths = [f"tests/physics/{name}.py" for name in TESTS]
    quiet = ["-o", "addopts=", "-n0", "-p", "no:cacheprovider", "-p", "no:terminal"]
    pytest.main([*quiet, *paths], plugins=[failures])
    cpu, depth = [], []
    for seed in (1, 2, 3):
        sim = Simulation(rockfall_scene(120, seed), Settings())
        start = time.process_time()
        sim.step(3000)
        cpu.append(time.process_time() - start)
        depth.append(sim.diagnostics.penetration)
    return {
        "amiss": "; ".join([*amiss, *sorted(set(failures.names))]),
        "cpu_s": round(float(np.median(cpu)), 3),
        "penetration_m": round(float(np.median(depth)), 4),
    }


def attempt(variant: str) -> Row:
    """Return the results of a variant, computed in a separate process."""
    command = [
        sys.executable,
        "-m",
        "experiments.ablated",
        NOTHING if variant == USUAL else variant,
    ]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=1800)
        lines = done.stdout.strip().splitlines() or done.stderr.strip().splitlines()
        found = json.loads(lines[-1]) if done.returncode == 0 else {"amiss": lines[-1][:200]}
    except subprocess.TimeoutExpired:
        found = {"amiss": "does not end"}
    return {"amiss": "", "cpu_s": float("nan"), "penetration_m": float("nan")} | found


@click.command(help=__doc__)
@click.argument("changes", nargs=-1, metavar="[NAME=VALUE]...")
@click.option("--out", type=click.Path(path_type=Path), default=Path("experiments/results"),
              show_default=True, help="Folder of results.")  # fmt: skip
def main(changes: tuple[str, ...], out: Path) -> None:
    """Run all variants and write the table, or run once with changes and print the results."""
    if changes:
        with tempfile.TemporaryDirectory() as folder:
            os.environ["XDG_CACHE_HOME"] = folder
            change(list(changes))
            print(json.dumps(measure()))
        return
    from experiments.study import tabulate

    cases = [{"variant": variant} for variant in (USUAL, *VARIANTS)]
    tabulate(out / TABLE, cases, attempt, lambda row: f"{row['variant']}: {row['amiss']}", 2)


if __name__ == "__main__":
    main()
