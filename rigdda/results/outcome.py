"""What a release means for the road."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate, compress
from operator import and_

import numpy as np

from rigdda.barriers import Barrier
from rigdda.dynamics.run import Run
from rigdda.model.scene import Scene
from rigdda.model.site import Site
from rigdda.results.barrier_outcome import BarrierOutcome, holding, measure_barrier
from rigdda.results.ending import Ending, ending

GRAIN = 2.0**40
"""Fractions are whole multiples of 1/GRAIN, so that they add up to 1 exactly in any order."""

CUT_OFF = 2.0
"""Speed of a block uphill of the road in the end from which on the release was cut off [m/s]: what
creeps in a deposit is slower."""

MUCH = 0.5
"""Share of the rock that must then move so: some of a mass of many may still roll."""

AT_REST = 0.1
"""Speed below which a caught block is at rest [m/s], as in replays."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a release means for the road.

    Parameters
    ----------
    event : str
        Name of the event.
    width : float
        Its width along the road [m].
    released_mass : float
        Mass of all blocks that could move [kg per metre of width].
    released_volume : float
        Volume of all blocks that could move, their area times the width [m3].
    road_volume : float
        Of this, volume of the blocks whose centroid ever passed the uphill edge of the road [m3].
    reached : bool
        Whether any did.
    reach : (low, high)
        Chainages between which all blocks stayed, corners included [m]: barriers wholly outside
        change nothing.
    debris_fraction : float
        Share of the released mass whose centroid ever passed the uphill edge of the road, in the
        air included: what the reward measures.
    debris_on_road : float
        Area of the blocks whose centroid is on the road at the end [m2].
    max_energy_on_road : float
        Largest kinetic energy of a block over the road [J].
    run_out : tuple of float
        Chainages that 50, 95 and 100 % of the mass have not passed at the end [m], at most that of
        the downhill edge of the road: a release is over when nothing moves but what goes on there.
    slope_fraction, held_fraction, road_fraction, beyond_fraction : float
        Where the mass is at the end, by centroid; they add up to 1 exactly. Held: uphill of a
        barrier that stands and below the line that rises uphill from its top at the angle of
        friction, the steepest surface of a deposit that leans on it. Not of one that failed or
        was overturned; what a ditch holds is between its edges, below that line from its
        downhill edge.
    barriers : tuple of BarrierOutcome
        One for each barrier of the layout.
    cut_off : bool
        Whether half of the rock still moved above the road when `motion.duration` was over: it
        counts as if it had stopped there.
    """

    event: str
    width: float
    released_mass: float
    released_volume: float
    road_volume: float
    reached: bool
    reach: tuple[float, float]
    debris_fraction: float
    debris_on_road: float
    max_energy_on_road: float
    run_out: tuple[float, float, float]
    slope_fraction: float
    held_fraction: float
    road_fraction: float
    beyond_fraction: float
    barriers: tuple[BarrierOutcome, ...]
    cut_off: bool = False


def stations(site: Site, layout: Sequence[Barrier]) -> tuple[float, ...]:
    """Return the ascending chainages at which a release must be watched for its outcome [m]."""
    return tuple(sorted({site.road.start, *(b.end for b in layout)}))


def watch(site: Site) -> tuple[float, float]:
    """Return the interval of x in which energies are watched: the road [m]."""
    return site.road.start, site.road.end


def leave(site: Site, scene: Scene) -> float:
    """Return the chainage beyond which a block that moves on downhill matters no more [m].

    Beyond the road, and from where on the ground does not rise, so that nothing rolls back.
    """
    ground = scene.smooth_ground or site.profile
    x, y = ground.points[:, 0], ground.points[:, 1]
    rising = np.flatnonzero(np.diff(y) > 0.0)
    return max(site.road.end, float(x[rising[-1] + 1]) if len(rising) else -math.inf)


def measure(site: Site, run: Run, event: str, width: float) -> Outcome:
    """Return the outcome of a run that watched `stations` and `watch` of its site and layout.

    It is one of an event, so wide [m].
    """
    ended = ending(run, stations(site, run.scene.barriers), site.road.start)
    return judge(site, ended, event, width)


def judge(site: Site, ended: Ending, event: str, width: float) -> Outcome:
    """Return the outcome of a release of an event, so wide [m], by how it ended."""
    road, places, areas = site.road, ended.places, ended.areas
    mass, weight = _weights(ended.masses)
    on = [2 if x > road.end else int(x >= road.start) for x, _ in places]
    came = [time < math.inf for time in ended.log.passed[road.start]]
    resting = [speed < AT_REST for speed in ended.speeds]
    reach = [holding(barrier, places) for barrier in ended.barriers]
    held = [at == 0 and any(r[k] for r in reach) for k, at in enumerate(on)]

    def share(where: Iterable[bool]) -> float:
        return sum(compress(weight, where)) / GRAIN

    def size(where: Iterable[bool]) -> float:
        return math.fsum(compress(areas, where))

    return Outcome(
        event=event,
        width=width,
        released_mass=mass,
        released_volume=width * size([w > 0.0 for w in weight]),
        road_volume=width * size(came),
        reached=any(came),
        reach=ended.extent,
        debris_fraction=share(came),
        debris_on_road=size([at == 1 for at in on]),
        max_energy_on_road=ended.road_energy,
        run_out=_run_out([min(x, road.end) for x, _ in places], weight),
        slope_fraction=share([at == 0 and not h for at, h in zip(on, held, strict=True)]),
        held_fraction=share(held),
        road_fraction=share([at == 1 for at in on]),
        beyond_fraction=share([at == 2 for at in on]),
        barriers=tuple(
            measure_barrier(
                own,
                ended.log.hits[i],
                zip(ended.starts, ended.log.passed[own.barrier.end], strict=True),
                share(map(and_, reach[i], resting)),
            )
            for i, own in enumerate(ended.barriers)
        ),
        cut_off=_cut_off(site, ended, weight),
    )


def _cut_off(site: Site, ended: Ending, weight: Sequence[float]) -> bool:
    """Return whether much of the rock still moved above the road as the time was over."""
    if ended.time < site.motion.duration - site.motion.dt:
        return False  # nothing moved any more that matters
    pairs = zip(ended.places, ended.speeds, strict=True)
    moves = [x < site.road.start and speed > CUT_OFF for (x, _), speed in pairs]
    return sum(compress(weight, moves)) > MUCH * GRAIN


def _weights(masses: Sequence[float]) -> tuple[float, list[float]]:
    """Return the released mass [kg/m] and whole-number weights that add up to GRAIN."""
    whole = math.fsum(masses)
    weight = [math.floor(m / whole * GRAIN) * 1.0 for m in masses]
    weight[weight.index(max(weight))] += GRAIN - sum(weight)
    return whole, weight


def _run_out(x: list[float], weight: list[float]) -> tuple[float, float, float]:
    order = sorted(range(len(x)), key=lambda k: x[k])
    reached = list(accumulate(weight[k] / GRAIN for k in order))
    half, most, every = (x[order[bisect_left(reached, q)]] for q in (0.5, 0.95, 1.0))
    return half, most, every
