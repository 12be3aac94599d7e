"""From a scene to the arrays that the kernels work on."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Fence, GravityWall
from rigdda.constants import (
    AWAKE,
    BOLT,
    CUTS,
    DEFLECTED,
    FIXED,
    LAYERS,
    PENETRATION_RATIO,
    PIN,
    PLAIN_CONTACT,
    SINKING,
    SLACK_RATIO,
    STEADY_STEP,
    TERRAIN,
)
from rigdda.correction import place_all_corners
from rigdda.errors import BadInput
from rigdda.geometry import convex_parts, polygon_properties, turns
from rigdda.linear.relaxation import COLUMNS
from rigdda.records import (
    BODY,
    BOX,
    CONTACT,
    CORNER,
    INTERFACE,
    LINK,
    PARAMETERS,
    POINT,
    POLYGON,
    SEGMENT,
    SHAKING,
    STATION,
    TARGET,
    WATCHED,
    Bodies,
    Boxes,
    Contacts,
    Floats,
    Gauges,
    Ground,
    Interfaces,
    Islands,
    Links,
    Matrix,
    Motion,
    Outlines,
    Rows,
    Scratch,
    Shaking,
    System,
    Work,
)
from rigdda.run import EVENT
from rigdda.scene import Scene, Terrain
from rigdda.settings import SOLVERS, Settings
from rigdda.supports import FixedPoint

LARGEST_FALL = 0.25
"""Greatest displacement that gravity gives a block in a step, over its size [-]. With 0.31 thin
blocks sink into one another, with more than a half they go through the ground."""

FALL_BELOW = 20.0
"""Depth below the lowest terrain at which a block that left the site is retired [m]."""


MOST_BANDWIDTH = 64
"""Blocks to the left of the diagonal, on average, up to which a skyline is kept room for."""


class Arrays(NamedTuple):
    """Everything the step loop needs, for one scene."""

    bodies: Bodies
    outlines: Outlines
    ground: Ground
    interfaces: Interfaces
    links: Links
    shaking: Shaking
    now: Contacts
    before: Contacts
    system: System
    work: Work
    gauges: Gauges
    parameters: NDArray[np.void]  # of PARAMETERS: of the step, then of its halves, quarters, ...


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
    interfaces = pack_interfaces(scene, names)
    return Arrays(
        bodies,
        outlines,
        pack_ground(scene, names),
        interfaces,
        pack_links(scene, bodies),
        pack_shaking(scene),
        empty_contacts(room),
        empty_contacts(room),
        empty_system(blocks, room),
        empty_work(len(bodies), blocks, room),
        pack_gauges(scene, bodies, stations, watch),
        pack_parameters(scene, settings, bodies, interfaces),
    )


def free_bodies(scene: Scene) -> int:
    """Return how many bodies are not barriers that are fixed: these come first."""
    return len(scene.blocks) + sum(isinstance(b, GravityWall) for b in scene.barriers)


def pack_bodies(scene: Scene, names: list[str]) -> tuple[Bodies, Outlines]:
    """Return the blocks, then the barriers, as bodies at the start, and their outlines.

    The surface of fences comes after the named ones.
    """
    polygons = [b.vertices for b in scene.blocks] + [scene.outline(i) for i in scene.bodies]
    bodies = np.zeros(len(polygons), dtype=BODY)  # its columns are quicker to set than a recarray's
    properties = [polygon_properties(polygon) for polygon in polygons]
    outlines = pack_outlines(polygons, [centre for _, centre, _ in properties], bodies)
    for i, polygon in enumerate(polygons):
        area, centre, second = properties[i]
        block = scene.blocks[i] if i < len(scene.blocks) else None
        barrier = None if block else scene.barriers[scene.bodies[i - len(scene.blocks)]]
        heavy = block or (barrier if isinstance(barrier, GravityWall) else None)
        density = heavy.density if heavy else 1.0
        bodies["x"][i], bodies["y"][i] = centre
        bodies["radius"][i] = np.hypot(*(polygon - centre).T).max()
        bodies["mass"][i], bodies["inertia"][i] = density * area, density * second
        bodies["surface"][i] = names.index(block.surface if block else scene.barrier_surface)
        if isinstance(barrier, Fence):
            bodies["surface"][i] = len(names)
        bodies["status"][i] = FIXED if (block.fixed if block else not heavy) else AWAKE
        if block and not block.fixed:
            bodies["vx"][i], bodies["vy"][i], bodies["omega"][i] = block.velocity
        for load in scene.loads:
            if load.block == i:
                _add_load(bodies, i, *load.resultant(area, centre))
    bodies = bodies.view(np.recarray)
    place_all_corners(bodies, outlines)
    return bodies, outlines


def _add_load(bodies: Bodies, i: int, force: Floats, point: Floats) -> None:
    """Add a dead load on body i at the start; its arm turns with the body."""
    (fx, fy), (x, y) = force, point - (bodies["x"][i], bodies["y"][i])
    bodies["force_x"][i] += fx
    bodies["force_y"][i] += fy
    bodies["moment_cos"][i] += x * fy - y * fx
    bodies["moment_sin"][i] -= x * fx + y * fy


def pack_links(scene: Scene, bodies: Bodies) -> Links:
    """Return the supports in order of their first block."""

    def anchor(block: int, point: tuple[float, float]) -> tuple[float, float]:
        if block == TERRAIN:
            return point
        return point[0] - bodies["x"][block], point[1] - bodies["y"][block]

    links = np.zeros(len(scene.supports), dtype=LINK).view(np.recarray)
    for number, (link, support) in enumerate(zip(links, scene.supports, strict=True)):
        link["number"], link["yielding"] = number, math.inf
        if isinstance(support, FixedPoint):
            link["kind"], link["a"], link["b"] = PIN, support.block, TERRAIN
            link["ax"], link["ay"] = anchor(support.block, support.point)
            link["bx"], link["by"] = support.point
            continue
        block_b = TERRAIN if support.block_b is None else support.block_b
        link["kind"], link["a"], link["b"] = BOLT, support.block_a, block_b
        link["ax"], link["ay"] = anchor(support.block_a, support.point_a)
        link["bx"], link["by"] = anchor(block_b, support.point_b)
        link["stiffness"], link["prestress"] = support.stiffness, support.prestress
        link["length"] = math.dist(support.point_a, support.point_b)
        if support.yield_force is not None:
            link["yielding"] = support.yield_force
    return links[np.argsort(links["a"], kind="stable")]


def pack_shaking(scene: Scene) -> Shaking:
    """Return the motion of the ground with its integrals over time."""
    history = np.zeros((0, 3)) if scene.base_motion is None else scene.base_motion
    shaking = np.zeros(len(history), dtype=SHAKING)
    shaking["time"], shaking["x"], shaking["y"] = t, x, y = history.T
    if len(t):
        shaking["sum_x"][1:], shaking["sum_y"][1:] = cumulative(t, x), cumulative(t, y)
    return shaking.view(np.recarray)


def cumulative(t: Floats, a: Floats) -> Floats:
    """Return the integral of a polygon up to each of its corners but the first."""
    return np.cumsum(0.5 * (a[1:] + a[:-1]) * np.diff(t))


def pack_outlines(polygons: list[Floats], centres: list[Floats], bodies: Bodies) -> Outlines:
    """Return the outlines and convex parts of bodies, and set where each body's parts are."""
    rows = [(i, list(range(len(p)))) for i, p in enumerate(polygons)]
    for i, polygon in enumerate(polygons):
        parts = convex_parts(polygon)
        bodies["count"][i], bodies["parts"][i] = len(polygon), len(parts)
        bodies["part"][i] = i if len(parts) == 1 else len(rows)
        rows += [(i, part) for part in parts if len(parts) > 1]
    shape = (len(rows), max(len(corner) for _, corner in rows))
    outlined, points = np.zeros(len(rows), dtype=POLYGON), np.zeros(shape, dtype=POINT)
    corners = np.zeros(shape, dtype=CORNER)
    for row, (i, number) in enumerate(rows):
        polygon, corner = polygons[i], corners[row, : len(number)]
        outlined["count"][row], outlined["body"][row] = len(number), i
        own = points[row, : len(number)]
        own["x"], own["y"] = (polygon - centres[i])[number].T
        corner["number"] = number
        following = [*number[1:], number[0]]
        corner["inner"] = np.subtract(following, number) % len(polygon) != 1
        if bodies["parts"][i] > 1:
            corner["reentrant"] = turns(polygon)[number] < 0.0
    return Outlines(
        outlined.view(np.recarray),
        corners.view(np.recarray),
        points.view(np.recarray),
    )


