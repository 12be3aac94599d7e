"""Episodes per second of the environments, and the variance of their reward.

Batches as Stable-Baselines3 steps them play at least 256 episodes (16 with --quick) of random
actions with one release each, in threads on all cores. No two batches share a seed, so that none
finds the cached outcomes of another. The site is quick with its groups and its jointed mass, or
with single blocks only. Corridors have twelve sections of the validation split without large
masses, and four releases of each section.

Variance: of the reward of one release relative to the site's mean without barriers, compared with
that relative to the same release without barriers, as before; means over random layouts, and for
the best of them, on quick and on generated sites. Writes throughput_envs.csv and
reward_variance.csv.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import click
import msgspec
import numpy as np

import rigdda.envs
from experiments.script import folder, options, write
from experiments.search_gain import problems_of
from rigdda import Layout, Site, sites
from rigdda.envs import DesignProblem
from rigdda.envs.environments import Ask, simulate

BATCHES = (1, 8, 64, 1)
"""Number of copies in each batch; a single copy is measured twice."""

EPISODES = 256

DESIGN_ENVIRONMENTS = ("rigdda/BarrierDesign-v0", "rigdda/BarrierPlacement-v0")

LAYOUTS, SAMPLES, SITES = 8, 128, 6
"""Number of random layouts per site, of episodes per layout, and of generated sites."""


def places() -> dict[str, Site]:
    """Return the sites: quick, and quick with single blocks only."""
    quick = sites.load("quick")
    single = tuple(e for e in quick.events if e.area is not None and e.number == (1, 1))
    used = {event.source for event in single}
    rock = tuple(source for source in quick.sources if source.name in used)
    alone = msgspec.structs.replace(
        quick, name="quick, blocks", sources=rock, events=single, meshes=()
    )
    return {"quick": quick, "quick, single blocks": alone}


CORRIDOR = "rigdda/Corridor-v0"

SECTIONS, RELEASES = 12, 4
"""Number of sections of a corridor, and of releases of each."""


def sections() -> tuple[Site, ...]:
    """Return the first sites of the validation split whose events have fewer than 100 blocks."""
    found = problems_of(SECTIONS, sites.split("validation"))
    return tuple(problem.site for problem in found)


def play(env: Any, episodes: int) -> tuple[int, int]:
    """Play at least this number of episodes; return the number of episodes and of steps."""
    ended = steps = 0
    while ended < episodes:
        actions = np.stack([env.action_space.sample() for _ in range(env.num_envs)])
        _, _, done, _ = env.step(actions)
        ended, steps = ended + int(done.sum()), steps + env.num_envs
    return ended, steps


def measure(
    name: str, site: Site | tuple[Site, ...], copies: int, episodes: int, seed: int
) -> dict[str, Any]:
    """Return the measurements of one batch."""
    releases = RELEASES if name == CORRIDOR else 1
    env = rigdda.envs.sb3_vec_env(name, copies, site=site, releases=releases)
    env.seed(seed)
    env.action_space.seed(seed)
    env.reset()
    play(env, copies)
    wall, busy = time.perf_counter(), time.process_time()
    ended, steps = play(env, episodes)
    wall, busy = time.perf_counter() - wall, time.process_time() - busy
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
        "episodes_per_processor_second": round(ended / busy, 3),
    }


def throughput(episodes: int) -> list[dict[str, Any]]:
    """Return the rows of all batches."""
    measure("rigdda/BarrierPlacement-v0", places()["quick"], 2, 4, 0)  # compile the kernels
    rows: list[dict[str, Any]] = []
    for label, site in places().items():
        for name in DESIGN_ENVIRONMENTS:
            for copies in BATCHES:
                seed = 1000 * (len(rows) + 1)
                row = {"site": label} | measure(name, site, copies, episodes, seed)
                rows.append(row)
                click.echo(row)
    for copies in BATCHES:
        seed, few = 1000 * (len(rows) + 1), -(-episodes // SECTIONS)
        row = {"site": "validation"} | measure(CORRIDOR, sections(), copies, few, seed)
        rows.append(row)
        click.echo(row)
    return rows


def rewards(problem: DesignProblem, layout: Layout, seeds: range) -> np.ndarray:
    """Return the rewards of a layout in episodes of one release."""
    asks = [Ask(problem, layout, (seed,), 0) for seed in seeds]
    answers = [answer.evaluation for answer in simulate(asks) if answer is not None]
    return np.array([problem.reward(found) for found in answers if found is not None])


def variance(name: str, layouts: int, samples: int) -> dict[str, Any]:
    """Return the variances of the reward at a site."""
    problem, rng = DesignProblem(name), np.random.default_rng(0)
    drawn: list[Layout] = []
    while len(drawn) < layouts:
        layout = problem.decode(rng.uniform(*problem.bounds))
        drawn += [layout] if layout else []
    free = rewards(problem, (), range(samples))
    fixed = [rewards(problem, layout, range(samples)) for layout in drawn]
    now = np.array([reward.var(ddof=1) for reward in fixed])
    before = np.array([(reward - free).var(ddof=1) for reward in fixed])
    best = int(np.argmax([reward.mean() for reward in fixed]))
    row = {
        "site": name,
        "layouts": layouts,
        "episodes": samples,
        "variance": round(float(now.mean()), 4),
        "variance_same_release": round(float(before.mean()), 4),
        "ratio": round(float(now.mean() / before.mean()), 3),
        "ratio_best_layout": round(float(now[best] / before[best]), 3),
        "reward_best_layout": round(float(fixed[best].mean()), 3),
    }
    click.echo(row)
    return row


@click.command(help=__doc__)
@options
def main(quick: bool, out: Path | None) -> None:
    """Run all measurements and write the tables."""
    to, names = folder(quick, out), ["quick", *sites.split("test")[:SITES]]
    write(to / "throughput_envs.csv", throughput(16 if quick else EPISODES))
    layouts, samples = (2, 8) if quick else (LAYOUTS, SAMPLES)
    some = names[:1] if quick else names
    write(to / "reward_variance.csv", [variance(name, layouts, samples) for name in some])


if __name__ == "__main__":
    main()
