"""Episodes of 20 blocks a second on all cores: threads here, two processes for the peer."""

from __future__ import annotations

import os
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np

from experiments.bench.cases import Case
from experiments.bench.engines import adapter
from experiments.bench.timing import Setting
from rigdda import Scene, Settings, simulate_many

FRAME = 0.05
"""Interval of recorded frames [s]."""

WORKERS = 2
"""Processes and threads."""


@dataclass(frozen=True)
class Throughput:
    """Episodes a second of wall time, median and best of the rounds, with what each ran.

    `busy_cores`: processor time over wall time of this core's rounds; below `cores`, others were at
    work on the machine, or threads waited for one another.
    """

    cores: int
    episodes: int
    rigdda_setting: str
    rigdda_per_second: float
    rigdda_best: float
    busy_cores: float
    peer_setting: str
    peer_per_second: float
    peer_best: float
    ratio: float


def episode(
    module: str, scene: Scene, duration: float, dt: float, options: dict[str, Any]
) -> np.ndarray:
    """Run one episode in a peer and return its frames (T, N, 3)."""
    engine = adapter(module).Engine(scene, dt, True, **options)
    stride = max(1, round(FRAME / dt))
    poses = [engine.poses()]
    for _ in range(round(duration / dt) // stride):
        engine.advance(stride)
        poses.append(engine.poses())
    return np.array(poses)


def peer_rate(pool: Executor, scenes: list[Scene], duration: float, peer: Setting) -> float:
    """Return the episodes a second of a peer in a pool of processes that has started."""
    module = peer.engine.__name__.rpartition(".")[2]
    before = time.perf_counter()
    jobs = [
        pool.submit(episode, module, scene, duration, peer.dt, peer.options) for scene in scenes
    ]
    for job in jobs:
        job.result()
    return len(scenes) / (time.perf_counter() - before)


def core_rate(scenes: list[Scene], duration: float, dt: float) -> float:
    """Return the episodes a second of this core in threads."""
    before = time.perf_counter()
    simulate_many(scenes, Settings(dt=dt), duration, FRAME)
    return len(scenes) / (time.perf_counter() - before)


def measure(case: Case, core: Setting, peer: Setting, episodes: int, rounds: int) -> Throughput:
    """Measure both in turn, each at its cheapest setting that is accurate enough."""
    scenes = [case.scenes[i % len(case.scenes)] for i in range(episodes)]
    ours, theirs, busy = [], [], []
    with ProcessPoolExecutor(WORKERS, get_context("spawn")) as pool:
        peer_rate(pool, scenes[: 2 * WORKERS], case.duration, peer)
        for _ in range(rounds):
            before = time.perf_counter(), time.process_time()
            ours.append(core_rate(scenes, case.duration, core.dt))
            busy.append((time.process_time() - before[1]) / (time.perf_counter() - before[0]))
            theirs.append(peer_rate(pool, scenes, case.duration, peer))
    mine, other = float(np.median(ours)), float(np.median(theirs))
    return Throughput(
        os.cpu_count() or 1,
        episodes,
        f"1/{1.0 / core.dt:.0f} s",
        mine,
        max(ours),
        float(np.median(busy)),
        f"{peer.engine.NAME} 1/{1.0 / peer.dt:.0f} s {peer.options}",
        other,
        max(theirs),
        mine / other,
    )
