"""Start-up time and memory of this core."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
import tracemalloc
from dataclasses import dataclass

from experiments.bench.cases import rockfall_scene
from rigdda import Scene, Simulation

FIRST_STEP = """
import time
start = time.perf_counter()
import rigdda
imported = time.perf_counter()
block = rigdda.Block([(0, 0), (1, 0), (1, 1), (0, 1)])
sim = rigdda.Simulation(rigdda.Scene(rigdda.Terrain([(-9, 0), (9, 0)]), (block,)))
sim.step()
print(imported - start, time.perf_counter() - imported)
"""
"""Script that prints the time of the import and of a scene with its first step [s]."""


@dataclass(frozen=True)
class Footprint:
    """Wall times of a fresh process [s] and memory [bytes].

    `interpreter_s` is for Python alone. The growth is the memory allocated during a simulated
    minute of steps, after a first one.
    """

    interpreter_s: float
    import_s: float
    first_step_cached_s: float
    first_step_ever_s: float
    bytes_per_block: float
    bytes_per_block_and_frame: float
    growth_bytes_per_simulated_minute: float


def _start(cache: str | None = None) -> tuple[float, float]:
    """Return the time of the import and of the first step in a fresh process [s]."""
    environment = {**os.environ, **({} if cache is None else {"XDG_CACHE_HOME": cache})}
    out = subprocess.run(
        [sys.executable, "-c", FIRST_STEP], env=environment, capture_output=True, check=True
    )
    imported, stepped = map(float, out.stdout.split())
    return imported, stepped


def _interpreter() -> float:
    before = time.perf_counter()
    subprocess.run([sys.executable, "-c", "pass"], check=True)
    return time.perf_counter() - before


def _allocated() -> int:
    return tracemalloc.get_traced_memory()[0]


def _memory(scene: Scene) -> tuple[float, float, float]:
    """Return bytes per block, bytes per block and frame, and the growth over a minute."""
    blocks = len(scene.blocks)
    Simulation(scene).step()
    tracemalloc.start()
    try:
        before = _allocated()
        sim = Simulation(scene)
        sim.step(round(60.0 / sim.settings.dt))
        state = _allocated() - before
        sim.step(round(60.0 / sim.settings.dt))
        growth = _allocated() - before - state
        before, frames = _allocated(), 200
        run = sim.run(0.05 * frames, 0.05)
        recorded = _allocated() - before
        assert len(run.times) == frames + 1
    finally:
        tracemalloc.stop()
    return state / blocks, recorded / blocks / (frames + 1), float(growth)


def measure(cold: bool) -> Footprint:
    """Measure; time the first run ever, which compiles all kernels, only if `cold`."""
    _start()
    imported, stepped = (sorted(v)[1] for v in zip(*(_start() for _ in range(3)), strict=True))
    ever = float("nan")
    if cold:
        with tempfile.TemporaryDirectory() as folder:
            ever = _start(folder)[1]
    return Footprint(_interpreter(), imported, stepped, ever, *_memory(rockfall_scene(120, 1)))
