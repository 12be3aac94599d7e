"""Regression test of outcomes that a change of structure must preserve bit for bit.

`python -m experiments.outcomes` computes a fixed set of releases, layouts, scenes and episodes, and
compares a digest of each with the recorded one (`results/outcomes/outcomes.csv`). It lists the
differences and exits with 1 if there are any. `--record` records the current digests, and the
numbers of `experiments.short_outcomes`. Results that have changed need another version of the
mechanics (`rigdda.MECHANICS`): they are not recorded with the one that the record has.

The digests include all bits and are therefore specific to one type of machine.
"""

from __future__ import annotations

import csv
import hashlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click
import gymnasium
import numpy as np

import rigdda.envs  # noqa: F401  registers the environments
from experiments import short_outcomes
from experiments.made_by import made_by
from experiments.script import RESULTS, say, write
from rigdda import (
    MECHANICS,
    Bolt,
    Ditch,
    Embankment,
    Fence,
    FixedPoint,
    GravityWall,
    Layout,
    Simulation,
    Site,
)
from rigdda.envs import DesignProblem
from rigdda.model.settings import Settings
from rigdda.releases import Batch
from rigdda.validation.case import Case, evaluate
from rigdda.validation.suite import CASES

TABLE = Path("outcomes/outcomes.csv")
"""Recorded digests, relative to the folder of results."""

LAYOUTS: dict[str, tuple[tuple[str, Layout], ...]] = {
    "shu-hwa": (
        ("nothing", ()),
        ("fence and ditch", (Fence(51.9, 2.0, energy_class=250), Ditch(83.1, 3.0, 5.0))),
    ),
    "talus": (("nothing", ()), ("embankment", (Embankment(82.0, 3.0, 1.5),))),
    "quick": (
        ("gravity wall", (GravityWall(31.0, 2.0, 1.0),)),
        ("ditch", (Ditch(29.5, 1.0, 4.0),)),
    ),
}
"""Layouts of the releases, by site."""

RELEASES = {"mass": 1, "group": 4}
"""Number of releases of an event, by the prefix of its name."""
SINGLES = 40
"""Number of releases of all other events."""

CASE_NAMES = (
    "slide-35-34-2s", "joints-35-20", "joint-shear", "16-gon", "tipping", "restitution-0.5",
    "eccentric-hits", "collisions-many", "crest-blocks", "thin-wall-10ms", "wall-slides",
    "wall-overturns", "fence-train", "fence-eccentric", "fence-thrust", "stack-50", "pyramid-55",
    "mass-1-1000", "pin-swing", "bolt-drop", "arch-falls", "toppling-forces", "toppling-modes",
)  # fmt: skip
"""Cases of `rigdda.validation` that are included."""

COSTS, EPISODES = 60, 50
"""Number of random layouts of `quick` whose cost is computed, and of episodes per environment."""

SOLVERS = ("pcg", "block-pcg", "sor", "direct")


def digest(*parts: Any) -> str:
    """Return a digest of arrays and of any objects with a `repr`."""
    whole = hashlib.sha256()
    for part in parts:
        whole.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
    return whole.hexdigest()[:16]


def outcomes_of(site: Site, layout: Layout, event: str) -> str:
    """Return the digest of the outcomes of the first releases of an event."""
    batch = Batch(site, layout)
    releases = next((n for name, n in RELEASES.items() if event.startswith(name)), SINGLES)
    return digest(*(batch.outcome(seed, event) for seed in range(releases)))


def motion_of(**settings: Any) -> str:
    """Return the digest of the state of the first mass release of `quick` after 4 s."""
    scene = Site.load("quick").realise((), 1, "mass")
    simulation = Simulation(scene, Settings(dt=1e-2, **settings))
    simulation.step(400)
    return digest(simulation.poses, simulation.velocities, simulation.energy())


