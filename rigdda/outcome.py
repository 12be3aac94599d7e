"""What a release means for the road."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Barrier, Ditch, Embankment, GravityWall
from rigdda.geometry import polygon_properties
from rigdda.run import Run
from rigdda.scene import Scene
from rigdda.site import Site

GRAIN = 2.0**40
"""Fractions are whole multiples of 1/GRAIN, so that they add up to 1 exactly in any order."""


SLID = 0.1
"""Displacement beyond which a gravity wall has slid [m]: what its contacts give under load is a
hundredth of it."""

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
        Work that contact forces of the barrier took from the blocks [J]; of a fence also what
        blocks at rest against it passed on of blows on them.
    impact_heights : tuple of float
        Height of each hit above the ground at the barrier's uphill face at the start [m].
    overtopped : int
        Blocks that started uphill of the barrier and first passed it while it stood: beyond its
        downhill face, the downhill edge of a ditch or of an embankment's crest. A gravity wall
        counts as where it stood at the start.
    failed : bool
        Whether it failed; only fences do.
    caught : float
        Share of the released mass at rest at the end that it holds, or that is in the ditch.
    state : {"stands", "failed", "slid", "overturned"}
        At the end. A gravity wall has slid if it is more than 0.1 m away from its place,
        and is overturned if it is turned beyond the angle of its diagonal.
    displacement : float
        Distance of its centroid at the end from where it was at the start [m].
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
    scene = run.scene
    area, weight, mass = _masses(run)
    lines = stations(site, scene.barriers)
    passed = {line: _first_passed(run, i) for i, line in enumerate(lines)}
    x, y = run.poses[-1, :, 0], run.poses[-1, :, 1]
    beyond = x > site.road.end
    road = (x >= site.road.start) & ~beyond
    reach = [_reach(run, i, x, y) for i in range(len(scene.barriers))]
    held = np.any([np.zeros(len(x), dtype=bool), *reach], axis=0) & ~road & ~beyond
    came = np.isfinite(passed[site.road.start])
    resting = np.hypot(*run.velocities[-1, :, :2].T) < AT_REST

    def share(where: NDArray[np.bool_]) -> float:
        return float(weight[where].sum() / GRAIN)

    return Outcome(
        event=event,
        width=width,
        released_mass=mass,
        released_volume=width * float(area[weight > 0.0].sum()),
        road_volume=width * float(area[came].sum()),
        reached=bool(came.any()),
        reach=(float(run.extent[:, 0].min()), float(run.extent[:, 1].max())),
        debris_fraction=share(came),
        debris_on_road=float(area[road].sum()),
        max_energy_on_road=float(run.watch_energy.max()),
        run_out=_run_out(np.minimum(x, site.road.end), weight),
        slope_fraction=share(~(held | road | beyond)),
        held_fraction=share(held),
        road_fraction=share(road),
        beyond_fraction=share(beyond),
        barriers=tuple(
            _barrier(run, i, passed[b.end], share(reach[i] & resting))
            for i, b in enumerate(scene.barriers)
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


def _first_passed(run: Run, station: int) -> NDArray[np.float64]:
    """Return the time at which each block first passed a station, inf if it did not, (N,) [s]."""
    time = np.full(run.poses.shape[1], np.inf)
    crossings = run.crossings(station)
    time[crossings["block"]] = crossings["time"]
    return time


def _reach(
    run: Run, index: int, x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which centroids (x, y) a barrier holds at the end, as `Outcome` says."""
    scene, barrier = run.scene, run.scene.barriers[index]
    if state_of(run, index) in ("failed", "overturned"):
        return np.zeros(len(x), dtype=bool)
    rise = math.tan(math.radians(min(s.friction_deg for s in scene.surfaces.values())))
    corners = run.outline(index)
    if isinstance(barrier, Ditch):
        assert scene.ground is not None
        edge, top = barrier.end, scene.ground.height(barrier.end)
        return (x >= barrier.x) & (x < edge) & (y < top + rise * (edge - x))
    face, top = corners[:, 0].min(), corners[:, 1].max()
    if isinstance(barrier, Embankment):  # its uphill side belongs to it
        face += barrier.side_slope * barrier.height
    return (x < face) & (y < top + rise * (face - x))


def state_of(run: Run, index: int) -> str:
    """Return the state of a barrier at the end."""
    barrier = run.scene.barriers[index]
    if math.isfinite(run.failure(index)):
        return "failed"
    if isinstance(barrier, GravityWall):
        diagonal = math.atan2(barrier.thickness, barrier.height)
        if abs(run.barrier_poses[-1, index, 2]) > diagonal:
            return "overturned"
        if _displacement(run, index) > SLID:
            return "slid"
    return "stands"


def _displacement(run: Run, index: int) -> float:
    """Return the distance of a barrier's centroid from where it was at the start [m]."""
    moved = run.barrier_poses[-1, index, :2] - run.barrier_poses[0, index, :2]
    return float(np.hypot(*moved))


def _barrier(run: Run, index: int, passed: NDArray[np.float64], caught: float) -> BarrierOutcome:
    hits = run.hits(index)
    uphill = run.poses[0, :, 0] < run.scene.barriers[index].x
    failure = run.failure(index)
    return BarrierOutcome(
        hits=len(hits),
        max_energy=float(hits["energy"].max(initial=0.0)),
        total_energy=math.fsum(hits["energy"]),
        absorbed_energy=float(run.absorbed[index]),
        impact_heights=tuple(float(h) for h in hits["height"]),
        overtopped=int((uphill & np.isfinite(passed) & (passed < failure)).sum()),
        failed=math.isfinite(failure),
        caught=caught,
        state=state_of(run, index),
        displacement=_displacement(run, index),
    )