def pack_ground(scene: Scene, names: list[str]) -> Ground:
    """Return the terrain segments and the bins that find them by x."""
    if scene.ground is None:
        none, start = np.zeros(1, dtype=SEGMENT), np.zeros(1, dtype=np.int64)
        return Ground(none.view(np.recarray), start, start[:0], 0.0, 1.0)
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
    extent = np.sort(np.stack([points[:-1], points[1:]]), axis=0)
    (left, bottom), (right, top) = (corner.T for corner in extent)
    origin, bins = left.min(), max(1, min(2 * len(step), 4096))
    width = max((right.max() - origin) / bins, 1e-9)
    first, last = (np.minimum((x - origin) / width, bins - 1).astype(int) for x in (left, right))
    items: list[list[int]] = [[] for _ in range(bins)]
    for s in range(len(step)):
        for cell in range(first[s], last[s] + 1):
            items[cell].append(s)
    segment = np.zeros(len(points), dtype=SEGMENT)
    segment["x"], segment["y"], segment["turn"] = *points.T, turn
    columns = {
        "normal_x": -tangent[:, 1],
        "normal_y": tangent[:, 0],
        "length": length,
        "surface": [names.index(s) for s in scene.ground.surfaces],
        "left": left,
        "right": right,
        "bottom": bottom,
        "top": top,
        "bin": first,
    }
    for name, values in columns.items():
        segment[name][:-1] = values
    return Ground(
        segment.view(np.recarray),
        np.cumsum([0, *(len(i) for i in items)]).astype(np.int64),
        np.array([s for cell in items for s in cell], dtype=np.int64),
        float(origin),
        float(width),
    )


