"""Episodes a second of the environments: one copy, and batches as Stable-Baselines3 steps them.

Every batch plays 64 episodes or more (8 with --quick) of random actions on the site quick, of one
release each, at fidelity "fast"; no two batches share a seed, so that none finds what another has
simulated. Speed-up: episodes a second over those of one copy. `cores_busy`: processor time over
time, less than what is there if others compute as well. Writes throughput_envs.csv.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import click
import numpy as np

import envs
from envs.registration import ENVIRONMENTS
from experiments.script import folder, options, write

COPIES = (1, 8, 64)
EPISODES = 64


def play(env: Any, episodes: int) -> tuple[int, int]:
    """Play at least so many episodes; return how many, and the steps they took."""
    ended = steps = 0
    while ended < episodes:
        actions = np.stack([env.action_space.sample() for _ in range(env.num_envs)])
        _, _, done, _ = env.step(actions)
        ended, steps = ended + int(done.sum()), steps + env.num_envs
    return ended, steps


def measure(name: str, copies: int, episodes: int, seed: int) -> dict[str, Any]:
    """Return the row of one batch."""
    env = envs.sb3_vec_env(name, copies, site="quick", releases=1, fidelity="fast")
    env.seed(seed)
    env.action_space.seed(seed)
    env.reset()
    wall, cpu = time.perf_counter(), time.process_time()
    ended, steps = play(env, episodes)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    env.close()
    return {
        "environment": name,
        "copies": copies,
        "cores": os.cpu_count(),
        "episodes": ended,
        "steps": steps,
        "seconds": round(wall, 3),
        "episodes_per_second": round(ended / wall, 3),
        "steps_per_second": round(steps / wall, 3),
        "cores_busy": round(cpu / wall, 3),
    }


@click.command(help=__doc__)
@options
def main(quick: bool, out: Path | None) -> None:
    """Measure all batches and write the table."""
    measure("rigdda/BarrierPlacement-v0", 2, 4, 0)  # compiles
    rows: list[dict[str, Any]] = []
    for name in ENVIRONMENTS:
        one = None
        for copies in COPIES:
            row = measure(name, copies, 8 if quick else EPISODES, 100 * (len(rows) + 1))
            one = one or row["episodes_per_second"]
            rows.append(row | {"speed_up": round(row["episodes_per_second"] / one, 3)})
            click.echo(rows[-1])
    write(folder(quick, out) / "throughput_envs.csv", rows)


if __name__ == "__main__":
    main()
