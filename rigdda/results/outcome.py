"""What a release means for the road."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from operator import and_
from typing import NamedTuple

import numpy as np

from rigdda.barriers import Barrier
from rigdda.dynamics.gauges import CROSSING, FAILED, HIT
from rigdda.dynamics.run import Run
from rigdda.geometry import polygon_properties
from rigdda.model.scene import Scene
from rigdda.model.site import Site
from rigdda.results.states import STANDS, states

GRAIN = 2.0**40
"""Fractions are whole multiples of 1/GRAIN, so that they add up to 1 exactly in any order."""


GONE = ("failed", "overturned", "pushed")
"""States in which a barrier holds nothing."""

AT_REST = 0.1
"""Speed below which a caught block is at rest [m/s], as in replays."""


@dataclass(frozen=True, slots=True)
class BarrierOutcome:
    """What one barrier took in a release.

    Ditches and embankments are ground: what happens on them counts as no hit, and they absorb
    nothing here.

    Parameters
    ----------
    hits : int
        Hits, counted anew after 0.1 s apart.
    max_energy, total_energy : float
        Largest and summed energy of the hits, of translation and rotation just before the first
        touch [J].
    absorbed_energy : float
        Work that contact forces of the barrier took from the blocks [J]; of a fence that of
        impacts, and what blocks that rest against it passed on of blows on them. One that failed
        by energy took its capacity.
    impact_heights : tuple of float
        Height of each hit above the ground at the barrier's uphill face at the start [m].
    overtopped : int
        Blocks that started uphill of the barrier and first passed it while it stood: beyond its
        downhill face, the downhill edge of a ditch or of an embankment's crest. A gravity wall
        counts as where it stood at the start.
    failed : bool
        Whether it no longer stands as it was built.
    caught : float
        Share of the released mass at rest at the end that it holds, or that is in the ditch.
    state : {"stands", "failed", "slid", "overturned", "pushed"}
        At the end. A fence failed, a gravity wall has slid if it is more than 0.1 m away from its
        place, and is overturned if it is turned beyond the angle of its diagonal; an embankment was
        pushed away.
    displacement : float
        Distance of its centroid at the end from where it was at the start [m].
    thrust : float
        Greatest mean over a second of the horizontal force on it, downhill [N/m]: of a fence that
        of contacts at rest, of a ditch none.
    resistance : float
        Thrust that it bears [N/m], inf where none can move it, see `rigdda.Scene.resistance`.
    left_height : float
        Height that is left of it [m]: none of what failed, was overturned or pushed away, nor of a
        ditch.
    """

    hits: int
    max_energy: float
    total_energy: float
    absorbed_energy: float
    impact_heights: tuple[float, ...]
    overtopped: int
    failed: bool
    caught: float
    state: str
    displacement: float
    thrust: float
    resistance: float
    left_height: float


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
    ground = scene.ground or site.profile
    x, y = ground.points[:, 0], ground.points[:, 1]
    rising = np.flatnonzero(np.diff(y) > 0.0)
    return max(site.road.end, float(x[rising[-1] + 1]) if len(rising) else -math.inf)


def measure(site: Site, run: Run, event: str, width: float) -> Outcome:
    """Return the outcome of a run that watched `stations` and `watch` of its site and layout.

    It is one of an event, so wide [m].
    """
    scene, road = run.scene, site.road
    area, weight, mass = _masses(scene)
    log = _log(run, stations(site, scene.barriers))
    at = list(zip(*run.poses[-1, :, :2].T.tolist(), strict=True))
    place = [2 if x > road.end else int(x >= road.start) for x, _ in at]
    came = [time < math.inf for time in log.passed[road.start]]
    resting = [math.hypot(vx, vy) < AT_REST for vx, vy, _ in run.velocities[-1].tolist()]
    ends = [states(run, i)[-1][1] for i in range(len(scene.barriers))]
    reach = [_reach(run, i, state, at) for i, state in enumerate(ends)]
    held = [on == 0 and any(r[k] for r in reach) for k, on in enumerate(place)]

    def share(where: Iterable[bool]) -> float:
        return sum(w for w, here in zip(weight, where, strict=True) if here) / GRAIN

    def size(where: Iterable[bool]) -> float:
        return math.fsum(a for a, here in zip(area, where, strict=True) if here)

    return Outcome(
        event=event,
        width=width,
        released_mass=mass,
        released_volume=width * size(w > 0.0 for w in weight),
        road_volume=width * size(came),
        reached=any(came),
        reach=(float(run.extent[:, 0].min()), float(run.extent[:, 1].max())),
        debris_fraction=share(came),
        debris_on_road=size(on == 1 for on in place),
        max_energy_on_road=float(run.watch_energy.max()),
        run_out=_run_out([min(x, road.end) for x, _ in at], weight),
        slope_fraction=share(on == 0 and not h for on, h in zip(place, held, strict=True)),
        held_fraction=share(held),
        road_fraction=share(on == 1 for on in place),
        beyond_fraction=share(on == 2 for on in place),
        barriers=tuple(
            _barrier(run, i, ends[i], log, share(map(and_, reach[i], resting)))
            for i in range(len(scene.barriers))
        ),
    )


def _masses(scene: Scene) -> tuple[list[float], list[float], float]:
    """Return areas, whole-number weights that add up to GRAIN, and the released mass."""
    area = [polygon_properties(b.vertices)[0] for b in scene.blocks]
    mass = [0.0 if b.fixed else b.density * a for b, a in zip(scene.blocks, area, strict=True)]
    whole = math.fsum(mass)
    weight = [math.floor(m / whole * GRAIN) * 1.0 for m in mass]
    weight[weight.index(max(weight))] += GRAIN - sum(weight)
    return area, weight, whole


def _run_out(x: list[float], weight: list[float]) -> tuple[float, float, float]:
    order = sorted(range(len(x)), key=lambda k: x[k])
    reached = list(accumulate(weight[k] / GRAIN for k in order))
    half, most, every = (x[order[bisect_left(reached, q)]] for q in (0.5, 0.95, 1.0))
    return half, most, every


class _Log(NamedTuple):
    """The events of a run: what happened to each barrier, and when blocks first passed stations."""

    hits: list[list[tuple[float, float]]]  # energy [J] and height [m] of each hit of a barrier
    failure: list[float]  # when it failed, inf if it did not [s]
    passed: dict[float, list[float]]  # by station: when each block passed it, inf if it did not [s]


def _log(run: Run, lines: Sequence[float]) -> _Log:
    barriers, blocks = len(run.scene.barriers), len(run.scene.blocks)
    log = _Log(
        [[] for _ in range(barriers)],
        [math.inf] * barriers,
        {line: [math.inf] * blocks for line in lines},
    )
    for time, kind, block, target, _, _, height, _, energy in run.events.tolist():
        if kind == HIT:
            log.hits[target].append((energy, height))
        elif kind == CROSSING:
            log.passed[lines[target]][block] = time
        elif kind == FAILED:
            log.failure[target] = min(time, log.failure[target])
    return log


def _reach(run: Run, index: int, state: str, at: Sequence[tuple[float, float]]) -> list[bool]:
    """Return which centroids (x, y) a barrier holds at the end, as `Outcome` says."""
    scene, barrier = run.scene, run.scene.barriers[index]
    if state in GONE:
        return [False] * len(at)
    rise = math.tan(math.radians(min(s.friction_deg for s in scene.surfaces.values())))
    reach = barrier.holds(run.outline(index), scene.ground, rise)
    return [reach.includes(x, y) for x, y in at]


def _barrier(run: Run, index: int, state: str, log: _Log, caught: float) -> BarrierOutcome:
    barrier, hits, failure = run.scene.barriers[index], log.hits[index], log.failure[index]
    passed = zip(run.poses[0, :, 0].tolist(), log.passed[barrier.end], strict=True)
    return BarrierOutcome(
        hits=len(hits),
        max_energy=max((energy for energy, _ in hits), default=0.0),
        total_energy=math.fsum(energy for energy, _ in hits),
        absorbed_energy=float(run.absorbed[index]),
        impact_heights=tuple(height for _, height in hits),
        overtopped=sum(x < barrier.x and time < failure for x, time in passed),
        failed=state != STANDS,
        caught=caught,
        state=state,
        displacement=math.dist(*run.barrier_poses[[0, -1], index, :2].tolist()),
        thrust=float(run.thrust[index]),
        resistance=run.scene.resistance(index),
        left_height=0.0 if state in GONE else barrier.left_height(float(run.absorbed[index])),
    )
