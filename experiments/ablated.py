"""One run of the mechanics with constants changed: `python -m experiments.ablated NAME=VALUE ...`.

Prints one line of JSON. A process of its own: kernels take the constants in when they are compiled,
so they are set before any kernel is read, and compiled into a folder that is thrown away.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
import tempfile
import time
from typing import Any


def change(changes: list[str]) -> None:
    """Put a changed copy of `rigdda.dynamics.constants` where kernels will look for it."""
    spec = importlib.util.find_spec("rigdda.dynamics.constants")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for one in changes:
        name, value = one.split("=")
        usual = getattr(module, name)
        setattr(module, name, type(usual)(float(value)))
    sys.modules["rigdda.dynamics.constants"] = module


def measure() -> dict[str, Any]:
    """Return what is amiss among the cases, and the cost and the depth of rockfalls."""
    import numpy as np

    from experiments.bench.cases import rockfall_scene
    from experiments.hard_cases.study import allowed
    from experiments.hard_cases.suite import CASES as HARD
    from experiments.hard_cases.trial import trial
    from rigdda import Settings, Simulation
    from rigdda.validation.case import evaluate
    from rigdda.validation.suite import CASES

    start = time.perf_counter()
    Simulation(rockfall_scene(20, 1), Settings()).step(20)
    compiled = time.perf_counter() - start
    amiss = []
    for case in CASES:
        if not case.slow or case.name == "silo-10ms":
            amiss += [f"{r.case}: {r.error:.2g}" for r in evaluate(case) if not r.passed]
    for hard in HARD:
        for dt in (5e-3, 1e-2):
            result = trial(hard, dt)
            if result.verdict not in allowed(hard.refused, dt):
                note = result.note.split(";")[0][:60]
                amiss.append(f"{hard.name} at {1e3 * dt:g} ms {result.verdict}: {note}")
    cpu, depth = [], []
    for seed in (1, 2, 3):
        sim = Simulation(rockfall_scene(120, seed), Settings())
        start = time.process_time()
        sim.step(3000)
        cpu.append(time.process_time() - start)
        depth.append(sim.diagnostics.penetration)
    return {
        "amiss": amiss,
        "cpu": float(np.median(cpu)),
        "penetration": float(np.median(depth)),
        "compiled": compiled,
    }


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        change(sys.argv[1:])
        print(json.dumps(measure()))
