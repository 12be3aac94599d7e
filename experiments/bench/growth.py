"""Growth of the cost with the number of blocks while a pile forms."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.bench.penetration import penetration
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.geometry import polygon_properties
from rigdda.validation.scenes import GRAVITY, rock

SIZES = (20, 60, 120, 240, 480, 960, 1920, 3840)
"""Numbers of blocks."""

FITTED = 120
"""Least number of blocks used to fit the exponent."""

AREA = 2.0
"""Area of a block [m2]."""

CELL = 2.0
"""Side of the cell in which a block starts [m], larger than its diameter."""

SLENDER = 4.0
"""Width of the initial cloud over its height [-]."""

FALLS = 2.5
"""Simulated time over the fall time from the cloud's top, for dynamic similarity (Froude) [-]."""


@dataclass(frozen=True)
class Growth:
    """A pile of blocks: processor time per simulated second [us/s], penetration [m]."""

    blocks: int
    duration: float
    cpu_us_per_simulated_s: float
    cpu_min: float
    cpu_max: float
    us_per_block_and_step: float
    contacts_per_block: float
    penetration: float


def rubble(rng: np.random.Generator) -> np.ndarray:
    """Return the (n, 2) corners of a random convex block of `AREA` about its centroid [m]."""
    n = int(rng.integers(5, 8))
    turn = 2.0 * math.pi * (np.arange(n) + rng.uniform(-0.25, 0.25, n)) / n + rng.uniform(0.0, 6.0)
    corners = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    area, centre, _ = polygon_properties(corners)
    return (corners - centre) * math.sqrt(AREA / area)


def heap(count: int) -> tuple[Scene, float]:
    """Return a loose cloud of blocks above level ground, and the time for it to pile up [s]."""
    rng = np.random.default_rng(count)
    rows = max(2, round(math.sqrt(count / SLENDER)))
    columns = math.ceil(count / rows)
    blocks = []
    for i in range(count):
        row, column = divmod(i, columns)
        x = CELL * (column - 0.5 * columns + 0.25 * (row % 2))
        blocks.append(Block(rubble(rng) + np.array([x, 1.0 + CELL * row])))
    reach = CELL * columns * 4.0 + 50.0
    terrain = Terrain(((-reach, 0.0), (reach, 0.0)))
    duration = FALLS * math.sqrt(2.0 * CELL * rows / GRAVITY)
    return Scene(terrain, tuple(blocks), rock(28.0, 0.2)), duration


def pour(scene: Scene, duration: float, dt: float) -> tuple[float, float, float]:
    """Return processor time [s], contacts per block and step, and final penetration [m]."""
    sim = Simulation(scene, Settings(dt=dt))
    before = time.process_time()
    sim.step(round(duration / dt))
    cpu = time.process_time() - before
    done = sim.diagnostics
    depth = penetration(scene, sim.poses[None])[0]
    return cpu, done.contacts / done.steps / len(scene.blocks), float(depth)


def measure(sizes: tuple[int, ...], runs: int, say: Callable[[str], None]) -> list[Growth]:
    """Measure all sizes, in rounds."""
    dt = Settings().dt
    heaps = [heap(n) for n in sizes]
    pour(*heaps[0], dt)
    results: list[list[tuple[float, float, float]]] = [[] for _ in sizes]
    for _ in range(runs):
        for n, (scene, duration), result in zip(sizes, heaps, results, strict=True):
            say(f"growth: {n} blocks")
            result.append(pour(scene, duration, dt))
    return [
        _growth(n, duration, dt, np.array(result))
        for n, (_, duration), result in zip(sizes, heaps, results, strict=True)
    ]


def _growth(blocks: int, duration: float, dt: float, result: np.ndarray) -> Growth:
    cpu = 1e6 * result[:, 0] / duration
    middle = float(np.median(cpu))
    return Growth(
        blocks,
        duration,
        middle,
        float(cpu.min()),
        float(cpu.max()),
        middle * dt / blocks,
        *map(float, result[0, 1:]),
    )


def exponent(rows: list[Growth]) -> float:
    """Return the fitted exponent of the cost as a power of the number of blocks."""
    large = [r for r in rows if r.blocks >= FITTED]
    if len(large) < 2:
        return math.nan
    blocks = np.log([r.blocks for r in large])
    return float(np.polyfit(blocks, np.log([r.cpu_us_per_simulated_s for r in large]), 1)[0])
