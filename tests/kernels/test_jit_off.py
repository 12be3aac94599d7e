"""Kernels run as plain Python give what the compiled ones give."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from physics.helpers import box, ngon, rock

from rigdda import Block, Scene, Simulation, Terrain

STEPS = 60


def scene() -> Scene:
    """Return a block that hits another, and one that slides beside them."""
    ground = Terrain([(-20.0, 4.0), (0.0, 0.0), (20.0, 0.0)])
    blocks = (
        box(1.0, 0.5),
        Block(ngon(6, 0.5, (0.5, 1.7)), velocity=(0.0, -2.0, 1.0)),
        Block(ngon(5, 0.6, (-5.0, 1.8))),
    )
    return Scene(ground, blocks, rock(25.0, 0.3), damping=0.1)


def final() -> np.ndarray:
    """Return poses and velocities after the run."""
    sim = Simulation(scene())
    sim.step(STEPS)
    return np.concatenate([sim.poses, sim.velocities])


def test_plain_python_gives_the_same():
    tests = Path(__file__).parents[1]
    paths = [str(tests), str(tests.parent), os.environ.get("PYTHONPATH", "")]
    code = "from kernels.test_jit_off import final; print(final().tolist())"
    out = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    ).stdout
    plain = np.array(eval(out, {"__builtins__": {}}))
    assert np.abs(plain - final()).max() < 1e-9
    assert np.abs(plain[3:]).max() > 0.1
