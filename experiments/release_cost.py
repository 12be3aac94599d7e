"""Processor time per release in a batch, for one block or more, with and without barriers.

Releases are computed one after the other, as `rigdda.release_many` does in each of its threads: of
one block on every built-in design site and on `quick` with its own step, and of one block and of
more on `bench` with steps of 10, 5 and 2.5 ms. The time is split into the draw of the release
(draw), the simulation including its set-up and read-out (run), and the measurement (outcome).
Judged by the greatest median of the releases of one block with the sites' own steps.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from experiments.script import Number, main, say, write
from rigdda import Embankment, Fence, Layout, Site, sites
from rigdda.envs.envelope import largest
from rigdda.measurement import judge
from rigdda.releases import Batch

SITE, TARGET = "bench", 0.5
SITES = ("quick", *sites.design_names())
EVENTS = {"one block": "block", "group": "group", "slab": "slab"}
LAYOUTS: dict[str, Layout] = {
    "nothing": (),
    "fence": (Fence(31.0, 4.0, capacity=1e6),),
    "embankment": (Embankment(31.0, 1.5),),
}
PARTS = ("draw", "run", "outcome")
WARM = 20
"""Number of untimed releases at the start, in which everything shared is packed."""


def cost(site: Site, layout: Layout, event: str, releases: int) -> dict[str, float]:
    """Return the mean processor time of each part of a release [ms]."""
    batch = Batch(site, layout)
    seconds = np.zeros((releases, len(PARTS)))
    for seed in range(-WARM, releases):
        clock = [time.thread_time()]
        drawn = site.draw(seed % releases, event)
        clock.append(time.thread_time())
        ended = batch.ending(drawn)
        clock.append(time.thread_time())
        judge(site, ended, drawn.event, drawn.width)
        clock.append(time.thread_time())
        if seed >= 0:
            seconds[seed] = np.diff(clock)
    mean = 1e3 * seconds.mean(axis=0)
    median = 1e3 * float(np.median(seconds.sum(axis=1)))
    return dict(zip(PARTS, mean.tolist(), strict=True)) | {"all": mean.sum(), "median": median}


def with_step(site: Site, dt: float) -> Site:
    """Return a site with another time step [s]."""
    return msgspec.structs.replace(site, motion=msgspec.structs.replace(site.motion, dt=dt))


def of_one_block(site: Site) -> list[str]:
    """Return the events whose releases are single blocks."""
    return [name for name in site.event_names if largest(site, name) == 1]


def run(quick: bool, out: Path) -> Number:
    """Time releases and write the table."""
    bench = sites.load(SITE)
    cases: list[tuple[Site, str, str, dict[str, Layout]]] = [
        (site, "one block", name, {"nothing": ()})
        for site in map(sites.load, SITES)
        for name in of_one_block(site)
    ]
    for dt in (10e-3,) if quick else (10e-3, 5e-3, 2.5e-3):
        cases += [(with_step(bench, dt), what, name, LAYOUTS) for what, name in EVENTS.items()]
    rows, worst = [], -math.inf
    for site, what, event, layouts in cases:
        dt = site.motion.dt
        say(f"{site.name}: {event}, {1e3 * dt:g} ms")
        releases = (100 if quick else 1000) if what == "one block" else (5 if quick else 20)
        for name, layout in layouts.items():
            found = cost(site, layout, event, releases)
            row: dict[str, Any] = {
                "site": site.name, "release": what, "event": event, "layout": name,
                "dt_ms": 1e3 * dt, "releases": releases,
            }  # fmt: skip
            rows.append(row | {f"{k}_ms": v for k, v in found.items()})
            if what == "one block" and dt == sites.load(site.name).motion.dt:
                worst = max(worst, found["median"])
    write(out / "release_cost.csv", rows)
    return Number("processor time of a release of one block, median [ms]", worst, high=TARGET)


if __name__ == "__main__":
    main(run)
