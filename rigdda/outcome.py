"""What a release means for the road."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda.geometry import polygon_properties
from rigdda.run import Run
from rigdda.scene import Wall
from rigdda.site import Site

GRAIN = 2.0**40
"""Fractions are whole multiples of 1/GRAIN, so that they add up to 1 exactly in any order."""


@dataclass(frozen=True, slots=True)
class BarrierOutcome:
    """What one barrier took in a release.

    Parameters
    ----------
    hits : int
        Hits, counted anew after 0.1 s apart.
    max_energy, total_energy : float
        Largest and summed energy of the hits, of translation and rotation just before the first
        touch [J].
    absorbed_energy : float
        Work that contact forces of the barrier took from the blocks [J].
    impact_heights : tuple of float
        Height of each hit above the ground at the barrier's face [m].
    overtopped : int
        Blocks that started uphill of the barrier and were downhill of it at some time.
    failed : bool
        Whether it failed; a rigid wall never does.
    """

    hits: int
    max_energy: float
    total_energy: float
    absorbed_energy: float
    impact_heights: tuple[float, ...]
    overtopped: int
    failed: bool


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a release means for the road.

    Parameters
    ----------
    released_mass : float
        Mass of all blocks that could move [kg per metre of width].
    debris_fraction : float
        Share of the released mass whose centroid ever passed the uphill edge of the road, in the
        air included: what the reward measures.
    debris_on_road : float
        Area of the blocks whose centroid is on the road at the end [m2].
    max_energy_on_road : float
        Largest kinetic energy of a block over the road [J].
    run_out : tuple of float
        Chainages that 50, 95 and 100 % of the mass have not passed at the end [m].
    slope_fraction, held_fraction, road_fraction, beyond_fraction : float
        Where the mass is at the end, by centroid; they add up to 1 exactly. Held: uphill of a
        barrier that stands and below the line that rises uphill from its top at the angle of
        friction, the steepest surface of a deposit that leans on it.
    barriers : tuple of BarrierOutcome
        One for each barrier of the layout.
    """

    released_mass: float
    debris_fraction: float
    debris_on_road: float
    max_energy_on_road: float
    run_out: tuple[float, float, float]
    slope_fraction: float
    held_fraction: float
    road_fraction: float
    beyond_fraction: float
    barriers: tuple[BarrierOutcome, ...]


def stations(site: Site, layout: Sequence[Wall]) -> tuple[float, ...]:
    """Return the ascending chainages at which a release must be watched for its outcome [m]."""
    return tuple(sorted({site.road.start, *(b.x + b.thickness for b in layout)}))


def watch(site: Site) -> tuple[float, float]:
    """Return the interval of x in which energies are watched: the road [m]."""
    return site.road.start, site.road.end


def measure(site: Site, run: Run) -> Outcome:
    """Return the outcome of a run that watched `stations` and `watch` of its site and layout."""
    scene = run.scene
    area, weight, mass = _masses(run)
    lines = stations(site, scene.barriers)
    passed = {
        line: np.isin(np.arange(len(area)), run.crossings(i)["block"])
        for i, line in enumerate(lines)
    }
    x, y = run.poses[-1, :, 0], run.poses[-1, :, 1]
    beyond = x > site.road.end
    road = (x >= site.road.start) & ~beyond
    held = _held(run, x, y) & ~road & ~beyond

    def share(where: NDArray[np.bool_]) -> float:
        return float(weight[where].sum() / GRAIN)

    return Outcome(
        released_mass=mass,
        debris_fraction=share(passed[site.road.start]),
        debris_on_road=float(area[road].sum()),
        max_energy_on_road=float(run.watch_energy.max()),
        run_out=_run_out(x, weight),
        slope_fraction=share(~(held | road | beyond)),
        held_fraction=share(held),
        road_fraction=share(road),
        beyond_fraction=share(beyond),
        barriers=tuple(
            _barrier(run, i, passed[b.x + b.thickness]) for i, b in enumerate(scene.barriers)
        ),
    )


def _masses(run: Run) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return areas, whole-number weights that add up to GRAIN, and the released mass."""
    blocks = run.scene.blocks
    area = np.array([polygon_properties(b.vertices)[0] for b in blocks])
    mass = np.array([0.0 if b.fixed else b.density for b in blocks]) * area
    weight = np.floor(mass / mass.sum() * GRAIN)
    weight[np.argmax(weight)] += GRAIN - weight.sum()
    return area, weight, math.fsum(mass)


def _run_out(x: NDArray[np.float64], weight: NDArray[np.float64]) -> tuple[float, float, float]:
    order = np.argsort(x)
    reached = np.cumsum(weight[order]) / GRAIN
    at = [x[order][np.searchsorted(reached, q)] for q in (0.5, 0.95, 1.0)]
    return float(at[0]), float(at[1]), float(at[2])


def _held(run: Run, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    scene = run.scene
    held = np.zeros(len(x), dtype=bool)
    rise = math.tan(math.radians(min(s.friction_deg for s in scene.surfaces.values())))
    for barrier in scene.barriers:
        assert scene.terrain is not None
        top = barrier.outline(scene.terrain)[:, 1].max()
        held |= (x < barrier.x) & (y < top + rise * (barrier.x - x))
    return held


def _barrier(run: Run, index: int, passed: NDArray[np.bool_]) -> BarrierOutcome:
    hits = run.hits(index)
    uphill = run.poses[0, :, 0] < run.scene.barriers[index].x
    return BarrierOutcome(
        hits=len(hits),
        max_energy=float(hits["energy"].max(initial=0.0)),
        total_energy=math.fsum(hits["energy"]),
        absorbed_energy=float(run.absorbed[index]),
        impact_heights=tuple(float(h) for h in hits["height"]),
        overtopped=int((passed & uphill).sum()),
        failed=False,
    )
