"""How a release ended: what its outcome is judged by."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from rigdda.barriers import Barrier
from rigdda.barriers.base import Reach
from rigdda.dynamics.run import Run
from rigdda.geometry import polygon_properties
from rigdda.results.log import Log, log_of
from rigdda.results.states import states


class BarrierEnding(NamedTuple):
    """A barrier at the end of a release."""

    barrier: Barrier
    states: Sequence[tuple[float, str]]
    """Its states, each with the time from which it was in it [s]; the first is "stands"."""
    reach: Reach
    """Where it holds rock at the end if it still holds any."""
    absorbed: float
    """Energy that it took [J]."""
    thrust: float
    """Greatest mean over a second of the thrust on it [N/m]."""
    resistance: float
    """Thrust that it bears [N/m]."""
    displacement: float
    """Distance of its centroid from where it was at the start [m]."""
    road_area: float
    """Its area beyond the uphill edge of the road [m2]."""


class Ending(NamedTuple):
    """The end of a release of N blocks."""

    areas: Sequence[float]
    """Area of each block [m2]."""
    masses: Sequence[float]
    """Mass of each block per metre of width, 0 of one that is fixed [kg]."""
    starts: Sequence[float]
    """Chainage of the centroid of each block at the start [m]."""
    places: Sequence[tuple[float, float]]
    """Centroid of each block at the end [m]."""
    speeds: Sequence[float]
    """Speed of each centroid at the end [m/s]."""
    log: Log
    """What happened on the way."""
    extent: tuple[float, float]
    """Chainages between which all blocks stayed, corners included [m]."""
    road_energy: float
    """Largest kinetic energy of a block over the road [J]."""
    time: float
    """When it was [s]."""
    barriers: Sequence[BarrierEnding]


def ending(run: Run, lines: Sequence[float], road_start: float) -> Ending:
    """Return how a run ended that watched some stations, and energies over the road.

    Parameters
    ----------
    run : Run
        The run.
    lines : sequence of float
        Stations that it watched [m].
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
    """Return the rise over run of the steepest deposit on surfaces of these friction angles [-]."""
    return math.tan(math.radians(min(friction_deg)))


def _barrier(run: Run, index: int, rise: float, road_start: float) -> BarrierEnding:
    """Return how a barrier of a run ended; a deposit on it rises so at most [-]."""
    scene, barrier, outline = run.scene, run.scene.barriers[index], run.outline(index)
    return BarrierEnding(
        barrier=barrier,
        states=states(run, index),
        reach=barrier.holds(outline, scene.ground, rise),
        absorbed=float(run.absorbed[index]),
        thrust=float(run.thrust[index]),
        resistance=scene.resistance(index),
        displacement=math.dist(*run.barrier_poses[[0, -1], index, :2].tolist()),
        road_area=barrier.area_beyond(road_start, outline),
    )
