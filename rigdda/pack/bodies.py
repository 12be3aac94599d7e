"""Bodies with their outlines, and the supports between them."""

from __future__ import annotations

import math

import numpy as np

from rigdda.barriers import Fence, GravityWall
from rigdda.constants import (
    AWAKE,
    BOLT,
    FIXED,
    PIN,
    TERRAIN,
)
from rigdda.correction import place_all_corners
from rigdda.geometry import convex_parts, polygon_properties, turns
from rigdda.records import (
    BODY,
    CORNER,
    LINK,
    POINT,
    POLYGON,
    Bodies,
    Floats,
    Links,
    Outlines,
)
from rigdda.scene import Scene
from rigdda.supports import FixedPoint


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
