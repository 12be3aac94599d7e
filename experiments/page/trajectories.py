"""Time until the trajectories of single blocks are known after a barrier has moved.

For each event of single blocks on each built-in site, `rigdda.trajectories` computes 25 and 200
releases from nothing but the site, without barriers and with a fence, whose place differs each
time. Elapsed times are those of an idle machine only; the processor time over the number of threads
is a lower bound that does not depend on other work. Judged by the longest elapsed time of 200
releases.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

import rigdda
from experiments.script import Number, main, say, write
from rigdda import Fence, Layout, Site, distribution, sites
from rigdda.envs.envelope import largest
from rigdda.trajectory import Trajectories

FIRST, ALL = 25, 200
"""Numbers of releases."""

LONGEST = {FIRST: 200.0, ALL: 1000.0}
"""Longest elapsed times on two idle cores [ms]."""


def layout(site: Site, repeat: int) -> Layout:
    """Return a fence near the downhill end of the barrier zone, at a new place for each repeat."""
    return (Fence(site.barrier_zone.end - 0.5 - 0.01 * repeat, 3.0, energy_class=500),)


def timed(
    site: Site, barriers: Layout, event: str, releases: int
) -> tuple[Trajectories, float, float]:
    """Return trajectories, the elapsed time and the processor time per thread [ms]."""
    start, cpu = time.perf_counter(), time.process_time()
    found = rigdda.trajectories(site, barriers, event, range(releases))
    threads = distribution.threads()
    elapsed, used = time.perf_counter() - start, time.process_time() - cpu
    return found, 1e3 * elapsed, 1e3 * used / threads


def row(site: Site, event: str, fenced: bool, repeats: int) -> dict[str, Any]:
    """Return the medians of the times of an event."""
    out: dict[str, Any] = {"site": site.name, "event": event, "fence": int(fenced)}
    for releases in (FIRST, ALL):
        times = []
        for repeat in range(repeats):
            barriers = layout(site, repeat) if fenced else ()
            found, *spent = timed(site, barriers, event, releases)
            times.append(spent)
        elapsed, used = np.median(times, axis=0)
        out |= {f"elapsed_{releases}_ms": elapsed, f"processor_{releases}_ms": used}
    return out | {"points_per_path": len(found.x) / len(found)}


def run(quick: bool, out: Path) -> Number:
    """Time the trajectories and write the table."""
    rigdda.trajectories(sites.load("quick"), (), "block", range(4))  # kernels are compiled
    rows = []
    for name in ("quick", *sites.design_names()):
        site = sites.load(name)
        for event in site.event_names:
            if largest(site, event) > 1:
                continue
            say(f"{name}: {event}")
            rows += [row(site, event, fenced, 1 if quick else 5) for fenced in (False, True)]
    write(out / "page_trajectories.csv", rows)
    worst = {n: max(float(r[f"elapsed_{n}_ms"]) for r in rows) for n in LONGEST}
    used = max(float(r[f"processor_{ALL}_ms"]) for r in rows)
    note = f"first {FIRST}: {worst[FIRST]:.0f} ms, target at most {LONGEST[FIRST]:g}; "
    note += f"processor time per thread of {ALL}: {used:.0f} ms"
    what = f"longest time for the trajectories of {ALL} single blocks [ms]"
    return Number(what, worst[ALL], high=LONGEST[ALL], note=note)


if __name__ == "__main__":
    main(run)
