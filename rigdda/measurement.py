"""Measurement of a release: computes the outcome of a run."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from itertools import accumulate, compress
from operator import and_
from typing import Any, NamedTuple

import numpy as np

from rigdda.barriers import Barrier
from rigdda.barriers.base import GONE, STANDS, Reach
from rigdda.dynamics.monitors import CROSSING, FAILED, HIT
from rigdda.dynamics.run import Run
from rigdda.geometry import polygon_properties
from rigdda.model.outcome import BarrierOutcome, Outcome
from rigdda.model.scene import Scene
from rigdda.model.site import Site


class BarrierEnding(NamedTuple):
    """State of a barrier at the end of a release."""

    barrier: Barrier
    states: Sequence[tuple[float, str]]
    """Its successive states, each with the time at which it begins [s]; the first is "stands"."""
    reach: Reach
    """Where it holds rock at the end, if it still holds any."""
    absorbed: float
    """Energy that it absorbed [J]."""
    thrust: float
    """Greatest thrust on it, averaged over a second [N/m]."""
    resistance: float
    """Thrust at which it fails [N/m]."""
    displacement: float
    """Distance of its centroid from its initial position [m]."""
    road_area: float
    """Its area beyond the uphill edge of the road [m2]."""


class Ending(NamedTuple):
    """State at the end of a release of N blocks."""

    areas: Sequence[float]
    """Area of each block [m2]."""
    masses: Sequence[float]
    """Mass of each block per metre of width, 0 for a fixed block [kg]."""
    starts: Sequence[float]
    """Chainage of the centroid of each block at the start [m]."""
    places: Sequence[tuple[float, float]]
    """Centroid of each block at the end [m]."""
    speeds: Sequence[float]
    """Speed of each centroid at the end [m/s]."""
    log: Log
    """Events during the release."""
    extent: tuple[float, float]
    """Chainages between which all blocks stayed, including their corners [m]."""
    road_energy: float
    """Largest kinetic energy of a block over the road [J]."""
    time: float
    """Time of the end [s]."""
    barriers: Sequence[BarrierEnding]


def ending(run: Run, lines: Sequence[float], road_start: float) -> Ending:
    """Return how a run ended that recorded stations and the energies over the road.

    Parameters
    ----------
    run : Run
        The run.
    lines : sequence of float
        Its stations [m].
    road_start : float
        Chainage of the uphill edge of the road [m].
    """
    scene = run.scene
    areas = [polygon_properties(block.vertices)[0] for block in scene.blocks]
    rise = steepest_deposit(surface.friction_deg for surface in scene.surfaces.values())
    return Ending(
        areas=areas,
        masses=[
            0.0 if block.fixed else block.density * area
            for block, area in zip(scene.blocks, areas, strict=True)
        ],
        starts=run.poses[0, :, 0].tolist(),
        places=list(zip(*run.poses[-1, :, :2].T.tolist(), strict=True)),
        speeds=[math.hypot(vx, vy) for vx, vy, _ in run.velocities[-1].tolist()],
        log=log_of(run.events.tolist(), len(scene.barriers), len(scene.blocks), lines),
        extent=(float(run.extent[:, 0].min()), float(run.extent[:, 1].max())),
        road_energy=float(run.watch_energy.max()),
        time=float(run.times[-1]),
        barriers=[_barrier(run, i, rise, road_start) for i in range(len(scene.barriers))],
    )


def steepest_deposit(friction_deg: Iterable[float]) -> float:
    """Return the slope of the steepest deposit on surfaces of these friction angles [-]."""
    return math.tan(math.radians(min(friction_deg)))


def _barrier(run: Run, index: int, rise: float, road_start: float) -> BarrierEnding:
    """Return how a barrier of a run ended; `rise` is the greatest slope of its deposit [-]."""
    scene, barrier, outline = run.scene, run.scene.barriers[index], run.outline(index)
    return BarrierEnding(
        barrier=barrier,
        states=run.states(index),
        reach=barrier.holds(outline, scene.ground, rise),
        absorbed=float(run.absorbed[index]),
        thrust=float(run.thrust[index]),
        resistance=scene.resistance(index),
        displacement=math.dist(*run.barrier_poses[[0, -1], index, :2].tolist()),
        road_area=barrier.area_beyond(road_start, outline),
    )


def measure_barrier(
    ended: BarrierEnding,
    hits: Sequence[tuple[float, float]],
    passed: Iterable[tuple[float, float]],
    caught: float,
) -> BarrierOutcome:
    """Return the outcome of a barrier.

    Parameters
    ----------
    ended : BarrierEnding
        State of the barrier at the end.
    hits : sequence of (energy, height)
        Hits of the barrier [J, m].
    passed : iterable of (start, time)
        Initial chainage of each block and the time at which it first passed the barrier [m, s].
    caught : float
        Fraction of the released mass at rest behind the barrier [-].
    """
    barrier, state = ended.barrier, ended.states[-1][1]
    gone = next((time for time, state in ended.states if state in GONE), math.inf)
    return BarrierOutcome(
        hits=len(hits),
        max_energy=max((energy for energy, _ in hits), default=0.0),
        total_energy=math.fsum(energy for energy, _ in hits),
        absorbed_energy=ended.absorbed,
        impact_heights=tuple(height for _, height in hits),
        overtopped=sum(x < barrier.x and time < gone for x, time in passed),
        failed=state != STANDS,
        caught=caught,
        state=state,
        displacement=ended.displacement,
        road_area=ended.road_area,
        thrust=ended.thrust,
        resistance=ended.resistance,
        left_height=0.0 if state in GONE else barrier.left_height(ended.displacement),
    )


def holding(ended: BarrierEnding, places: Sequence[tuple[float, float]]) -> list[bool]:
    """Return which centroids (x, y) a barrier holds at the end, see `rigdda.Outcome`."""
    if ended.states[-1][1] in GONE:
        return [False] * len(places)
    return [ended.reach.includes(x, y) for x, y in places]


GRAIN = 2.0**40
"""Fractions are integer multiples of 1/GRAIN, so that they add up to exactly 1 in any order."""

CUT_OFF = 2.0
"""Speed of a block uphill of the road at the end of a run above which the release counts as cut off
[m/s]. Blocks that creep in a deposit are slower."""

MUCH = 0.5
"""Fraction of the rock that must exceed this speed for the release to count as cut off [-], because
a few blocks of a large mass may still roll."""

AT_REST = 0.1
"""Speed below which a caught block is at rest [m/s], as in replays."""


def stations(site: Site, layout: Sequence[Barrier]) -> tuple[float, ...]:
    """Return the ascending chainages of the stations that the outcome of a release needs [m]."""
    return tuple(sorted({site.road.start, *(b.end for b in layout)}))


def watch(site: Site) -> tuple[float, float]:
    """Return the interval of x in which energies are recorded: the road [m]."""
    return site.road.start, site.road.end


def leave(site: Site, scene: Scene) -> float:
    """Return the chainage beyond which blocks that move downhill no longer matter [m].

    It is beyond the road and beyond the last rise of the ground, so that no block can roll back.
    """
    ground = scene.smooth_ground or site.profile
    x, y = ground.points[:, 0], ground.points[:, 1]
    rising = np.flatnonzero(np.diff(y) > 0.0)
    return max(site.road.end, float(x[rising[-1] + 1]) if len(rising) else -math.inf)


def measure(site: Site, run: Run, event: str, width: float) -> Outcome:
    """Return the outcome of a run that recorded `stations` and `watch` of its site and layout.

    `width` is the width of its event [m].
    """
    ended = ending(run, stations(site, run.scene.barriers), site.road.start)
    return judge(site, ended, event, width)


def judge(site: Site, ended: Ending, event: str, width: float) -> Outcome:
    """Return the outcome of a release of an event of a width [m] from the state at its end."""
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
    """Return whether most of the rock was still moving above the road at the end of the run."""
    if ended.time < site.motion.duration - site.motion.dt:
        return False  # no relevant block was moving
    pairs = zip(ended.places, ended.speeds, strict=True)
    moves = [x < site.road.start and speed > CUT_OFF for (x, _), speed in pairs]
    return sum(compress(weight, moves)) > MUCH * GRAIN


def _weights(masses: Sequence[float]) -> tuple[float, list[float]]:
    """Return the released mass [kg/m] and integer weights that add up to GRAIN."""
    whole = math.fsum(masses)
    weight = [math.floor(m / whole * GRAIN) * 1.0 for m in masses]
    weight[weight.index(max(weight))] += GRAIN - sum(weight)
    return whole, weight


def _run_out(x: list[float], weight: list[float]) -> tuple[float, float, float]:
    order = sorted(range(len(x)), key=lambda k: x[k])
    reached = list(accumulate(weight[k] / GRAIN for k in order))
    half, most, every = (x[order[bisect_left(reached, q)]] for q in (0.5, 0.95, 1.0))
    return half, most, every


class Log(NamedTuple):
    """Events of a run by barrier, and the times at which blocks first passed the stations."""

    hits: list[list[tuple[float, float]]]  # energy [J] and height [m] of each hit of a barrier
    failed: list[float]  # time at which each barrier failed, inf if it did not [s]
    passed: dict[float, list[float]]  # by station: passage time of each block, inf without one [s]


def log_of(
    events: Iterable[tuple[Any, ...]], barriers: int, blocks: int, lines: Sequence[float]
) -> Log:
    """Return the log of a run from its events.

    Parameters
    ----------
    events : iterable of tuple
        Events in order of time, each with the fields of `rigdda.dynamics.run.EVENT`.
    barriers, blocks : int
        Numbers of barriers and blocks.
    lines : sequence of float
        The stations, ascending [m].
    """
    log = Log(
        [[] for _ in range(barriers)],
        [math.inf] * barriers,
        {line: [math.inf] * blocks for line in lines},
    )
    for time, kind, block, target, _, _, height, _, energy in events:
        if kind == HIT:
            log.hits[target].append((energy, height))
        elif kind == CROSSING:
            log.passed[lines[target]][block] = time
        elif kind == FAILED:
            log.failed[target] = min(log.failed[target], time)
    return log
