"""Outcomes of many releases with one engine, and their processor time."""

from __future__ import annotations

import math
import time
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from experiments.outcome_cost.cases import Case
from rigdda import Scene, Settings, Simulation
from rigdda.lumped_mass import lumped
from rigdda.releases import Batch
from rigdda.validation.scenes import masses

Floats = NDArray[np.float64]

FRAME = 0.1
"""Interval of the frames [s], a multiple of every step."""

LOOK = 5
"""Number of frames between checks for rest."""

STILL = 0.01
"""Displacement since the last check below which all blocks are at rest [m]."""

MASS, PAST, RUN_OUT, ENERGY = range(4)
"""Columns of the results of a block: mass [kg/m], whether it passed the road's edge, chainage at
which it stops [m], kinetic energy at the barrier [kJ/m], NaN if it does not reach it."""

OUTCOMES = ("debris share [-]", "95 % run-out [m]", "95 % energy at the barrier [kJ/m]")


class Release(NamedTuple):
    """Results of the blocks of a release, (n, 4), and its processor time [s]."""

    blocks: Floats
    cpu: float


def clock() -> float:
    """Return the processor time of two clock readings [s]."""
    start = time.thread_time()
    for _ in range(1000):
        time.thread_time()
        time.thread_time()
    return (time.thread_time() - start) / 1000.0


def judge(case: Case, scene: Scene, poses: Floats, velocities: Floats) -> Floats:
    """Return the results of each block from the frames of a release.

    The energy is that in the first frame beyond the barrier.

    Parameters
    ----------
    poses, velocities : (T, N, 3) array
        x, y of the centroids [m] and rotation [rad], and their rates, every `FRAME` seconds.
    """
    mass, inertia = masses(scene)
    x = poses[:, :, 0]
    found = np.full((len(mass), 4), math.nan)
    found[:, MASS], found[:, RUN_OUT] = mass, x[-1]
    found[:, PAST] = (x >= case.site.road.start).any(axis=0)
    crossed = np.flatnonzero((x >= case.barrier).any(axis=0) & (x[0] < case.barrier))
    first = (x[:, crossed] >= case.barrier).argmax(axis=0)
    weight = np.stack([mass, mass, inertia], axis=1)[crossed]
    found[crossed, ENERGY] = 0.5e-3 * (weight * velocities[first, crossed] ** 2).sum(axis=1)
    return found


class Core:
    """The core of `rigdda`, with successive releases as in `rigdda.release_many`.

    Empty settings stand for those that the site derives for the blocks.
    """

    NAME = "rigdda"

    def __init__(self, case: Case, dt: float, settings: dict[str, Any]):
        self._case, self._dt, self._settings = case, dt, settings
        site = replace(case.site, motion=replace(case.site.motion, dt=dt))
        self._batch = Batch(site, ())

    def release(self, seed: int) -> Release:
        """Compute a release until all its blocks sleep.

        The processor time includes the set-up, the steps and the recording of frames, but not the
        cutting of the rock into blocks, which is the same for all engines.
        """
        scene = self._batch.scene(self._case.draw(seed))
        start = time.thread_time()
        if self._settings:
            simulation = Simulation(scene, Settings(dt=self._dt, **self._settings))
        else:
            simulation = self._batch.simulation(scene)
        run = simulation.run(self._case.site.motion.duration, FRAME)
        cpu = time.thread_time() - start
        return Release(judge(self._case, scene, run.poses, run.velocities), cpu)


class Peer:
    """Another engine from `experiments.bench.engines`, advanced step by step."""

    def __init__(self, module: ModuleType, case: Case, dt: float, options: dict[str, Any]):
        self._case, self._engine, self._dt, self._options = case, module.Engine, dt, options
        self._frames, self._clock = round(case.site.motion.duration / FRAME), clock()

    def release(self, seed: int) -> Release:
        """Compute a release until no block has moved since the last check.

        The processor time includes the set-up of the engine and its steps, but not the reading of
        poses.
        """
        scene = self._case.site.scene(self._case.draw(seed))
        stride = round(FRAME / self._dt)
        start = time.thread_time()
        run = self._engine(scene, self._dt, True, **self._options)
        cpu = time.thread_time() - start
        poses, velocities = [run.poses()], [run.velocities()]
        for frame in range(1, self._frames + 1):
            start = time.thread_time()
            run.advance(stride)
            cpu += time.thread_time() - start
            poses.append(run.poses())
            velocities.append(run.velocities())
            if frame % LOOK == 0 and np.abs(poses[-1] - poses[-1 - LOOK])[:, :2].max() < STILL:
                break
        cpu -= (len(poses) - 1) * self._clock
        return Release(judge(self._case, scene, np.array(poses), np.array(velocities)), cpu)


class Points:
    """The lumped-mass model.

    It is run a second time with the road at the barrier, for the energy there.
    """

    def __init__(self, case: Case):
        self._case = case
        self._at = replace(case.site, road=replace(case.site.road, start=case.barrier))

    def release(self, seed: int) -> Release:
        """Compute a release; its processor time includes the draw."""
        event, start = self._case.event(seed), time.thread_time()
        road = lumped(self._case.site, (), (seed,), event)
        cpu = time.thread_time() - start
        energy = 1e-3 * lumped(self._at, (), (seed,), event).energy
        return Release(np.stack([road.mass, road.reached, road.run_out, energy], 1), cpu)


def outcomes(releases: list[Release]) -> Floats:
    """Return debris share, 95 % run-out and 95 % energy of all releases together, (3,).

    The run-out is weighted by mass; the energy is a quantile over the blocks that reach the
    barrier.
    """
    blocks = np.concatenate([r.blocks for r in releases])
    mass = blocks[:, MASS]
    order = np.argsort(blocks[:, RUN_OUT])
    share = np.cumsum(mass[order]) / mass.sum()
    energy = blocks[:, ENERGY]
    energy = energy[~np.isnan(energy)]
    return np.array(
        [
            mass @ blocks[:, PAST] / mass.sum(),
            blocks[order, RUN_OUT][np.searchsorted(share, 0.95)],
            np.quantile(energy, 0.95) if len(energy) else 0.0,
        ]
    )
