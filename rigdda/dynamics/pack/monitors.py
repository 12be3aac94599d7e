"""What is watched during a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Embankment, Fence
from rigdda.dynamics.arrays import Monitors
from rigdda.dynamics.pack.bodies import free_bodies
from rigdda.dynamics.records import STATION, TARGET, WATCHED, Bodies
from rigdda.dynamics.run import EVENT
from rigdda.model.scene import Scene, Terrain


def pack_monitors(
    scene: Scene,
    bodies: Bodies,
    stations: NDArray[np.float64],
    watch: tuple[float, float],
    leave: float,
    dt: float,
) -> Monitors:
    """Return the monitors, with no station passed that a block starts beyond; `dt` in s."""
    blocks, barriers, ground = len(scene.blocks), len(scene.barriers), scene.smooth_ground
    station = np.zeros(len(stations), dtype=STATION)
    station["x"], station["ground"] = stations, [_ground(ground, x) for x in stations]
    rock = np.zeros(blocks, dtype=WATCHED)
    start_rock(rock, bodies, stations)
    target = np.zeros(barriers, dtype=TARGET)
    target["ground"] = [_ground(ground, b.x) for b in scene.barriers]
    start_targets(target, scene)
    room = event_room(free_bodies(scene), len(stations), barriers)
    return Monitors(
        station.view(np.recarray),
        rock.view(np.recarray),
        target.view(np.recarray),
        np.array([-1] * blocks + list(scene.bodies), dtype=np.int64),
        np.zeros((barriers, 2)),
        np.zeros((barriers, max(1, round(1.0 / dt)), 2)),
        np.zeros((barriers, 2)),
        np.full((free_bodies(scene), barriers), -np.inf),
        float(watch[0]),
        float(watch[1]),
        float(leave),
        np.zeros(room, dtype=EVENT).view(np.recarray),
    )


def start_targets(target: NDArray[np.void], scene: Scene) -> None:
    """Write what embankments resist, where they press on the ground, and how fences sag."""
    target["low"] = target["limit"] = np.inf
    target["high"] = -np.inf
    for i, barrier in enumerate(scene.barriers):
        if isinstance(barrier, Embankment):
            corners = scene.outline(i)
            target["limit"][i] = scene.resistance(i)
            target["low"][i], target["high"][i] = corners[:, 0].min(), corners[:, 0].max()
        elif isinstance(barrier, Fence):
            target["sag"][i] = barrier.sag


def start_rock(rock: NDArray[np.void], bodies: Bodies, stations: NDArray[np.float64]) -> None:
    """Write where blocks start: between which stations, and their extent."""
    x, radius = bodies["x"][: len(rock)], bodies["radius"][: len(rock)]
    rock["next"] = stations.searchsorted(x, side="right")
    rock["low"], rock["high"] = x - radius, x + radius


def _ground(terrain: Terrain | None, x: float) -> float:
    """Return the elevation of the highest ground at x, 0 where there is none [m]."""
    points = terrain.points[:, 0] if terrain else np.array([np.inf])
    return terrain.height(x) if terrain and points.min() <= x <= points.max() else 0.0


def event_room(blocks: int, stations: int, barriers: int) -> int:
    """Return the size of an event buffer that holds any two steps."""
    return 2 * (blocks + 1) * (stations + barriers) + 1
