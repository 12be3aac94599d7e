"""Throughput of episodes with 20 blocks on all cores: threads here, processes for the peer."""

from __future__ import annotations

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
"""Number of processes of the peer."""


@dataclass(frozen=True)
class Throughput:
    """Episodes per second of wall time and processor time per episode, medians of the rounds.

    An episode is loaded, stepped and recorded. If the cores are shared with other work, compare the
    processor times: `cpu_ratio` is that of this core over the peer's.
    """

    episodes: int
    rigdda_setting: str
    rigdda_per_second: float
    rigdda_cpu_s_per_episode: float
    peer_setting: str
    peer_per_second: float
    peer_cpu_s_per_episode: float
    ratio: float
    cpu_ratio: float


def episode(
    module: str, scene: Scene, duration: float, dt: float, options: dict[str, Any]
) -> tuple[np.ndarray, float]:
    """Run one episode in a peer; return its frames (T, N, 3) and its processor time [s]."""
    start = time.process_time()
    engine = adapter(module).Engine(scene, dt, True, **options)
    stride = max(1, round(FRAME / dt))
    poses = [engine.poses()]
    for _ in range(round(duration / dt) // stride):
        engine.advance(stride)
        poses.append(engine.poses())
    return np.array(poses), time.process_time() - start


def peer_rate(
    pool: Executor, scenes: list[Scene], duration: float, peer: Setting
) -> tuple[float, float]:
    """Return episodes per second and processor time per episode in running processes."""
    module = peer.engine.__name__.rpartition(".")[2]
    before = time.perf_counter()
    jobs = [
        pool.submit(episode, module, scene, duration, peer.dt, peer.options) for scene in scenes
    ]
    cpu = sum(job.result()[1] for job in jobs)
    return len(scenes) / (time.perf_counter() - before), cpu / len(scenes)


def core_rate(scenes: list[Scene], duration: float, dt: float) -> tuple[float, float]:
    """Return episodes per second of this core in threads and processor time per episode."""
    wall, cpu = time.perf_counter(), time.process_time()
    simulate_many(scenes, Settings(dt=dt), duration, FRAME)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    return len(scenes) / wall, cpu / len(scenes)


def measure(case: Case, core: Setting, peer: Setting, episodes: int, rounds: int) -> Throughput:
    """Measure both in turn, each with its cheapest setting that is accurate enough."""
    scenes = [case.scenes[i % len(case.scenes)] for i in range(episodes)]
    ours, theirs = [], []
    with ProcessPoolExecutor(WORKERS, get_context("spawn")) as pool:
        peer_rate(pool, scenes[: 2 * WORKERS], case.duration, peer)
        for _ in range(rounds):
            ours.append(core_rate(scenes, case.duration, core.dt))
            theirs.append(peer_rate(pool, scenes, case.duration, peer))
    (mine, my_cpu), (other, other_cpu) = (np.median(r, axis=0).tolist() for r in (ours, theirs))
    return Throughput(
        episodes,
        core.row(case).label,
        mine,
        my_cpu,
        peer.row(case).label,
        other,
        other_cpu,
        mine / other,
        my_cpu / other_cpu,
    )
