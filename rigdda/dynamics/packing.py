"""Packing of a scene into the arrays of the kernels, with room for contacts and equations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Embankment, Fence, GravityWall
from rigdda.barriers.fence import MASS
from rigdda.dynamics.arrays import (
    Boxes,
    GroundArrays,
    Islands,
    Matrix,
    Monitors,
    Outlines,
    Rows,
    Scratch,
    Stems,
    Work,
)
from rigdda.dynamics.constants import (
    ASLEEP,
    AWAKE,
    BOLT,
    FIXED,
    MARGIN_RATIO,
    PENETRATION_RATIO,
    PIN,
    PLAIN_CONTACT,
    TERRAIN,
)
from rigdda.dynamics.post_correction import polygon_row, set_body_coordinates
from rigdda.dynamics.post_correction import polygons as polygons_of
from rigdda.dynamics.records import (
    BODY,
    BOX,
    CONTACT,
    CORNER,
    INTERFACE,
    LINK,
    LOCAL,
    PARAMETERS,
    POLYGON,
    SEGMENT,
    SHAKING,
    STATION,
    TARGET,
    WATCHED,
    Bodies,
    Contacts,
    Floats,
    Interfaces,
    Links,
    Shaking,
)
from rigdda.dynamics.rows import COLUMNS, FACTS, SLOT_COLUMNS
from rigdda.dynamics.run import EVENT
from rigdda.dynamics.stems import pack_stems
from rigdda.errors import BadInput
from rigdda.geometry import convex_parts, moments, polygon_properties, turns
from rigdda.kernel import Direct, short_kernel
from rigdda.model.loads import FixedPoint
from rigdda.model.scene import Block, Scene, Terrain
from rigdda.model.settings import EARTH, SOLVERS, Settings, longest_step

MOST_BANDWIDTH = 64
"""Mean number of blocks to the left of the diagonal for which a skyline has room."""


def empty_contacts(room: int) -> Contacts:
    """Return room for `room` contacts."""
    return np.zeros(room, dtype=CONTACT).view(np.recarray)


def empty_matrix(blocks: int, room: int) -> Matrix:
    """Return room for the equations of an island of all blocks."""
    return Matrix(
        np.zeros((blocks, 3, 3)),
        np.zeros((room, 3, 3)),
        np.zeros(room, dtype=np.int64),
        np.zeros(room, dtype=np.int64),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
    )


def empty_scratch(blocks: int, room: int) -> Scratch:
    """Return working arrays for the solvers of these equations."""
    return Scratch(
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros(blocks, dtype=np.int64),
        np.zeros(3 * blocks, dtype=np.int64),
        np.zeros(profile_room(blocks)),
        np.zeros(2 * room, dtype=np.int64),
    )


def profile_room(blocks: int) -> int:
    """Return the room for skyline entries; a longer skyline is not factorised."""
    return 9 * blocks * min(blocks, MOST_BANDWIDTH)


def empty_work(bodies: int, blocks: int, room: int) -> Work:
    """Return the working arrays of a step."""

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
        ),
        Rows(
            row=np.zeros((room, COLUMNS)),
            fact=np.zeros((room, FACTS)),
            form=whole(room),
            row_i=whole(room),
            row_j=whole(room),
            idle=whole(room),
            active=whole(room),
            visit=whole(room),
            place=whole(room),
            face=whole(room),
            height=np.zeros(room),
            layer=whole(room + 1),
            moved_in=whole(blocks + 1),
            scale=np.zeros((blocks + 1, 3)),
            slot=np.zeros((blocks + 1, SLOT_COLUMNS)),
        ),
        empty_matrix(blocks, room),
        empty_scratch(blocks, room),
        first=whole(bodies + 1),
        begin=whole(bodies + 1),
    )


def pack_ground(ground: Terrain | None, names: list[str]) -> GroundArrays:
    """Return the terrain segments and the bins that locate them by x."""
    if ground is None:
        none, start = np.zeros(1, dtype=SEGMENT), np.zeros(1, dtype=np.int64)
        return GroundArrays(none.view(np.recarray), start, start[:0], 0.0, 1.0)
    points = ground.points
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
        "surface": [names.index(s) for s in ground.surfaces],
        "left": left,
        "right": right,
        "bottom": bottom,
        "top": top,
        "bin": first,
    }
    for name, values in columns.items():
        segment[name][:-1] = values
    return GroundArrays(
        segment.view(np.recarray),
        np.cumsum([0, *(len(i) for i in items)]).astype(np.int64),
        np.array([s for cell in items for s in cell], dtype=np.int64),
        float(origin),
        float(width),
    )


def pack_shaking(scene: Scene) -> Shaking:
    """Return the ground motion with its integrals over time."""
    history = np.zeros((0, 3)) if scene.base_motion is None else scene.base_motion
    shaking = np.zeros(len(history), dtype=SHAKING)
    shaking["time"], shaking["x"], shaking["y"] = t, x, y = history.T
    if len(t):
        shaking["sum_x"][1:], shaking["sum_y"][1:] = cumulative(t, x), cumulative(t, y)
    return shaking.view(np.recarray)


def cumulative(t: Floats, a: Floats) -> Floats:
    """Return the integral of a piecewise linear function up to each corner after the first."""
    return np.cumsum(0.5 * (a[1:] + a[:-1]) * np.diff(t))


def pack_monitors(
    scene: Scene,
    bodies: Bodies,
    stations: NDArray[np.float64],
    watch: tuple[float, float],
    leave: float,
    dt: float,
) -> Monitors:
    """Return the monitors; stations uphill of where a block starts count as passed; `dt` in s."""
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
    """Write the resistance and extent of embankments and the sag of fences."""
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
    """Write the next station and the extent of each block at the start."""
    x, radius = bodies["x"][: len(rock)], bodies["radius"][: len(rock)]
    rock["next"] = stations.searchsorted(x, side="right")
    rock["low"], rock["high"] = x - radius, x + radius


def _ground(terrain: Terrain | None, x: float) -> float:
    """Return the elevation of the highest ground at x, 0 where there is none [m]."""
    points = terrain.points[:, 0] if terrain else np.array([np.inf])
    return terrain.height(x) if terrain and points.min() <= x <= points.max() else 0.0


def event_room(blocks: int, stations: int, barriers: int) -> int:
    """Return the size of an event buffer that holds the events of any two steps."""
    return 2 * (blocks + 1) * (stations + barriers) + 1


FALL_BELOW = 20.0
"""Depth below the lowest terrain at which a block has left the site and is retired [m]."""


def check_step(settings: Settings, areas: NDArray[np.float64], gravity: float) -> None:
    """Raise `BadInput` if a step is too long for free blocks of these areas [m2]."""
    most = longest_step(areas, gravity)
    if settings.dt > most and settings.mode == "dynamic":
        sizes = np.sqrt(areas)
        hint = (
            f"give at most {math.floor(1e5 * most) / 1e5:g} s: the blocks are {sizes.min():.2g} to "
            f"{sizes.max():.2g} m large, and contacts would sink in"
        )
        raise BadInput("dt", settings.dt, hint)


NET, WALL = 0, 1
"""Surfaces of fences and of gravity walls, after the named surfaces."""


def pack_interfaces(scene: Scene, names: list[str]) -> Interfaces:
    """Return the interface properties of each pair of surfaces.

    The surfaces of fences and gravity walls come last. That of fences has no restitution, strength,
    friction and rolling resistance, because a net moves along with what it holds. That of gravity
    walls is the surface of barriers without rolling resistance, which would keep a wall from
    overturning: its moment at the toe would add to that of the weight. Blocks that touch a wall
    have none there either.
    """
    movable = any(isinstance(b, Fence | GravityWall) for b in scene.barriers)
    own = names.index(scene.barrier_surface) if movable else 0
    every = [*names, *([scene.barrier_surface] * 2 if movable else [])]
    found = np.zeros((len(every), len(every)), dtype=INTERFACE)
    found["restitution_speed"] = math.inf
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            surface = scene.interface(a, b)
            plain = surface.restitution is None
            found["restitution"][i, j] = PLAIN_CONTACT if plain else surface.restitution
            found["cohesion"][i, j], found["tension"][i, j] = surface.cohesion, surface.tension
            found["rolling"][i, j] = surface.rolling
            if surface.restitution_speed is not None:
                found["restitution_speed"][i, j] = surface.restitution_speed
    net, wall = len(names) + NET, len(names) + WALL
    if movable:
        found[wall], found[:, wall] = found[own], found[:, own]
        found["rolling"][wall] = found["rolling"][:, wall] = 0.0
        found[net] = found[:, net] = np.zeros(1, dtype=INTERFACE)
        found["restitution_speed"][net] = found["restitution_speed"][:, net] = math.inf
    found["friction"] = frictions(scene, every)
    found["friction"][net : net + 1] = found["friction"][:, net : net + 1] = 0.0
    return found.view(np.recarray)


def frictions(scene: Scene, every: list[str]) -> list[list[float]]:
    """Return the coefficient of friction of each pair of surfaces."""
    return [[math.tan(math.radians(scene.friction_deg(a, b))) for b in every] for a in every]


def rock_numbers(scene: Scene, settings: Settings, bodies: Bodies) -> dict[str, float]:
    """Return the parameters that depend on the blocks."""
    free = [i for i, b in enumerate(scene.blocks) if not b.fixed]
    mass = bodies["mass"][free]
    area = mass / [scene.blocks[i].density for i in free]
    size = math.sqrt(np.add.reduce(area) / len(free))
    gravity = math.hypot(*scene.gravity_vector)
    check_step(settings, area, gravity)
    return {
        "block_weight": np.add.reduce(mass) / len(free) * (gravity or EARTH),
        "penetration": settings.penetration or PENETRATION_RATIO * size,
        "margin": MARGIN_RATIO * size,
    }


def pack_parameters(
    scene: Scene, settings: Settings, bodies: Bodies, interfaces: Interfaces
) -> NDArray[np.void]:
    """Return the parameters of the scene and the settings."""
    gx, gy = scene.gravity_vector
    static = settings.mode == "static"
    shaken = scene.base_motion is not None
    floor = -np.inf
    if scene.terrain is not None and gx == 0.0 and gy < 0.0:
        floor = scene.terrain.points[:, 1].min() - FALL_BELOW
    numbers = {
        "dt": settings.dt,
        "blocks": free_bodies(scene),
        "gravity_x": gx,
        "gravity_y": gy,
        "gravity": math.hypot(gx, gy),
        "field_x": gx,
        "field_y": gy,
        "damping": scene.damping,
        "tolerance": settings.tolerance,
        "sweep_tolerance": settings.sweep_tolerance,
        "iterations": settings.open_close_iterations,
        "static": static,
        "post_correction": settings.post_correction,
        "islands": settings.islands,
        "solver": SOLVERS.index(settings.solver),
        "relaxation": settings.relaxation,
        "sleeping": settings.sleeping and not (static or shaken or scene.supports),
        "floor": floor,
        "bonded": (interfaces["cohesion"] + interfaces["tension"]).any(),
    }
    parameters = np.zeros(1, dtype=PARAMETERS)
    for name, value in (numbers | rock_numbers(scene, settings, bodies)).items():
        parameters[name] = value
    return parameters.view(np.recarray)


def free_bodies(scene: Scene) -> int:
    """Return the number of bodies that are not fixed barriers; these bodies come first."""
    return len(scene.blocks) + sum(isinstance(b, GravityWall | Fence) for b in scene.barriers)


def pack_bodies(scene: Scene, names: list[str]) -> tuple[Bodies, Outlines]:
    """Return blocks, then barriers, as bodies in their initial state, and their outlines.

    The surfaces of fences and gravity walls follow the named surfaces.
    """
    polygons = [b.vertices for b in scene.blocks] + [scene.outline(i) for i in scene.bodies]
    bodies = np.zeros(len(polygons), dtype=BODY)  # columns are faster to set than in a recarray
    outlines = pack_outlines(polygons, bodies)
    mark_flush([b.vertices if b.fixed else None for b in scene.blocks], outlines)
    traits = block_traits(scene.blocks, names)
    traits += [barrier_trait(scene, i, names) for i in scene.bodies]
    bodies = bodies.view(np.recarray)
    write_polygons(polygons, traits, bodies, outlines)
    for load in scene.loads:
        i = load.block
        area, centre, _ = polygon_properties(polygons[i])
        _add_load(bodies, i, *load.resultant(area, centre))
    return bodies, outlines


Trait = tuple[float, float, float, float, int, int]
"""Density [kg/m3], velocity [m/s, m/s, rad/s], surface and status of a body."""


def block_traits(blocks: Sequence[Block], names: list[str]) -> list[Trait]:
    """Return density, velocity, surface and status of blocks."""
    return [
        (
            b.density,
            *((0.0, 0.0, 0.0) if b.fixed else b.velocity),
            names.index(b.surface),
            FIXED if b.fixed else AWAKE,
        )
        for b in blocks
    ]


def barrier_trait(scene: Scene, number: int, names: list[str]) -> Trait:
    """Return density, velocity, surface and status of a barrier that is a body."""
    barrier = scene.barriers[number]
    if isinstance(barrier, Fence):
        area = polygon_properties(scene.outline(number))[0]
        density = MASS * barrier.height / area
        return density, 0.0, 0.0, 0.0, len(names) + NET, ASLEEP
    if isinstance(barrier, GravityWall):
        return barrier.density, 0.0, 0.0, 0.0, len(names) + WALL, AWAKE
    return 1.0, 0.0, 0.0, 0.0, names.index(scene.barrier_surface), FIXED


def start_fences(scene: Scene, bodies: Bodies, parameters: NDArray[np.void]) -> None:
    """Write brakes and status of fences; a fence sleeps until a moving body comes near.

    Fences are awake if sleeping is disabled, and fixed in static mode or without post-correction.
    """
    p = parameters[0]
    moves = p["post_correction"] and not p["static"]
    for place in fences(scene):
        body = bodies[place]
        body["island"], body["held_at"] = place, body["x"]
        body["status"] = (ASLEEP if p["sleeping"] else AWAKE) if moves else FIXED
    set_brakes(scene, bodies)


def fences(scene: Scene) -> dict[int, Fence]:
    """Return the fences of a scene, keyed by body index."""
    found = ((place, scene.barriers[i]) for place, i in enumerate(scene.bodies, len(scene.blocks)))
    return {place: barrier for place, barrier in found if isinstance(barrier, Fence)}


def set_brakes(scene: Scene, bodies: Bodies) -> None:
    """Write the braking force of each fence, by the width of an event, and its elongation."""
    for place, fence in fences(scene).items():
        bodies["brake"][place], bodies["elongation"][place] = fence.braking_force, fence.elongation


def write_polygons(
    polygons: Sequence[Floats], traits: Sequence[Trait], bodies: Bodies, outlines: Outlines
) -> None:
    """Write the first bodies of an array and their outlines from the corners of each."""
    corners = np.concatenate(polygons)
    _write.call(corners, np.array(traits, dtype=np.float64), bodies, outlines)


@short_kernel
def write_bodies(corners: NDArray, traits: NDArray, bodies: Bodies, outlines: Outlines) -> None:
    """Set bodies to their initial state from their corners, listed one body after the other.

    The number of corners and the parts of each body must be set. Density, velocity, surface and
    status are the columns of `traits`.
    """
    low = 0
    for i in range(len(traits)):
        body = bodies[i]
        high = low + body.count
        area, body.x, body.y, second = moments(corners, low, high)
        density = traits[i, 0]
        body.mass, body.inertia = density * area, density * second
        body.vx, body.vy, body.omega = traits[i, 1], traits[i, 2], traits[i, 3]
        body.surface, body.status = int(traits[i, 4]), int(traits[i, 5])
        farthest = 0.0
        for k in range(low, high):
            dx, dy = corners[k, 0] - body.x, corners[k, 1] - body.y
            farthest = max(farthest, math.hypot(dx, dy))
        body.radius = farthest
        for place in range(polygons_of(body)):
            row = polygon_row(body, i, place)
            for k in range(outlines.polygon[row].count):
                local, number = outlines.local[row, k], outlines.corner[row, k].number
                local.x = corners[low + number, 0] - body.x
                local.y = corners[low + number, 1] - body.y
        set_body_coordinates(bodies, outlines, i)
        low = high


_write = Direct(write_bodies)


def _add_load(bodies: Bodies, i: int, force: Floats, point: Floats) -> None:
    """Add a dead load to body i in its initial state; its lever arm rotates with the body."""
    (fx, fy), (x, y) = force, point - (bodies["x"][i], bodies["y"][i])
    bodies["force_x"][i] += fx
    bodies["force_y"][i] += fy
    bodies["moment_cos"][i] += x * fy - y * fx
    bodies["moment_sin"][i] -= x * fx + y * fy


def pack_outlines(polygons: list[Floats], bodies: Bodies) -> Outlines:
    """Return the outlines and convex parts of bodies, and set where each body's parts start.

    The positions of the corners are set by `write_polygons`.
    """
    rows = [(i, list(range(len(p)))) for i, p in enumerate(polygons)]
    for i, polygon in enumerate(polygons):
        parts = convex_parts(polygon)
        bodies["count"][i], bodies["parts"][i] = len(polygon), len(parts)
        bodies["part"][i] = i if len(parts) == 1 else len(rows)
        rows += [(i, part) for part in parts if len(parts) > 1]
    shape = (len(rows), max(len(corner) for _, corner in rows))
    outlined, points = np.zeros(len(rows), dtype=POLYGON), np.zeros(shape, dtype=LOCAL)
    corners = np.zeros(shape, dtype=CORNER)
    for row, (i, number) in enumerate(rows):
        polygon, corner = polygons[i], corners[row, : len(number)]
        outlined["count"][row], outlined["body"][row] = len(number), i
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


def mark_flush(fixed: Sequence[Floats | None], outlines: Outlines) -> None:
    """Mark the corners and edges of fixed blocks that lie within the ground that these blocks form.

    Where fixed blocks form a continuous ground, such as two blocks with flush tops, nothing can
    strike the corners within its surface or the edges between two blocks. Around such a corner, the
    angles that the fixed blocks fill add up to at least 180 degrees; beside such an edge, the other
    side is filled as well, here at its middle and near its ends.

    Parameters
    ----------
    fixed : sequence of (n, 2) array or None
        Corners of each block [m]; None for a block that is not fixed.
    outlines : Outlines
        Outlines of the bodies and their parts; their corners are marked.
    """
    polygons = {i: corners for i, corners in enumerate(fixed) if corners is not None}
    if len(polygons) < 2:
        return
    near = 1e-9 * max(float(np.ptp(corners)) for corners in polygons.values())

    def filled(points: Floats) -> Floats:
        return np.sum([angles_at(points, other, near) for other in polygons.values()], axis=0)

    for i, corners in polygons.items():
        flush = filled(corners) > math.pi - 1e-6
        edges = np.roll(corners, -1, axis=0) - corners
        places = (corners + share * edges for share in (0.01, 0.5, 0.99))
        inner = np.all([filled(place) > 2.0 * math.pi - 1e-6 for place in places], axis=0)
        for row in np.nonzero(outlines.polygon["body"] == i)[0]:
            corner = outlines.corner[row, : outlines.polygon["count"][row]]
            corner["flush"] = flush[corner["number"]]
            corner["inner"] |= inner[corner["number"]]


def angles_at(points: Floats, polygon: Floats, near: float) -> Floats:
    """Return the angle that a polygon fills around each of some points on its outline, (n,) [rad].

    Points farther than `near` [m] from the outline have an angle of 0.
    """
    polygon = polygon if polygon_properties(polygon)[0] > 0.0 else polygon[::-1]
    edges = np.roll(polygon, -1, axis=0) - polygon
    before = np.roll(edges, 1, axis=0)
    turn = np.arctan2(
        before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0], (before * edges).sum(axis=1)
    )
    from_start = points[:, None] - polygon
    length = np.hypot(*edges.T)
    along = (from_start * edges).sum(axis=2) / length
    across = (from_start[..., 1] * edges[:, 0] - from_start[..., 0] * edges[:, 1]) / length
    at_corner = np.hypot(*np.moveaxis(from_start, 2, 0)) <= near
    on_edge = (np.abs(across) <= near) & (along > near) & (along < length - near)
    return (at_corner * (np.pi - turn)).sum(axis=1) + np.pi * on_edge.any(axis=1)


def pack_links(scene: Scene, bodies: Bodies) -> Links:
    """Return the supports, ordered by block a.

    Block a is free unless neither block is. Of two free blocks it is the one with the lower index,
    as for contacts.
    """

    def anchor(block: int, point: tuple[float, float]) -> tuple[float, float]:
        if block == TERRAIN:
            return point
        return point[0] - bodies["x"][block], point[1] - bodies["y"][block]

    def rank(end: tuple[int, tuple[float, float]]) -> tuple[bool, int]:
        block = end[0]
        return block == TERRAIN or bodies["status"][block] == FIXED, block

    links = np.zeros(len(scene.supports), dtype=LINK).view(np.recarray)
    for number, (link, support) in enumerate(zip(links, scene.supports, strict=True)):
        link["number"], link["yielding"], link["sign"] = number, math.inf, 1.0
        if isinstance(support, FixedPoint):
            link["kind"], link["a"], link["b"] = PIN, support.block, TERRAIN
            link["ax"], link["ay"] = anchor(support.block, support.point)
            link["bx"], link["by"] = support.point
            continue
        second = TERRAIN if support.block_b is None else support.block_b
        ends = (support.block_a, support.point_a), (second, support.point_b)
        (a, at_a), (b, at_b) = ends if second == TERRAIN else sorted(ends, key=rank)
        link["kind"], link["a"], link["b"] = BOLT, a, b
        link["ax"], link["ay"] = anchor(a, at_a)
        link["bx"], link["by"] = anchor(b, at_b)
        link["sign"] = 1.0 if a == support.block_a else -1.0
        link["stiffness"], link["prestress"] = support.stiffness, support.prestress
        link["length"] = math.dist(support.point_a, support.point_b)
        if support.yield_force is not None:
            link["yielding"] = support.yield_force
    return links[np.argsort(links["a"], kind="stable")]


class Arrays(NamedTuple):
    """All arrays of one scene that the step loop needs."""

    bodies: Bodies
    outlines: Outlines
    ground: GroundArrays
    interfaces: Interfaces
    links: Links
    shaking: Shaking
    stems: Stems
    now: Contacts
    before: Contacts
    work: Work
    monitors: Monitors
    parameters: NDArray[np.void]  # (1,) of PARAMETERS


def pack(
    scene: Scene,
    settings: Settings,
    stations: NDArray[np.float64],
    watch: tuple[float, float],
    leave: float = -math.inf,
) -> Arrays:
    """Return the arrays of the kernels for a scene in its initial state.

    Parameters
    ----------
    stations : (K,) array
        Ascending chainages whose first crossings are recorded [m].
    watch : (float, float)
        Interval of x in which energies are recorded [m].
    leave : float
        x beyond which blocks that move downhill may be ignored [m]; -inf: do not end the run early.
    """
    names = list(scene.surfaces)
    bodies, outlines = pack_bodies(scene, names)
    blocks = free_bodies(scene)
    room = 16 * blocks + 64
    interfaces = pack_interfaces(scene, names)
    parameters = pack_parameters(scene, settings, bodies, interfaces)
    start_fences(scene, bodies, parameters)
    return Arrays(
        bodies,
        outlines,
        pack_ground(scene.ground, names),
        interfaces,
        pack_links(scene, bodies),
        pack_shaking(scene),
        pack_stems(scene),
        empty_contacts(room),
        empty_contacts(room),
        empty_work(len(bodies), blocks, room),
        pack_monitors(scene, bodies, stations, watch, leave, settings.dt),
        parameters,
    )