def empty_contacts(room: int) -> Contacts:
    """Return space for `room` contacts."""
    return np.zeros(room, dtype=CONTACT).view(np.recarray)


def empty_matrix(blocks: int, room: int) -> Matrix:
    """Return space for the equations of an island of all blocks."""
    return Matrix(
        np.zeros((blocks, 3, 3)),
        np.zeros((room, 3, 3)),
        np.zeros(room, dtype=np.int64),
        np.zeros(room, dtype=np.int64),
        np.zeros((3, 3)),
        np.zeros((blocks, 3)),
        np.zeros((blocks + 1, 3)),
    )


def empty_scratch(blocks: int, room: int) -> Scratch:
    """Return space for the solvers of these equations."""
    return Scratch(
        np.zeros((6, 7)),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros(blocks, dtype=np.int64),
        np.zeros(3 * blocks, dtype=np.int64),
        np.zeros(profile_room(blocks)),
        np.zeros(2 * room, dtype=np.int64),
    )


def empty_system(blocks: int, room: int) -> System:
    """Return space for an island of all blocks."""
    matrix = empty_matrix(blocks, room)
    motion = Motion(matrix.d, np.zeros((blocks, 3)), np.zeros((blocks, 3)), np.zeros(blocks))
    return System(matrix, empty_scratch(blocks, room), motion)


def profile_room(blocks: int) -> int:
    """Return the entries of a skyline that are kept room for; longer ones are not factorised."""
    return 9 * blocks * min(blocks, MOST_BANDWIDTH)


def empty_work(bodies: int, blocks: int, room: int) -> Work:
    """Return the scratch arrays of a step."""

    def whole(n: int) -> NDArray[np.int64]:
        return np.zeros(n, dtype=np.int64)

    row = np.zeros(bodies, BOX).view(np.recarray)
    row["body"] = np.arange(bodies)
    return Work(
        Boxes(
            swept=row.copy(),
            row=row,
            pairs=whole(2 * room),
            partner_start=whole(bodies + 1),
            partner=whole(room),
        ),
        Islands(
            parent=whole(bodies),
            slot=whole(bodies),
            block_start=whole(bodies + 1),
            block_item=whole(bodies),
            contact_start=whole(bodies + 1),
            contact_item=whole(room),
            relaxed=whole(1),
        ),
        Rows(
            row=np.zeros((room, COLUMNS)),
            row_i=whole(room),
            row_j=whole(room),
            idle=whole(room),
            visit=whole(room),
            place=whole(room),
            height=np.zeros(room),
            layer=whole(LAYERS + 1),
            moved_in=whole(blocks + 1),
            scale=np.zeros((blocks + 1, 3)),
            motion=np.zeros((blocks + 1, 9)),
        ),
        first=whole(bodies + 1),
        begin=whole(bodies + 1),
    )


def pack_gauges(
    scene: Scene, bodies: Bodies, stations: NDArray[np.float64], watch: tuple[float, float]
) -> Gauges:
    """Return the gauges, with no station passed that a block starts beyond."""
    blocks, barriers, ground = len(scene.blocks), len(scene.barriers), scene.ground
    station = np.zeros(len(stations), dtype=STATION)
    station["x"], station["ground"] = stations, [_ground(ground, x) for x in stations]
    rock = np.zeros(blocks, dtype=WATCHED)
    rock["next"] = np.searchsorted(stations, bodies["x"][:blocks], side="right")
    target = np.zeros(barriers, dtype=TARGET)
    target["capacity"] = [b.capacity if isinstance(b, Fence) else np.inf for b in scene.barriers]
    target["ground"] = [_ground(ground, b.x) for b in scene.barriers]
    room = event_room(free_bodies(scene), len(stations), barriers)
    return Gauges(
        station.view(np.recarray),
        rock.view(np.recarray),
        target.view(np.recarray),
        np.array([-1] * blocks + list(scene.bodies), dtype=np.int64),
        sum(isinstance(b, Fence) for b in scene.barriers),
        np.full((free_bodies(scene), barriers), -np.inf),
        float(watch[0]),
        float(watch[1]),
        np.zeros(room, dtype=EVENT).view(np.recarray),
    )


