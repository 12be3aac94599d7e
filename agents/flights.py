"""Releases as pictures need them: the way of every block, how high and how hard it comes by."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import Layout, Run, Simulation, Site
from rigdda.agents.wording import standing
from rigdda.geometry import polygon_properties

Floats = NDArray[np.float64]

QUANTILE = 0.95
"""Of the envelopes."""

LEAST = 20
"""Blocks that must come by for a 95 % quantile to say anything."""

BLOCKS = 60
"""Blocks of an event that are looked at, in whole releases."""

STATIONS = 60
"""Chainages of an envelope."""

EVERY = 0.05
"""Interval of the points of a way [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Flights:
    """Releases of one event.

    Parameters
    ----------
    event : str
        Its name.
    releases : int
        How many.
    ways : tuple of (n, 2) array
        Where the centroid of each block was [m].
    run : Run
        The first release.
    stations : (K,) array
        Chainages of the envelopes [m], ascending.
    height : (K,) array
        95 % quantile of how high above the ground the tops of blocks come by, as centroid and
        circumscribed radius [m]; NaN where less than 20 come by.
    energy : (K,) array
        The same of their energy, of translation and rotation [J], each as wide as the root of its
        area.
    """

    event: str
    releases: int
    ways: tuple[Floats, ...]
    run: Run
    stations: Floats
    height: Floats
    energy: Floats


def fly(site: Site, layout: Layout, event: str, seeds: Sequence[int], stations: Floats) -> Flights:
    """Simulate releases of an event, over all cores in threads.

    Of the seeds the first are taken, until `BLOCKS` blocks have come down.

    Raises
    ------
    BadInput
        If the layout does not stand on the slope.
    Diverged
        If a simulation diverges.
    """
    barriers = standing(layout)
    first = _run(site, barriers, event, seeds[0], stations)
    more = seeds[1 : max(1, -(-BLOCKS // len(first.scene.blocks)))]
    with ThreadPoolExecutor() as pool:
        rest = pool.map(lambda seed: _run(site, barriers, event, seed, stations), more)
        runs = [first, *rest]
    height, energy = _envelopes(runs, len(stations))
    ways = tuple(run.poses[:, i, :2] for run in runs for i in range(run.poses.shape[1]))
    return Flights(event, len(runs), ways, first, stations, height, energy)


def _run(site: Site, layout: Layout, event: str, seed: int, stations: Floats) -> Run:
    scene = site.realise(layout, seed, event)
    simulation = Simulation(scene, site.settings(scene), tuple(stations.tolist()))
    return simulation.run(site.motion.duration, EVERY)


def stations_of(site: Site) -> Floats:
    """Return the chainages of the envelopes: from the highest source to the road's far edge [m]."""
    left = max(site.slope.points[0][0], min(start for start, _ in map(reach, sources(site))))
    return np.linspace(left, site.road.end, STATIONS + 1)[1:]


def sources(site: Site) -> list[Floats]:
    """Return the corners of each source [m]: closed, or the ground in a band."""
    ground, out = site.profile, []
    for source in site.sources:
        if source.band is None:
            pieces = (np.array(piece, dtype=np.float64) for _, piece in source.pieces())
            out += [np.concatenate([piece, piece[:1]]) for piece in pieces]
        else:
            start, end = source.band
            x = [start, *(x for x, _ in site.slope.points if start < x < end), end]
            out.append(np.array([(at, ground.height(at)) for at in x]))
    return out


def reach(corners: Floats) -> tuple[float, float]:
    """Return the least and the greatest chainage of corners [m]."""
    return float(corners[:, 0].min()), float(corners[:, 0].max())


def _envelopes(runs: Sequence[Run], stations: int) -> tuple[Floats, Floats]:
    """Return the 95 % quantiles of heights [m] and of energies [J] at each station."""
    height, energy = np.full(stations, np.nan), np.full(stations, np.nan)
    sizes = [np.array([_size(block.vertices) for block in run.scene.blocks]) for run in runs]
    for k in range(stations):
        tops, works = [], []
        for run, size in zip(runs, sizes, strict=True):
            crossed = run.crossings(k)
            radius, width = size[crossed["block"]].T
            tops.append(crossed["height"] + radius)
            works.append(crossed["energy"] * width)
        if sum(map(len, tops)) >= LEAST:
            height[k] = np.quantile(np.concatenate(tops), QUANTILE)
            energy[k] = np.quantile(np.concatenate(works), QUANTILE)
    return height, energy


def _size(vertices: Floats) -> tuple[float, float]:
    """Return a block's circumscribed radius about its centroid and the root of its area [m]."""
    area, centre, _ = polygon_properties(vertices)
    return float(np.hypot(*(vertices - centre).T).max()), float(np.sqrt(area))
