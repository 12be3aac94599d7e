"""Episodes a second of the environments: one copy, and batches as Stable-Baselines3 steps them.

Every batch plays 64 episodes or more (8 with --quick) of random actions on the site quick, of one
release each, at fidelity "fast", in threads and in as many processes as there are cores; no two
batches share a seed, so that none finds what another has simulated. Speed-up: episodes a second
over those of one copy, which plays last as well as first. Writes throughput_envs.csv.
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

BATCHES = ((1, False), (8, False), (64, False), (8, True), (64, True), (1, False))
"""Copies, and whether they are simulated in processes."""

EPISODES = 64


def play(env: Any, episodes: int) -> tuple[int, int]:
    """Play at least so many episodes; return how many, and the steps they took."""
    ended = steps = 0
    while ended < episodes:
        actions = np.stack([env.action_space.sample() for _ in range(env.num_envs)])
        _, _, done, _ = env.step(actions)
        ended, steps = ended + int(done.sum()), steps + env.num_envs
    return ended, steps


def measure(
    name: str, copies: int, processes: int | None, episodes: int, seed: int
) -> dict[str, Any]:
    """Return the row of one batch; in processes the first step, which starts them, counts not."""
    env = envs.sb3_vec_env(
        name, copies, site="quick", releases=1, fidelity="fast", processes=processes
    )
    env.seed(seed)
    env.action_space.seed(seed)
    env.reset()
    play(env, copies)
    wall = time.perf_counter()
    ended, steps = play(env, episodes)
    wall = time.perf_counter() - wall
    env.close()
    return {
        "environment": name,
        "copies": copies,
        "processes": processes or 0,
        "cores": os.cpu_count(),
        "episodes": ended,
        "steps": steps,
        "seconds": round(wall, 3),
        "episodes_per_second": round(ended / wall, 3),
        "steps_per_second": round(steps / wall, 3),
    }


@click.command(help=__doc__)
@options
def main(quick: bool, out: Path | None) -> None:
    """Measure all batches and write the table."""
    measure("rigdda/BarrierPlacement-v0", 2, None, 4, 0)  # compiles
    rows: list[dict[str, Any]] = []
    for name in ENVIRONMENTS:
        batches = []
        for copies, crew in BATCHES:
            workers = os.cpu_count() if crew else None
            seed = 1000 * (len(rows) + len(batches) + 1)
            batches.append(measure(name, copies, workers, 8 if quick else EPISODES, seed))
            click.echo(batches[-1])
        one = np.mean([row["episodes_per_second"] for row in batches if row["copies"] == 1])
        rows += [row | {"speed_up": round(row["episodes_per_second"] / one, 3)} for row in batches]
    write(folder(quick, out) / "throughput_envs.csv", rows)


if __name__ == "__main__":
    main()
