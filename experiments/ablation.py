"""Cost of each part of the mechanics: parts switched off, and idle parts added.

Rockfalls down the highway slope are simulated. The parts that save time or improve accuracy
(islands, sleeping, post-correction) are switched off one by one. Of the optional parts of a scene
(bolts, loads, cohesion, base motion, barriers), one without effect is added. The processor time is
relative to that of the unchanged scene in the same round; the greatest penetration shows the effect
on contacts.

Judged by the most expensive idle part: if even a part that is present without effect is cheap, then
an absent part costs nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from msgspec.structs import replace as changed

from experiments.bench.cases import rockfall_scene
from experiments.script import BLUE, GREY, RED, Number, draw, main, say, write
from rigdda import Bolt, Fence, PointLoad, Scene, Settings, Simulation, Wall

IDLE = 1.25
"""Target for the cost of an idle part over that of the unchanged scene [-]; rounds scatter by some
per cent."""


class Part(NamedTuple):
    """A variant: changes of the scene and of the settings."""

    name: str
    group: str
    scene: Callable[[Scene], Scene] = lambda scene: scene
    settings: Callable[[Settings], Settings] = lambda settings: settings


def _bolt(scene: Scene) -> Scene:
    x, y = scene.blocks[0].vertices.mean(axis=0)
    return replace(scene, supports=(Bolt(0, (x, y), None, (x, y + 200.0), 1e-3),))


def _load(scene: Scene) -> Scene:
    return replace(scene, loads=(PointLoad(0, scene.blocks[0].vertices.mean(axis=0), (1e-3, 0.0)),))


def _cohesion(scene: Scene) -> Scene:
    bonded = {name: changed(s, cohesion=1e-9) for name, s in scene.surfaces.items()}
    return replace(scene, surfaces=bonded)


def _motion(scene: Scene) -> Scene:
    return replace(scene, base_motion=((0.0, 0.0, 0.0), (100.0, 0.0, 0.0)))


AS_IT_IS = Part("as it is", "")

PARTS = (
    AS_IT_IS,
    Part("no islands", "switched off", settings=lambda s: replace(s, islands=False)),
    Part("no sleep", "switched off", settings=lambda s: replace(s, sleeping=False)),
    Part("no correction", "switched off", settings=lambda s: replace(s, post_correction=False)),
    Part("a bolt", "idle", _bolt),
    Part("a load", "idle", _load),
    Part("cohesion", "idle", _cohesion),
    Part("base motion", "idle", _motion),
    Part("a wall", "idle", lambda s: replace(s, barriers=(Wall(150.0, 2.0),))),
    Part("a fence", "idle", lambda s: replace(s, barriers=(Fence(150.0, 2.0, 1e6),))),
)


def measure(part: Part, scene: Scene, duration: float) -> tuple[float, float]:
    """Return processor time over simulated time [-] and the greatest penetration [m]."""
    settings = part.settings(Settings())
    sim = Simulation(part.scene(scene), settings)
    start = time.process_time()
    sim.step(round(duration / settings.dt))
    return (time.process_time() - start) / duration, sim.diagnostics.penetration


def rows(blocks: int, releases: int, duration: float) -> list[dict[str, object]]:
    """Return a row for each part, with medians over the releases."""
    found: dict[str, list[tuple[float, float, float]]] = {part.name: [] for part in PARTS}
    measure(AS_IT_IS, rockfall_scene(blocks, 1), 0.05)  # compile the kernels
    for seed in range(1, releases + 1):
        say(f"release {seed} of {releases}")
        scene, base = rockfall_scene(blocks, seed), 0.0
        for part in PARTS:
            cpu, depth = measure(part, scene, duration)
            base = base or cpu
            found[part.name].append((cpu, cpu / base, depth))
    return [
        {"part": part.name, "group": part.group}
        | dict(
            zip(
                ("cpu_per_second", "over_as_it_is", "penetration"),
                np.median(found[part.name], axis=0).tolist(),
                strict=True,
            )
        )
        for part in PARTS
    ]


def picture(figure: Figure, table: list[dict[str, object]]) -> None:
    """Draw the cost of each part over that of the unchanged scene."""
    axes = figure.subplots()
    colours = {"": GREY, "switched off": RED, "idle": BLUE}
    for place, row in enumerate(table):
        cost = float(str(row["over_as_it_is"]))
        axes.barh(place, cost, color=colours[str(row["group"])])
        axes.text(cost, place, f" {cost:.2f}", va="center")
    axes.set_yticks(range(len(table)), [f"{row['part']}" for row in table])
    axes.invert_yaxis()
    axes.axvline(1.0, color=GREY, linewidth=1.0)
    axes.set_xlabel("processor time over that of the scene as it is\nred: switched off, blue: idle")


def run(quick: bool, out: Path) -> Number:
    """Write ablation.csv and ablation.png."""
    blocks, releases, duration = (30, 3, 10.0) if quick else (120, 5, 25.0)
    table = rows(blocks, releases, duration)
    write(out / "ablation.csv", table)
    draw(out / "ablation.png", (8.0, 5.0), lambda figure: picture(figure, table))
    dearest = max(float(str(r["over_as_it_is"])) for r in table if r["group"] == "idle")
    return Number("cost of the most expensive idle part over the plain scene", dearest, high=IDLE)


if __name__ == "__main__":
    main(run)
