"""What passes each chainage of a site without barriers: what several designers look at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import Simulation, Site
from rigdda.agents.protocol import Ledger
from rigdda.agents.seeds import release_seeds
from rigdda.geometry import polygon_properties

Floats = NDArray[np.float64]

RELEASES = 60
"""Releases of an event in an ensemble: three of them are beyond the 95 % quantile."""
SHARE = 16
"""The ensemble takes at most one part in so many of a budget."""

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
        ("volume", "f8"),
    ]
)
"""The first crossing of a station by a block. time: since the release [s]; height: of the centroid
above the ground [m]; radius: circumscribed, about the centroid [m]; speed [m/s]; energy of
translation and rotation [J], mass [kg] and volume [m3]: of the block over its width."""


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """Crossings of R barrier-free releases.

    Parameters
    ----------
    stations : (K,) array
        Chainages across the barrier zone [m].
    crossings : (E,) structured array
        Those at stations, see `CROSSING`; station K is the road's uphill edge.
    event : (R,) array of int
        Which event of the site a release is of.
    width : (R,) array
        Width of each release [m].
    """

    stations: Floats
    crossings: NDArray[np.void]
    event: NDArray[np.int64]
    width: Floats

    def at(self, station: int) -> NDArray[np.void]:
        """Return the crossings of one station."""
        return self.crossings[self.crossings["station"] == station]

    def of(self, events: Sequence[int]) -> NDArray[np.void]:
        """Return the crossings of some events."""
        return self.crossings[np.isin(self.event[self.crossings["release"]], events)]

    def reach_road(self) -> NDArray[np.bool_]:
        """Return for each crossing whether its block reaches the road, (E,)."""
        block = self.crossings["release"].astype(np.int64) << 32 | self.crossings["block"]
        road = self.crossings["station"] == len(self.stations)
        return np.isin(block, block[road])

    def weights(self, rates: Sequence[float]) -> Floats:
        """Return how often each release stands for, (R,) [1/year per m], from rates of events."""
        count = np.bincount(self.event, minlength=len(rates))
        return np.array(rates)[self.event] / np.maximum(count, 1)[self.event]


def ensemble_seeds(site: Site, seed: int, simulations: int) -> dict[str, tuple[int, ...]]:
    """Return the release seeds by event of the ensemble for a search of so many simulations."""
    names = site.event_names
    each = min(RELEASES, max(1, simulations // (SHARE * len(names))))
    few = names[: max(1, simulations // SHARE)]
    return {name: release_seeds("ensemble", seed, each) for name in few}


def ensemble_for(ledger: Ledger, stations: Floats) -> Ensemble:
    """Return the ensemble that a designer looks at, charged to its budget."""
    seeds = ensemble_seeds(ledger.problem.site, ledger.seed, ledger.budget)
    ledger.used += sum(map(len, seeds.values()))
    return ensemble(ledger.problem.site, seeds, stations)


def ensemble(site: Site, seeds: Mapping[str, Sequence[int]], stations: Floats) -> Ensemble:
    """Return the crossings of barrier-free releases, simulated over all cores in threads.

    The last few ensembles are kept in memory.

    Parameters
    ----------
    seeds : mapping of str to sequence of int
        Release seeds by name of event.
    stations : (K,) array
        Chainages to watch, ascending [m].

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    asked = tuple((name, tuple(drawn)) for name, drawn in seeds.items())
    return _ensemble(msgspec.json.encode(site), asked, tuple(np.asarray(stations).tolist()))


@lru_cache(maxsize=4)
def _ensemble(
    text: bytes, seeds: tuple[tuple[str, tuple[int, ...]], ...], stations: tuple[float, ...]
) -> Ensemble:
    site = msgspec.json.decode(text, type=Site)
    lines = (*stations, site.road.start)
    jobs = [(name, seed) for name, drawn in seeds for seed in drawn]

    def one(job: tuple[int, tuple[str, int]]) -> tuple[NDArray[np.void], float]:
        release, (event, seed) = job
        scene = site.realise((), seed, event)
        width = site.draw(seed, event).width
        duration = site.motion.duration
        run = Simulation(scene, site.settings(scene), lines).run(duration, every=duration)
        area, radius = np.array([_area_and_radius(b.vertices) for b in scene.blocks]).T
        density = np.array([b.density for b in scene.blocks])
        out = np.zeros(len(run.events), dtype=CROSSING)
        out["release"] = release
        out["station"], out["block"] = run.events["target"], run.events["block"]
        for name in ("time", "height", "speed"):
            out[name] = run.events[name]
        out["energy"] = run.events["energy"] * width
        out["radius"], out["volume"] = radius[out["block"]], area[out["block"]] * width
        out["mass"] = density[out["block"]] * out["volume"]
        return out, width

    with ThreadPoolExecutor() as pool:
        parts = list(pool.map(one, enumerate(jobs)))
    crossings, widths = zip(*parts, strict=True)
    number = {name: i for i, name in enumerate(site.event_names)}
    event = np.array([number[name] for name, _ in jobs])
    return Ensemble(np.array(stations), np.concatenate(crossings), event, np.array(widths))


def _area_and_radius(vertices: NDArray[np.float64]) -> tuple[float, float]:
    """Return area [m2] and circumscribed radius about the centroid [m] of an (n, 2) polygon."""
    area, centre, _ = polygon_properties(vertices)
    return area, float(np.hypot(*(vertices - centre).T).max())
