"""Processor time per release in a batch, for one block or more, with and without barriers.

Releases of the design site `bench` are computed one after the other, as `rigdda.release_many` does
in each of its threads, with steps of 10, 5 and 2.5 ms. The time is split into the draw of the
release (draw), the simulation including its set-up and read-out (run), and the measurement
(outcome).
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
from rigdda.measurement import judge
from rigdda.releases import Batch

SITE, TARGET = "bench", 0.5
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


def run(quick: bool, out: Path) -> Number:
    """Time releases and write the table."""
    site, rows, worst = sites.load(SITE), [], -math.inf
    for dt in (10e-3,) if quick else (10e-3, 5e-3, 2.5e-3):
        timed = msgspec.structs.replace(site, motion=msgspec.structs.replace(site.motion, dt=dt))
        for what, event in EVENTS.items():
            say(f"{what}, {1e3 * dt:g} ms")
            releases = (100 if quick else 1000) if what == "one block" else (5 if quick else 20)
            for name, layout in LAYOUTS.items():
                found = cost(timed, layout, event, releases)
                row: dict[str, Any] = {"release": what, "layout": name, "dt_ms": 1e3 * dt}
                rows.append(row | {"releases": releases} | {f"{k}_ms": v for k, v in found.items()})
                if what == "one block" and dt == site.motion.dt:
                    worst = max(worst, found["median"])
    write(out / "release_cost.csv", rows)
    return Number("processor time of a release of one block, median [ms]", worst, high=TARGET)


if __name__ == "__main__":
    main(run)