def _ground(terrain: Terrain | None, x: float) -> float:
    """Return the elevation of the highest ground at x, 0 where there is none [m]."""
    points = terrain.points[:, 0] if terrain else np.array([np.inf])
    return terrain.height(x) if terrain and points.min() <= x <= points.max() else 0.0


def event_room(blocks: int, stations: int, barriers: int) -> int:
    """Return the size of an event buffer that holds any two steps."""
    return 2 * (blocks + 1) * (stations + barriers) + 1


def check_step(settings: Settings, block: int, size: float, gravity: float) -> None:
    """Refuse a step in which gravity alone moves the smallest block by most of its size [m]."""
    fall = gravity * settings.dt**2
    if fall > LARGEST_FALL * size and settings.mode == "dynamic":
        most = math.sqrt(LARGEST_FALL * size / gravity)
        mend = f"give at most {most:.2g} s: block {block} is small, {size:.2g} m, and would fall "
        raise BadInput("dt", settings.dt, mend + f"{fall:.2g} m more in every step")


def pack_interfaces(scene: Scene, names: list[str]) -> Interfaces:
    """Return how each two surfaces meet.

    Fences, which come last, are of the surface of barriers, but plastic and without strength.
    """
    fences = any(isinstance(b, Fence) for b in scene.barriers)
    every = [*names, scene.barrier_surface] if fences else names
    found = np.zeros((len(every), len(every)), dtype=INTERFACE)
    for i, a in enumerate(every):
        for j, b in enumerate(every):
            surface = scene.interface(a, b)
            found["friction"][i, j] = np.tan(np.radians(surface.friction_deg))
            if max(i, j) < len(names):
                plain = surface.restitution is None
                found["restitution"][i, j] = PLAIN_CONTACT if plain else surface.restitution
                found["cohesion"][i, j], found["tension"][i, j] = surface.cohesion, surface.tension
    return found.view(np.recarray)


def pack_parameters(
    scene: Scene, settings: Settings, bodies: Bodies, interfaces: Interfaces
) -> NDArray[np.void]:
    """Return the numbers of the scene and the settings, for the step and for its parts."""
    free = [i for i, b in enumerate(scene.blocks) if not b.fixed]
    area = [bodies["mass"][i] / scene.blocks[i].density for i in free]
    size = math.sqrt(np.mean(area))
    gx, gy = scene.gravity_vector
    gravity = math.hypot(gx, gy)
    check_step(settings, free[int(np.argmin(area))], math.sqrt(min(area)), gravity)
    steady = STEADY_STEP * math.sqrt(size / gravity) if gravity > 0.0 else math.inf
    static = settings.mode == "static"
    coarse = settings.dt > steady and not static
    shaken = scene.base_motion is not None
    floor = -np.inf
    if scene.terrain is not None and gx == 0.0 and gy < 0.0:
        floor = scene.terrain.points[:, 1].min() - FALL_BELOW
    numbers = {
        "blocks": free_bodies(scene),
        "displacement_limit": settings.displacement_limit * size,
        "deflection_limit": math.inf if static else DEFLECTED * size,
        "sinking_limit": SINKING * size if coarse else math.inf,
        "first_cut": 1,
        "gravity_x": gx,
        "gravity_y": gy,
        "gravity": gravity,
        "field_x": gx,
        "field_y": gy,
        "damping": scene.damping,
        "damping_in_contact_only": scene.damping_when == "contact",
        "block_weight": np.mean(bodies["mass"][free]) * (gravity or 9.81),
        "penetration": settings.penetration or PENETRATION_RATIO * size,
        "slack": SLACK_RATIO * size,
        "tolerance": settings.tolerance,
        "sweep_tolerance": settings.sweep_tolerance,
        "iterations": settings.open_close_iterations,
        "static": static,
        "post_correction": settings.post_correction,
        "islands": settings.islands,
        "solver": SOLVERS.index(settings.solver),
        "relaxation": settings.relaxation,
        "sleeping": settings.sleeping and not (static or shaken or scene.supports),
        "timing": settings.timing,
        "floor": floor,
        "bonded": (interfaces["cohesion"] + interfaces["tension"]).any(),
    }
    if coarse:
        halvings = round(math.log2(settings.dt / steady))
        numbers["first_cut"] = min(max(1, halvings), CUTS)
    levels = np.zeros(CUTS + 1, dtype=PARAMETERS)
    for name, value in numbers.items():
        levels[name] = value
    levels["dt"] = settings.dt / 2.0 ** np.arange(CUTS + 1)
    levels["sinking_limit"][1:] = math.inf  # the parts of a step are not cut back
    return levels.view(np.recarray)
