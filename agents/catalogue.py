"""What every barrier of the menu is estimated to be worth, from one barrier-free ensemble.

The blocks that a barrier stops are taken out, as far as they would reach the road; what becomes of
the others behind it is not known, so the simulation has the last word. A block is stopped by

- a fence, if its centroid is below the top, until the energies of what the fence stopped exceed its
  capacity, see `rigdda.Fence.for_width`;
- a wall or an embankment, if its centroid is below the top. A gravity wall that slides by `SLID`
  under a plastic impact must be mended;
- a ditch, if it lands in it and does not leap out with the energy that is left: `BOUNCE` of it;
- mesh, as often as its factor says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Ditch, Embankment, Fence, GravityWall, Mesh, Site, Wall
from rigdda.agents.crossings import Ensemble
from rigdda.agents.menu import Menu
from rigdda.barriers.base import ELEMENT
from rigdda.barriers.fence import PANEL
from rigdda.barriers.gravity_wall import SLID
from rigdda.envs import DesignProblem

Floats = NDArray[np.float64]

GRAVITY = 9.81
"""Acceleration of free fall [m/s2]."""
BASE = 0.6
"""Friction of its base [-]."""
BOUNCE = 0.2
"""Share of the energy that a block keeps when it lands in a ditch: assumed."""


@dataclass(frozen=True, slots=True, eq=False)
class Catalogue:
    """Numbers of what may be built: R releases, J barriers.

    Parameters
    ----------
    barriers : list of J barriers
        Those that may be built.
    weight : (R,) array
        How often what a release stands for happens [1/year per m].
    base : (R,) array
        Harm of a release without barriers [EUR].
    relief : (R, J) array
        What a barrier takes off it [EUR].
    annual : (J,) array
        What a barrier costs a year, its expected repair included [EUR per m].
    span : (J, 2) array
        Chainages between which it stands [m].
    """

    barriers: list[Barrier]
    weight: Floats
    base: Floats
    relief: Floats
    annual: Floats
    span: Floats

    @property
    def objective(self) -> Floats:
        """Estimated Z of each barrier alone, (J,) [EUR per m and year]."""
        return self.annual + self.weight @ (self.base[:, None] - self.relief)

    def take(self, chosen: Sequence[int] | NDArray[np.int64]) -> Catalogue:
        """Return the catalogue of some barriers."""
        i = np.asarray(chosen, dtype=np.int64)
        barriers = [self.barriers[j] for j in i.tolist()]
        relief, annual = self.relief[:, i], self.annual[i]
        return Catalogue(barriers, self.weight, self.base, relief, annual, self.span[i])


def tabulate(problem: DesignProblem, ensemble: Ensemble, barriers: list[Barrier]) -> Catalogue:
    """Return the catalogue of barriers that a problem allows."""
    site = problem.site
    weight = ensemble.weights([site.rate(name, ()) for name in site.event_names])
    effects = Effects(site, ensemble)
    relief = np.zeros((len(weight), len(barriers)))
    annual = np.zeros(len(barriers))
    for j, barrier in enumerate(barriers):
        harm, mended = effects.of(barrier)
        relief[:, j] = effects.base - harm
        capital = site.capital((barrier,)) if mended.any() else 0.0
        annual[j] = site.annual((barrier,)) + capital * float(weight @ mended)
    span = np.array([[b.x, b.x + b.extent] for b in barriers]).reshape(-1, 2)
    return Catalogue(barriers, weight, effects.base, relief, annual, span)


def whole(problem: DesignProblem, ensemble: Ensemble, menu: Menu) -> Catalogue:
    """Return the catalogue of everything on a menu."""
    barriers = [b for kind in problem.kinds for b in menu.lone(kind)]
    return tabulate(problem, ensemble, barriers)


class Effects:
    """What single barriers do to the releases of an ensemble."""

    def __init__(self, site: Site, ensemble: Ensemble):
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
        self.base = self._harm(self._volume)

    def of(self, barrier: Barrier) -> tuple[Floats, Floats]:
        """Return harm [EUR] and length of barrier to be mended [m] of every release, each (R,)."""
        if isinstance(barrier, Mesh):
            site = self.site
            factor = [site.rate(name, (barrier,)) / max(site.rate(name, ()), 1e-300)
                      for name in site.event_names]  # fmt: skip
            return self.base * np.array(factor)[self.ensemble.event], np.zeros_like(self.base)
        k = int(np.argmin(np.abs(self.ensemble.stations - barrier.x)))
        table, risky = self._at[k], self._risky[k]
        stopped, broken = self._stopped(barrier, table)
        volume = table["volume"] * (stopped & risky)
        taken = np.bincount(table["release"], volume, minlength=len(self.base))
        left = self._volume - taken
        gone = left <= 1e-9 * self._volume
        harm = self._harm(np.where(gone, 0.0, left).astype(np.float64))
        failed = np.bincount(table["release"], broken, minlength=len(self.base)) > 0
        mended: Floats = np.where(failed, np.maximum(self.ensemble.width, barrier.repaired), 0.0)
        return harm, mended

    def _stopped(self, barrier: Barrier, table: NDArray[np.void]) -> tuple[Any, Any]:
        """Return which crossings a barrier stops, and which break it, each (E,) of bool."""
        none = np.zeros(len(table), dtype=bool)
        if isinstance(barrier, Ditch):
            return self._lands(barrier, table), none
        assert isinstance(barrier, Fence | GravityWall | Embankment | Wall)
        low = table["height"] <= barrier.height
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
        """Return which crossings end in a ditch: they fall into it, and do not leap out."""
        fall = np.maximum(table["height"] - table["radius"], 0.0) + ditch.depth
        lands = table["speed"] * np.sqrt(2.0 * fall / GRAVITY) <= ditch.width
        leap = BOUNCE * table["speed"] ** 2 / (2.0 * GRAVITY)
        return lands & (leap <= ditch.depth)

    def _harm(self, volume: Floats) -> Floats:
        """Return the harm of volumes on the road, 0 of none [EUR]."""
        harms = self.site.consequences.harm(volume, True)  # type: ignore[arg-type]  # by element
        return np.where(volume > 0.0, harms, 0.0)


def _sums(release: NDArray[np.int32], values: Floats) -> Floats:
    """Return the running sum of values within each release; they are in order."""
    total = np.cumsum(values)
    first = np.searchsorted(release, release)
    return total - total[first] + values[first]
