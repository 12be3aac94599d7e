"""What passes each chainage of a site without barriers: what `rule` and `convex` look at."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache

import msgspec
import numpy as np
from numpy.typing import NDArray

from agents.protocol import Ledger
from agents.seeds import release_seeds
from rigdda import Fence, Simulation, Site
from rigdda.geometry import polygon_properties

RELEASES = 16
"""Releases of an ensemble. Some 100 blocks in each make over 1,000 crossings a station."""
STATIONS = 40
"""Stations of the barrier zone."""

CROSSING = np.dtype(
    [
        ("release", "i4"),
        ("station", "i4"),
        ("block", "i4"),
        ("time", "f8"),
        ("height", "f8"),
        ("radius", "f8"),
        ("speed", "f8"),
        ("energy", "f8"),
        ("mass", "f8"),
    ]
)
"""The first crossing of a station by a block. time: since the release [s]; height: of the centroid
above the ground [m]; radius: circumscribed, about the centroid [m]; speed [m/s]; energy of
translation and rotation [J]; mass per metre of slope width [kg/m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """Crossings of R barrier-free releases.

    Parameters
    ----------
    stations : (K,) array
        Chainages across the barrier zone [m], where the uphill face of a wall may stand.
    crossings : (E,) structured array
        Those at stations, see `CROSSING`; station K is the road's uphill edge.
    mass : (R,) array
        Released mass [kg/m].
    radius : float
        Mean circumscribed radius of the blocks [m].
    """

    stations: NDArray[np.float64]
    crossings: NDArray[np.void]
    mass: NDArray[np.float64]
    radius: float

    def at(self, station: int) -> NDArray[np.void]:
        """Return the crossings of one station."""
        return self.crossings[self.crossings["station"] == station]

    def reach_road(self) -> NDArray[np.bool_]:
        """Return for each crossing whether its block reaches the road, (E,)."""
        block = self.crossings["release"].astype(np.int64) << 32 | self.crossings["block"]
        road = self.crossings["station"] == len(self.stations)
        return np.isin(block, block[road])


def ensemble_seeds(seed: int, simulations: int) -> tuple[int, ...]:
    """Return the release seeds of the ensemble for a search of so many simulations."""
    return release_seeds("ensemble", seed, min(RELEASES, max(1, simulations // 8)))


def ensemble_for(ledger: Ledger) -> Ensemble:
    """Return the ensemble that a designer looks at, charged to its budget."""
    seeds = ensemble_seeds(ledger.seed, ledger.budget)
    ledger.used += len(seeds)
    return ensemble(ledger.problem.site, seeds)


def ensemble(site: Site, seeds: Sequence[int]) -> Ensemble:
    """Return the crossings of barrier-free releases, simulated over all cores in threads.

    The last few ensembles are kept in memory.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    return _ensemble(msgspec.json.encode(site), tuple(seeds))


@lru_cache(maxsize=4)
def _ensemble(text: bytes, seeds: tuple[int, ...]) -> Ensemble:
    site = msgspec.json.decode(text, type=Site)
    zone = site.barrier_zone
    fence = Fence(zone.start, zone.max_height, zone.max_capacity)
    extent = max(zone.min_thickness, fence.extent)  # whatever is built fits at the last station
    stations = np.linspace(zone.start, zone.end - extent, STATIONS)
    lines = (*stations.tolist(), site.road.start)

    def one(job: tuple[int, int]) -> tuple[NDArray[np.void], float, float]:
        release, seed = job
        scene = site.realise((), seed)
        run = Simulation(scene, site.settings(), lines).run(site.motion.duration)
        mass, radius = np.array([_mass_and_radius(b.vertices, b.density) for b in scene.blocks]).T
        out = np.zeros(len(run.events), dtype=CROSSING)
        out["release"], out["station"], out["block"] = (
            release,
            run.events["target"],
            run.events["block"],
        )
        out["time"], out["height"] = run.events["time"], run.events["height"]
        out["radius"], out["mass"] = radius[out["block"]], mass[out["block"]]
        out["speed"], out["energy"] = run.events["speed"], run.events["energy"]
        return out, float(mass.sum()), float(radius.mean())

    with ThreadPoolExecutor() as pool:
        parts = list(pool.map(one, enumerate(seeds)))
    crossings, mass, radius = zip(*parts, strict=True)
    return Ensemble(stations, np.concatenate(crossings), np.array(mass), float(np.mean(radius)))


def _mass_and_radius(vertices: NDArray[np.float64], density: float) -> tuple[float, float]:
    """Return mass [kg/m] and circumscribed radius about the centroid [m] of an (n, 2) polygon."""
    area, centre, _ = polygon_properties(vertices)
    return density * area, float(np.hypot(*(vertices - centre).T).max())
