"""What comes down a site: energies, bounce heights and the deposit, without barriers or with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.crew import Job, Workers
from envs.memory import Memory, fingerprint
from rigdda import Layout, Run, Simulation, Site
from rigdda.geometry import polygon_properties

Floats = NDArray[np.float64]

STATIONS = 16
"""Stations across the barrier zone; 1 to 5 m apart, near the size of a wall."""

BINS = 16
"""Parts of the profile in which the deposit is counted, and one more beyond the road."""

QUANTILE = 0.95
"""Share of passing blocks below the envelope, the usual basis of a barrier's size."""

SEEDS = range(2**32, 2**32 + 4)
"""Releases behind an envelope. Environments score releases of seeds below 2**31 only."""


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """What passes and what is left, over some releases of a site.

    Parameters
    ----------
    energy : (STATIONS,) array
        95 % kinetic energy of the blocks that pass a station [J], 0 where none does.
    bounce : (STATIONS,) array
        95 % height of their centroids above the ground [m].
    deposit : (BINS + 1,) array
        Share of the released mass at the end in equal parts of the profile from the crest to the
        road's downhill edge, and beyond it; adds up to 1.
    """

    energy: Floats
    bounce: Floats
    deposit: Floats


class Transit(NamedTuple):
    """What passed in one release.

    `energy` [J] and `bounce` [m]: of each block's first passage of every station, STATIONS arrays;
    `deposit`: (BINS + 1,), see `Envelope`.
    """

    energy: list[Floats]
    bounce: list[Floats]
    deposit: Floats


memory: Memory[bytes, Envelope] = Memory(8192)
"""Envelopes without barriers by site, about 3 kB each."""


def stations(site: Site) -> Floats:
    """Return the chainages at which blocks are watched, (STATIONS,) [m]."""
    return np.linspace(site.barrier_zone.start, site.barrier_zone.end, STATIONS)


def envelope(site: Site) -> Envelope:
    """Return the barrier-free envelope of a site; simulated once a process and site.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    return barrier_free([site])[0]


def barrier_free(sites: Sequence[Site], workers: Workers | None = None) -> list[Envelope]:
    """Return the barrier-free envelope of every site; the unknown ones are simulated together.

    In threads over all cores, or in `workers`.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    keys = [fingerprint(site) for site in sites]
    known = memory.recall(keys)
    new = {key: site for key, site in zip(keys, sites, strict=True) if key not in known}
    found = standing([(site, (), SEEDS) for site in new.values()], workers)
    fresh = dict(zip(new, found, strict=True))
    memory.remember(fresh)
    known |= fresh
    return [known[key] for key in keys]


def standing(
    cases: Sequence[tuple[Site, Layout, Sequence[int]]], workers: Workers | None = None
) -> list[Envelope]:
    """Return the envelope of every case (site, layout, seeds).

    Simulated in threads over all cores, or in `workers`.

    Raises
    ------
    BadInput, Diverged
        As `rigdda.release` does.
    """
    jobs = [(site, layout, seed) for site, layout, seeds in cases for seed in seeds]
    with nullcontext(workers) if workers else ThreadPoolExecutor() as pool:
        transits = pool.map(_transit, jobs)
        return [_summary(list(islice(transits, len(seeds)))) for _, _, seeds in cases]


def _transit(job: Job) -> Transit:
    """Simulate a release and return what passed."""
    site, layout, seed = job
    lines = stations(site).tolist()
    simulation = Simulation(site.realise(layout, seed), site.settings(), lines)
    run = simulation.run(site.motion.duration, site.motion.duration)
    passing = [run.crossings(i) for i in range(STATIONS)]
    energy, bounce = ([p[name] for p in passing] for name in ("energy", "height"))
    return Transit(energy, bounce, _deposit(site, run))


def _summary(transits: Sequence[Transit]) -> Envelope:
    """Return the envelope of some releases of a site."""

    def quantiles(name: str) -> Floats:
        parts = zip(*(getattr(transit, name) for transit in transits), strict=True)
        return np.array([_quantile(np.concatenate(part)) for part in parts])

    deposit = np.mean([transit.deposit for transit in transits], axis=0)
    out = Envelope(quantiles("energy"), quantiles("bounce"), deposit)
    for array in (out.energy, out.bounce, out.deposit):
        array.setflags(write=False)
    return out


def _quantile(values: Floats) -> float:
    """Return what `np.quantile` gives, in a thirtieth of its time; 0 of no values."""
    if not len(values):
        return 0.0
    ordered, (part, below) = np.sort(values), math.modf(QUANTILE * (len(values) - 1))
    low, high = ordered[int(below) : int(below) + 2][[0, -1]].tolist()
    return float(low + part * (high - low))


def _deposit(site: Site, run: Run) -> Floats:
    """Return the share of a run's mass in each part of the profile and beyond, (BINS + 1,)."""
    edges = np.linspace(site.slope.points[0][0], site.road.end, BINS + 1)
    part = np.searchsorted(edges[1:], run.poses[-1, :, 0])
    mass = [b.density * polygon_properties(b.vertices)[0] for b in run.scene.blocks]
    weight = np.bincount(part, mass, BINS + 1)
    return weight / weight.sum()
