"""A trial: one case at one step."""

from __future__ import annotations

import math
import time

import numpy as np
import shapely

from experiments.bench.penetration import penetration
from experiments.hard_cases.case import FAILS, REFUSES, Case, Floats, History, Result, judge
from rigdda import BadInput, Settings, Simulation
from rigdda.geometry import polygon_properties
from rigdda.validation.scenes import block_size, masses

BELOW = 1e3
"""Depth to which the ground is closed for the check of lost blocks [m]."""


def trial(case: Case, dt: float) -> Result:
    """Run a case at a step [s]; `BadInput` is a refusal, any other error a failure."""
    try:
        history, cpu = play(case, dt)
    except BadInput as error:
        return Result(case.name, dt, REFUSES, note=f"{type(error).__name__}: {error}")
    except Exception as error:  # any other error is a failure
        return Result(case.name, dt, FAILS, note=f"{type(error).__name__}: {error}")
    if not (np.isfinite(history.poses).all() and np.isfinite(history.velocities).all()):
        return Result(case.name, dt, FAILS, note="not a number")
    late = history.times >= case.settled
    depth = float(penetration(history.scene, history.poses[late]).max()) / block_size(history.scene)
    missed, gain = float(case.error(history)), growth(history)
    verdict, note = judge(case, missed, depth, gain, lost(history))
    per_second = 1e3 * cpu / case.duration
    return Result(case.name, dt, verdict, missed, case.bar, depth, gain, per_second, note)


def play(case: Case, dt: float) -> tuple[History, float]:
    """Return the history of a case at a step [s], and the processor time of its steps [s]."""
    scene = case.scene()
    sim = Simulation(scene, Settings(dt=dt, **case.settings))
    stride = max(1, round(case.frame / dt))
    total = round(case.duration / dt)
    frames = [_frame(sim)]
    cpu = 0.0
    for mark in [*range(stride, total, stride), total]:
        before = time.process_time()
        sim.step(mark - round(sim.time / dt))
        cpu += time.process_time() - before
        frames.append(_frame(sim))
    times, poses, velocities, energy = map(np.array, zip(*frames, strict=True))
    return History(scene, times, poses, velocities, energy, sim), cpu


def _frame(sim: Simulation) -> tuple[float, Floats, Floats, float]:
    e = sim.energy()
    return sim.time, sim.poses, sim.velocities, e.kinetic + e.potential + e.elastic - e.external


def growth(history: History) -> float:
    """Return the greatest growth of energy above its lowest value so far [-].

    It is relative to the weight of the free blocks times their size plus all dissipated energy.
    """
    energy, scene = history.energy, history.scene
    free = ~np.array([b.fixed for b in scene.blocks])
    weight = float(masses(scene)[0][free].sum()) * math.hypot(*scene.gravity_vector)
    scale = weight * block_size(scene) + float(energy[0] - energy.min())
    return float((energy - np.minimum.accumulate(energy)).max()) / scale


def lost(history: History) -> int:
    """Return the number of blocks in the ground, beyond its ends or with a changed area."""
    scene = history.scene
    change = [
        abs(
            polygon_properties(history.sim.vertices(i))[0] / polygon_properties(b.vertices)[0] - 1.0
        )
        for i, b in enumerate(scene.blocks)
    ]
    gone = np.array(change) > 1e-9
    if scene.terrain is not None:
        chain = np.array(scene.terrain.points)
        floor = chain[:, 1].min() - BELOW
        ground = shapely.Polygon([*chain, (chain[-1, 0], floor), (chain[0, 0], floor)])
        x, y = history.poses[-1, :, :2].T
        gone |= shapely.contains_xy(ground, x, y)
        gone |= (x < chain[:, 0].min()) | (x > chain[:, 0].max()) | (y < floor)
    return int(gone.sum())