def motion_with_supports() -> str:
    """Return the digest of the mass of `quick` after 4 s, with a bolt and a fixed point."""
    scene = Site.load("quick").realise((), 1, "mass")
    (x, y), last = (scene.blocks[i].vertices.mean(axis=0) for i in (0, -1))
    bolt = Bolt(0, (x, y), None, (x, y + 30.0), 1e6)
    held = replace(scene, supports=(bolt, FixedPoint(len(scene.blocks) - 1, last)))
    simulation = Simulation(held, Settings(dt=1e-2))
    simulation.step(400)
    return digest(simulation.poses, simulation.velocities, simulation.supports())


def episodes_of(name: str) -> str:
    """Return the digest of episodes of an environment with random actions."""
    env = gymnasium.make(name, site="quick")
    found: list[Any] = []
    env.action_space.seed(3)
    for episode in range(EPISODES):
        found.append(env.reset(seed=episode)[0])
        ended = False
        while not ended:
            observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
            found += [observation, reward, info.get("objective")]
            ended = terminated or truncated
    env.close()
    flat = [v for o in found for v in (o.values() if isinstance(o, dict) else [o])]
    return digest(*flat)


def costs_of(site: Site) -> str:
    """Return the digest of the costs of random layouts."""
    problem = DesignProblem(site)
    low, high = problem.bounds
    random = np.random.default_rng(5)
    layouts = [problem.decode(random.uniform(low, high)) for _ in range(COSTS)]
    found = [problem.evaluate(layout, range(12)) for layout in layouts]
    return digest(*((layout, e.objective) for layout, e in zip(layouts, found, strict=True)))


def case_of(case: Case) -> str:
    """Return the digest of the results of a closed-form case."""
    return digest(*(str(result) for result in evaluate(case)))


def computed() -> Iterator[tuple[str, Callable[[], str]]]:
    """Yield the name of every computation and the function that returns its digest."""
    for name, layouts in LAYOUTS.items():
        site = Site.load(name)
        for words, layout in layouts:
            for event in site.event_names:
                what = f"releases of {name}, {words}, {event}"
                yield what, partial(outcomes_of, site, layout, event)
    for solver in SOLVERS:
        yield f"motion with solver {solver}", partial(motion_of, solver=solver)
    yield "motion in static mode", partial(motion_of, mode="static")
    yield "motion without post-correction", partial(motion_of, post_correction=False)
    yield "motion with a bolt and a fixed point", motion_with_supports
    yield "motion as one island", partial(motion_of, islands=False, sleeping=False)
    for case in CASES:
        if case.name in CASE_NAMES:
            yield f"case {case.name}", partial(case_of, case)
    yield f"cost of {COSTS} layouts of quick", partial(costs_of, Site.load("quick"))
    for name in ("rigdda/BarrierDesign-v0", "rigdda/BarrierPlacement-v0"):
        yield f"{EPISODES} episodes of {name}", partial(episodes_of, name)


def recorded(out: Path) -> dict[str, str]:
    """Return the recorded digests, empty without a record."""
    path = out / TABLE
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {row["what"]: row["digest"] for row in csv.DictReader(file)}


@click.command(help=__doc__)
@click.option("--record", "records", is_flag=True, help="Record the current outcomes.")
@click.option("--out", type=click.Path(path_type=Path), default=RESULTS, show_default=True,
              help="Folder of results.")  # fmt: skip
def main(records: bool, out: Path) -> None:
    """Compute and compare the digests, or record them."""
    before, rows, other = recorded(out), [], []
    for what, call in computed():
        found = call()
        rows.append({"what": what, "digest": found})
        same = found == before.get(what, found)
        if not same:
            other.append(what)
        say(f"{found} {what}{'' if same else ': differs from the record'}")
    click.echo(f"{len(other)} of {len(rows)} differ from the record")
    if other and made_by((out / TABLE).parent).get(TABLE.name) == MECHANICS:
        mend = f"change rigdda.MECHANICS, which is {MECHANICS!r}, and then record the outcomes"
        raise click.ClickException(mend)
    if records:
        write(out / TABLE, rows)
        short_outcomes.record(out)
        return
    sys.exit(bool(other))


if __name__ == "__main__":
    main()
