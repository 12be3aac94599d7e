"""Bodies with their outlines, and the supports between them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Fence, GravityWall
from rigdda.barriers.fence import MASS
from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.constants import (
    ASLEEP,
    AWAKE,
    BOLT,
    FIXED,
    PIN,
    TERRAIN,
)
from rigdda.dynamics.correction import polygon_row, set_body_coordinates
from rigdda.dynamics.correction import polygons as polygons_of
from rigdda.dynamics.records import BODY, CORNER, LINK, LOCAL, POLYGON, Bodies, Floats, Links
from rigdda.geometry import convex_parts, moments, polygon_properties, turns
from rigdda.kernel import Direct, short_kernel
from rigdda.model.scene import Block, Scene
from rigdda.model.supports import FixedPoint


def free_bodies(scene: Scene) -> int:
    """Return how many bodies are not barriers that are fixed: these come first."""
    return len(scene.blocks) + sum(isinstance(b, GravityWall | Fence) for b in scene.barriers)


def pack_bodies(scene: Scene, names: list[str]) -> tuple[Bodies, Outlines]:
    """Return the blocks, then the barriers, as bodies at the start, and their outlines.

    The surface of fences comes after the named ones.
    """
    polygons = [b.vertices for b in scene.blocks] + [scene.outline(i) for i in scene.bodies]
    bodies = np.zeros(len(polygons), dtype=BODY)  # its columns are quicker to set than a recarray's
    outlines = pack_outlines(polygons, bodies)
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
    """Return the same of a barrier that is a body."""
    barrier = scene.barriers[number]
    if isinstance(barrier, Fence):
        area = polygon_properties(scene.outline(number))[0]
        density = MASS * barrier.height / area
        return density, 0.0, 0.0, 0.0, len(names), ASLEEP
    surface = names.index(scene.barrier_surface)
    if isinstance(barrier, GravityWall):
        return barrier.density, 0.0, 0.0, 0.0, surface, AWAKE
    return 1.0, 0.0, 0.0, 0.0, surface, FIXED


def start_fences(scene: Scene, bodies: Bodies, parameters: NDArray[np.void]) -> None:
    """Write how fences give way; they sleep until something comes near.

    Where nothing sleeps they are awake, and in static mode and without post-correction fixed.
    """
    p = parameters[0]
    moves = p["post_correction"] and not p["static"]
    for place in fences(scene):
        body = bodies[place]
        body["island"], body["held_at"] = place, body["x"]
        body["status"] = (ASLEEP if p["sleeping"] else AWAKE) if moves else FIXED
    set_brakes(scene, bodies)


def fences(scene: Scene) -> dict[int, Fence]:
    """Return the fences of a scene by their places among the bodies."""
    found = ((place, scene.barriers[i]) for place, i in enumerate(scene.bodies, len(scene.blocks)))
    return {place: barrier for place, barrier in found if isinstance(barrier, Fence)}


def set_brakes(scene: Scene, bodies: Bodies) -> None:
    """Write the forces against which fences give way, by the width of an event, and how far."""
    for place, fence in fences(scene).items():
        bodies["brake"][place], bodies["elongation"][place] = fence.braking_force, fence.elongation


def write_polygons(
    polygons: Sequence[Floats], traits: Sequence[Trait], bodies: Bodies, outlines: Outlines
) -> None:
    """Write the first bodies of an array and their outlines, from the corners of each."""
    corners = np.concatenate(polygons)
    _write.call(corners, np.array(traits, dtype=np.float64), bodies, outlines)


@short_kernel
def write_bodies(corners: NDArray, traits: NDArray, bodies: Bodies, outlines: Outlines) -> None:
    """Set bodies at their start from the corners of one after the other, and place their corners.

    The number of corners and the parts of each body are set. Density, velocity, surface and status
    are columns of `traits`.
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
        body.apart = math.inf
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
    """Add a dead load on body i at the start; its arm turns with the body."""
    (fx, fy), (x, y) = force, point - (bodies["x"][i], bodies["y"][i])
    bodies["force_x"][i] += fx
    bodies["force_y"][i] += fy
    bodies["moment_cos"][i] += x * fy - y * fx
    bodies["moment_sin"][i] -= x * fx + y * fy


def pack_outlines(polygons: list[Floats], bodies: Bodies) -> Outlines:
    """Return the outlines and convex parts of bodies, and set where each body's parts are.

    Where their corners are `write_polygons` sets.
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


def pack_links(scene: Scene, bodies: Bodies) -> Links:
    """Return the supports in order of their block a.

    Block a is free unless both are not, and the first of two that are free, as of contacts.
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
