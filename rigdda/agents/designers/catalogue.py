"""Estimates of the effect of every barrier of the menu from releases without barriers.

The ensemble of these releases records all blocks that pass each station. Several designers use it.
The list of designers is `rigdda.agents.designers.DESIGNERS`.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda import (
    BadInput,
    Barrier,
    Ditch,
    Fence,
    GravityWall,
    Mesh,
    Simulation,
    Site,
    check,
    distribution,
)
from rigdda.agents.designers.menu import Menu
from rigdda.barriers import Removal
from rigdda.barriers.base import ELEMENT
from rigdda.barriers.fence import PANEL
from rigdda.barriers.gravity_wall import SLID
from rigdda.envs import DesignProblem
from rigdda.envs.outcome_cache import Memory, release_key
from rigdda.envs.problem import checked_seeds
from rigdda.geometry import polygon_properties
from rigdda.seeds import release_seeds

Floats = NDArray[np.float64]


ENSEMBLE_RELEASES = 60
"""Number of releases of an event in an ensemble; three of them exceed the 95 % quantile."""
ENSEMBLE_DIVISOR = 16
"""The ensemble uses at most this fraction (1 / ENSEMBLE_DIVISOR) of a budget."""

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
"""Record of the first crossing of a station by a block. time: since the release [s]; height: of the
centroid above the ground [m]; radius: circumscribed about the centroid [m]; speed [m/s]; energy: of
translation and rotation [J]; mass [kg]; volume [m3]. Energy, mass and volume are those of the block
over the width of its release."""


@dataclass(frozen=True, slots=True, eq=False)
class CrossingEnsemble:
    """Crossings of R releases without barriers.

    Parameters
    ----------
    stations : (K,) array
        Chainages of the stations in the barrier zone [m].
    crossings : (E,) structured array
        Crossings of the stations, see `CROSSING`. Station K is the uphill edge of the road.
    event : (R,) array of int
        Index of the event of each release.
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
        """Return the rate that each release represents, (R,) [1/year per m], from event rates."""
        count = np.bincount(self.event, minlength=len(rates))
        return np.array(rates)[self.event] / np.maximum(count, 1)[self.event]


