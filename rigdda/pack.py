"""From a scene to the arrays that the kernels work on."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Fence, GravityWall
from rigdda.constants import AWAKE, FIXED, PENETRATION_RATIO, SLACK_RATIO
from rigdda.correction import place_corners
from rigdda.geometry import polygon_properties
from rigdda.linear.psor import COLUMNS
from rigdda.records import (
    BODY,
    CONTACT,
    Bodies,
    Contacts,
    Gauges,
    Ground,
    Matrix,
    Outlines,
    Parameters,
    Work,
)
from rigdda.run import EVENT
from rigdda.scene import Scene, Terrain
from rigdda.settings import Settings

FALL_BELOW = 20.0
"""Depth below the lowest terrain at which a block that left the site is retired [m]."""


class Arrays(NamedTuple):
    """Everything the step loop needs, for one scene."""

    bodies: Bodies
    outlines: Outlines
    ground: Ground
    now: Contacts
    before: Contacts
    matrix: Matrix
    work: Work
    gauges: Gauges
    parameters: Parameters


def pack(
    scene: Scene,
    settings: Settings,
    stations: NDArray[np.float64],
    watch: tuple[float, float],
) -> Arrays:
    """Return the kernels' arrays for a scene at rest at its start.

    Parameters
    ----------
    stations : (K,) array
        Ascending chainages whose first crossings are recorded [m].
    watch : (float, float)
        Interval of x in which energies are watched [m].
    """
    names = list(scene.surfaces)
    bodies, outlines = pack_bodies(scene, names)
    blocks = free_bodies(scene)
    room = 16 * blocks + 64
    return Arrays(
        bodies,
        outlines,
        pack_ground(scene, names),
        empty_contacts(room),
        empty_contacts(room),
        empty_matrix(blocks, room),
        empty_work(len(bodies), room),
        pack_gauges(scene, stations, watch),
        pack_parameters(scene, settings, bodies, names),
    )


def free_bodies(scene: Scene) -> int:
    """Return how many bodies are not barriers that are fixed: these come first."""
    return len(scene.blocks) + sum(isinstance(b, GravityWall) for b in scene.barriers)


def pack_bodies(scene: Scene, names: list[str]) -> tuple[Bodies, Outlines]:
    """Return the blocks, then the barriers, as bodies at the start, and their outlines.

    The surface of fences comes after the named ones.
    """
    polygons = [b.vertices for b in scene.blocks] + [scene.outline(i) for i in scene.bodies]
    shape = (len(polygons), max(len(p) for p in polygons))
    bodies = np.zeros(len(polygons), dtype=BODY).view(np.recarray)
    outlines = Outlines(*(np.zeros(shape) for _ in Outlines._fields))
    for i, polygon in enumerate(polygons):
        area, centre, second = polygon_properties(polygon)
        block = scene.blocks[i] if i < len(scene.blocks) else None
        barrier = None if block else scene.barriers[scene.bodies[i - len(scene.blocks)]]
        heavy = block or (barrier if isinstance(barrier, GravityWall) else None)
        density = heavy.density if heavy else 1.0
        k = len(polygon)
        bodies["count"][i] = k
        bodies["x"][i], bodies["y"][i] = centre
        outlines.body_x[i, :k], outlines.body_y[i, :k] = (polygon - centre).T
        bodies["radius"][i] = np.hypot(*(polygon - centre).T).max()
        bodies["mass"][i], bodies["inertia"][i] = density * area, density * second
        bodies["surface"][i] = names.index(block.surface if block else scene.barrier_surface)
        if isinstance(barrier, Fence):
            bodies["surface"][i] = len(names)
        bodies["status"][i] = FIXED if (block.fixed if block else not heavy) else AWAKE
        if block and not block.fixed:
            bodies["vx"][i], bodies["vy"][i], bodies["omega"][i] = block.velocity
        place_corners(bodies, outlines, i)
    return bodies, outlines


def pack_ground(scene: Scene, names: list[str]) -> Ground:
    """Return the terrain segments and the bins that find them by x."""
    if scene.ground is None:
        none, start = np.zeros(0), np.zeros(1, dtype=np.int64)
        whole = np.zeros(0, dtype=np.int64)
        return Ground(none, none, none, none, none, none, whole, start, whole, 0.0, 1.0)
    points = scene.ground.points
    step = np.diff(points, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    tangent = step / length[:, None]
    turn = np.zeros(len(points))
    turn[1:-1] = np.arctan2(
        tangent[:-1, 0] * tangent[1:, 1] - tangent[:-1, 1] * tangent[1:, 0],
        (tangent[:-1] * tangent[1:]).sum(axis=1),
    )
    turn[np.abs(turn) < 1e-12] = 0.0
    left = np.minimum(points[:-1, 0], points[1:, 0])
    right = np.maximum(points[:-1, 0], points[1:, 0])
    origin, bins = left.min(), max(1, min(2 * len(step), 4096))
    width = max((right.max() - origin) / bins, 1e-9)
    items: list[list[int]] = [[] for _ in range(bins)]
    for s in range(len(step)):
        low = min(int((left[s] - origin) / width), bins - 1)
        high = min(int((right[s] - origin) / width), bins - 1)
        for cell in range(low, high + 1):
            items[cell].append(s)
    return Ground(
        np.ascontiguousarray(points[:, 0]),
        np.ascontiguousarray(points[:, 1]),
        np.ascontiguousarray(-tangent[:, 1]),
        np.ascontiguousarray(tangent[:, 0]),
        length,
        turn,
        np.array([names.index(s) for s in scene.ground.surfaces], dtype=np.int64),
        np.cumsum([0, *(len(i) for i in items)]).astype(np.int64),
        np.array([s for cell in items for s in cell], dtype=np.int64),
        float(origin),
        float(width),
    )


def empty_contacts(room: int) -> Contacts:
    """Return space for `room` contacts."""
    return np.zeros(room, dtype=CONTACT).view(np.recarray)


def empty_matrix(blocks: int, room: int) -> Matrix:
    """Return space for the system of an island of all blocks."""
    return Matrix(
        np.zeros((blocks, 3, 3)),
        np.zeros((room, 3, 3)),
        np.zeros(room, dtype=np.int64),
        np.zeros(room, dtype=np.int64),
        *(np.zeros((blocks, 3)) for _ in range(6)),
    )


def empty_work(bodies: int, room: int) -> Work:
    """Return the scratch arrays of a step."""

    def whole(n: int) -> NDArray[np.int64]:
        return np.zeros(n, dtype=np.int64)

    return Work(
        np.zeros(bodies),
        np.zeros(bodies),
        np.zeros(bodies),
        np.zeros(bodies),
        np.arange(bodies),
        whole(2 * room),
        whole(bodies),
        whole(bodies),
        whole(bodies + 1),
        whole(bodies),
        whole(bodies + 1),
        whole(room),
        whole(bodies + 1),
        np.zeros((room, COLUMNS)),
        whole(room),
        whole(room),
    )


def pack_gauges(scene: Scene, stations: NDArray[np.float64], watch: tuple[float, float]) -> Gauges:
    """Return the gauges, with no station passed that a block starts beyond."""
    blocks, barriers = len(scene.blocks), len(scene.barriers)
    start = [polygon_properties(b.vertices)[1][0] for b in scene.blocks]
    ground = scene.ground
    fences = [isinstance(b, Fence) for b in scene.barriers]
    return Gauges(
        stations,
        np.array([_ground(ground, x) for x in stations]),
        np.searchsorted(stations, start, side="right").astype(np.int64),
        np.array([-1] * blocks + list(scene.bodies), dtype=np.int64),
        np.array([b.capacity if isinstance(b, Fence) else np.inf for b in scene.barriers]),
        sum(fences),
        np.array([_ground(ground, b.x) for b in scene.barriers]),
        np.full((free_bodies(scene), barriers), -np.inf),
        np.zeros(barriers),
        np.array(watch, dtype=np.float64),
        np.zeros(blocks),
        np.zeros(event_room(blocks, len(stations), barriers), dtype=EVENT).view(np.recarray),
    )


def _ground(terrain: Terrain | None, x: float) -> float:
    """Return the elevation of the highest ground at x, 0 where there is none [m]."""
    points = terrain.points[:, 0] if terrain else np.array([np.inf])
    return terrain.height(x) if terrain and points.min() <= x <= points.max() else 0.0


def event_room(blocks: int, stations: int, barriers: int) -> int:
    """Return the size of an event buffer that holds any two steps."""
    return 2 * (blocks + 1) * (stations + barriers) + 1


def pack_parameters(
    scene: Scene, settings: Settings, bodies: Bodies, names: list[str]
) -> Parameters:
    """Return the numbers of the scene and the settings."""
    free = [i for i, b in enumerate(scene.blocks) if not b.fixed]
    area = [bodies["mass"][i] / scene.blocks[i].density for i in free]
    size = math.sqrt(np.mean(area))
    weight = np.mean(bodies["mass"][free]) * (scene.gravity or 9.81)
    pairs = [[scene.interface(a, b) for b in names] for a in names]
    friction, restitution = (
        np.array([[getattr(s, name) for s in row] for row in pairs])
        for name in ("friction_deg", "restitution")
    )
    if any(isinstance(b, Fence) for b in scene.barriers):
        # fences are of the surface of barriers, but plastic
        same = [*range(len(names)), names.index(scene.barrier_surface)]
        friction, restitution = friction[same][:, same], np.pad(restitution, ((0, 1), (0, 1)))
    floor = -np.inf if scene.terrain is None else scene.terrain.points[:, 1].min() - FALL_BELOW
    return Parameters(
        free_bodies(scene),
        settings.dt,
        scene.gravity,
        scene.damping,
        scene.damping_when == "contact",
        float(weight),
        settings.penetration or PENETRATION_RATIO * size,
        SLACK_RATIO * size,
        settings.tolerance,
        settings.open_close_iterations,
        settings.sleeping,
        float(floor),
        np.tan(np.radians(friction)),
        restitution,
    )