def ensemble_seeds(site: Site, seed: int, simulations: int) -> dict[str, tuple[int, ...]]:
    """Return the release seeds of an ensemble by event for a search with a given budget."""
    names = site.event_names
    each = min(ENSEMBLE_RELEASES, max(1, simulations // (ENSEMBLE_DIVISOR * len(names))))
    few = names[: max(1, simulations // ENSEMBLE_DIVISOR)]
    return {name: release_seeds("ensemble", seed, each) for name in few}


def ensemble(site: Site, seeds: Mapping[str, Sequence[int]], stations: Floats) -> CrossingEnsemble:
    """Simulate releases without barriers in threads on all cores and return their crossings.

    The last four ensembles are kept in memory.

    Parameters
    ----------
    site : Site
        The site.
    seeds : mapping of str to sequence of int
        Release seeds by name of event, at least one in all. The seeds of an event are distinct.
    stations : (K,) array
        Chainages of the stations, ascending [m].

    Raises
    ------
    BadInput
        If there is no such event, or the seeds or the stations are invalid.
    Diverged
        If a simulation diverges.
    """
    jobs = _jobs(site, seeds)
    places = tuple(np.asarray(stations).tolist())
    key = release_key(site), site.standing(), jobs, places
    found = memory.recall([key]).get(key)
    if found is None:
        found = _simulate(site, jobs, places)
        memory.remember({key: found})
    return found


memory: Memory[tuple[Hashable, ...], CrossingEnsemble] = Memory(4)
"""Ensembles by what affects their releases, the releases and the stations."""


def seeds_by_event(seeds: Mapping[str, Sequence[int]]) -> dict[str, tuple[int, ...]]:
    """Return the release seeds of each event as a tuple of distinct whole numbers.

    Raises
    ------
    BadInput
        If they are not a mapping of such seeds.
    """
    given = check.mapping("seeds", seeds, object, "sequences of whole numbers")
    return {name: checked_seeds(f"seeds[{name!r}]", drawn, 0) for name, drawn in given.items()}


def _jobs(site: Site, seeds: Mapping[str, Sequence[int]]) -> tuple[tuple[str, int], ...]:
    """Return the event and the seed of each release, which are at least one and all distinct."""
    jobs: list[tuple[str, int]] = []
    for name, drawn in seeds_by_event(seeds).items():
        site.event(name)
        jobs += [(name, seed) for seed in drawn]
    if not jobs:
        raise BadInput("seeds", dict(seeds), "give at least one seed of an event")
    return tuple(jobs)


def _simulate(
    site: Site, jobs: Sequence[tuple[str, int]], stations: Sequence[float]
) -> CrossingEnsemble:
    """Simulate releases without new barriers, given by event and seed."""
    lines = (*stations, site.road.start)

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

    with ThreadPoolExecutor(distribution.threads()) as pool:
        parts = list(pool.map(one, enumerate(jobs)))
    crossings, widths = zip(*parts, strict=True)
    number = {name: i for i, name in enumerate(site.event_names)}
    event = np.array([number[name] for name, _ in jobs])
    return CrossingEnsemble(np.array(stations), np.concatenate(crossings), event, np.array(widths))


def _area_and_radius(vertices: NDArray[np.float64]) -> tuple[float, float]:
    """Return the area [m2] and the circumscribed radius [m] of an (n, 2) polygon."""
    area, centre, _ = polygon_properties(vertices)
    return area, float(np.hypot(*(vertices - centre).T).max())


GRAVITY = 9.81
"""Acceleration of free fall [m/s2]."""
BASE = 0.6
"""Coefficient of friction at the base of a gravity wall [-]."""
BOUNCE = 0.2
"""Fraction of its energy that a block keeps when it lands in a ditch [-]; an assumption."""


@dataclass(frozen=True, slots=True, eq=False)
class Catalogue:
    """Estimated effects of J barriers in R releases.

    Parameters
    ----------
    barriers : list of J barriers
        Barriers that may be built.
    weight : (R,) array
        Rate that each release represents [1/year per m].
    base : (R,) array
        Harm of each release without barriers [EUR].
    relief : (R, J) array
        Reduction of the harm of each release by each barrier [EUR].
    annual : (J,) array
        Annual cost of each barrier including its expected repair, in addition to `standing`
        [EUR per m and year].
    capital : (J,) array
        Capital cost of each barrier [EUR per m].
    span : (J, 2) array
        Chainages of the start and the end of each barrier [m].
    standing : float
        Upkeep of the existing barriers [EUR per m and year].
    """

    barriers: list[Barrier]
    weight: Floats
    base: Floats
    relief: Floats
    annual: Floats
    capital: Floats
    span: Floats
    standing: float

    @property
    def nothing(self) -> float:
        """Estimated Z without barriers [EUR per m and year]."""
        return self.standing + float(self.weight @ self.base)

    @property
    def objective(self) -> Floats:
        """Estimated Z of each barrier alone, (J,) [EUR per m and year]."""
        left: Floats = self.weight @ (self.base[:, None] - self.relief)
        return self.standing + (self.annual + left)

    def take(self, chosen: Sequence[int] | NDArray[np.int64]) -> Catalogue:
        """Return the catalogue of the barriers with the given indices."""
        i = np.asarray(chosen, dtype=np.int64)
        barriers = [self.barriers[j] for j in i.tolist()]
        own = self.relief[:, i], self.annual[i], self.capital[i], self.span[i]
        return Catalogue(barriers, self.weight, self.base, *own, self.standing)


def tabulate(
    problem: DesignProblem, ensemble: CrossingEnsemble, barriers: list[Barrier]
) -> Catalogue:
    """Return the catalogue of some barriers of a problem."""
    site = problem.site
    weight = ensemble.weights([site.rate(name, ()) for name in site.event_names])
    effects, standing = Effects(site, ensemble), site.annual(())
    relief = np.zeros((len(weight), len(barriers)))
    annual, capital = np.zeros((2, len(barriers)))
    for j, barrier in enumerate(barriers):
        harm, mended = effects.of(barrier)
        relief[:, j] = effects.base - harm
        capital[j] = site.capital((barrier,))
        repair = capital[j] * float(weight @ mended)
        annual[j] = site.annual((barrier,)) - standing + repair
    span = np.array([[b.x, b.x + b.extent] for b in barriers]).reshape(-1, 2)
    return Catalogue(barriers, weight, effects.base, relief, annual, capital, span, standing)


def whole(problem: DesignProblem, ensemble: CrossingEnsemble, menu: Menu) -> Catalogue:
    """Return the catalogue of all barriers of a menu."""
    barriers = [b for kind in problem.kinds for b in menu.singles(kind)]
    return tabulate(problem, ensemble, barriers)


class Effects:
    """Estimates of the effects of single barriers on the releases of an ensemble."""

    def __init__(self, site: Site, ensemble: CrossingEnsemble):
        self.site, self.ensemble = site, ensemble
        count = len(ensemble.event)
        order = np.lexsort((ensemble.crossings["time"], ensemble.crossings["release"]))
        table, risky = ensemble.crossings[order], ensemble.reach_road()[order]
        stations = range(len(ensemble.stations))
        self._at = [table[table["station"] == k] for k in stations]
        self._risky = [risky[table["station"] == k] for k in stations]
        road = ensemble.at(len(ensemble.stations))
        volume = np.bincount(road["release"], road["volume"], minlength=count)
        self._volume = volume.astype(np.float64)
        self._energy = np.zeros(count)  # largest energy of a block at the road [J]
        np.maximum.at(self._energy, road["release"], road["energy"])
        self.base = self.harm(self._volume)

    def at(self, station: int) -> NDArray[np.void]:
        """Return the crossings of a station, sorted by release and time."""
        return self._at[station]

    def of(self, barrier: Barrier) -> tuple[Floats, Floats]:
        """Return the harm [EUR] and the length of barrier to repair [m] of each release, (R,)."""
        if isinstance(barrier, Mesh):
            site = self.site
            factor = [site.rate(name, (barrier,)) / max(site.rate(name, ()), 1e-300)
                      for name in site.event_names]  # fmt: skip
            return self.base * np.array(factor)[self.ensemble.event], np.zeros_like(self.base)
        if isinstance(barrier, Removal):  # what else it changes is left to the simulation
            return self.base, np.zeros_like(self.base)
        k = int(np.argmin(np.abs(self.ensemble.stations - barrier.x)))
        table, risky = self._at[k], self._risky[k]
        stopped, broken = self.stopped(barrier, table)
        volume = table["volume"] * (stopped & risky)
        taken = np.bincount(table["release"], volume, minlength=len(self.base))
        left = self._volume - taken
        gone = left <= 1e-9 * self._volume
        harm = self.harm(np.where(gone, 0.0, left).astype(np.float64))
        failed = np.bincount(table["release"], broken, minlength=len(self.base)) > 0
        mended: Floats = np.where(failed, np.maximum(self.ensemble.width, barrier.repaired), 0.0)
        return harm, mended

    def stopped(self, barrier: Barrier, table: NDArray[np.void]) -> tuple[Any, Any]:
        """Return which crossings a barrier stops and which break it, two (E,) arrays of bool."""
        none = np.zeros(len(table), dtype=bool)
        if isinstance(barrier, Ditch):
            return self._lands(barrier, table), none
        low = table["height"] <= barrier.left_height(0.0)
        width = self.ensemble.width[table["release"]]
        if isinstance(barrier, Fence):
            assert barrier.energy_class is not None
            capacity = 1e3 * barrier.energy_class * width / np.minimum(width, PANEL)
            stands = _sums(table["release"], table["energy"] * low) <= capacity
            return low & stands, low & ~stands
        if isinstance(barrier, GravityWall):
            wall = barrier.density * barrier.height * barrier.thickness
            mass = wall * np.maximum(width, ELEMENT)
            speed = table["mass"] * table["speed"] / (table["mass"] + mass)
            return low, low & (speed**2 > 2.0 * BASE * GRAVITY * SLID)
        return low, none

    def _lands(self, ditch: Ditch, table: NDArray[np.void]) -> Any:
        """Return which crossings end in a ditch: the block lands in it and does not bounce out."""
        fall = np.maximum(table["height"] - table["radius"], 0.0) + ditch.depth
        lands = table["speed"] * np.sqrt(2.0 * fall / GRAVITY) <= ditch.width
        leap = BOUNCE * table["speed"] ** 2 / (2.0 * GRAVITY)
        return lands & (leap <= ditch.depth)

    def harm(self, volume: Floats) -> Floats:
        """Return the harm of volumes on the road [EUR], which is 0 for a volume of 0."""
        harms: Any = self.site.consequences.harm(volume, True)  # type: ignore[arg-type]  # by element
        traffic, width = self.site.traffic, self.ensemble.width
        if traffic is not None:
            expected = traffic.consequences(True, True, width, volume, self._energy)
            harms = harms + traffic.price(expected.fatalities)
        return np.where(volume > 0.0, harms, 0.0)


def _sums(release: NDArray[np.int32], values: Floats) -> Floats:
    """Return the running sum of values within each release; the releases are sorted."""
    total = np.cumsum(values)
    first = np.searchsorted(release, release)
    return total - total[first] + values[first]
