"""Cutting of a rock mass into blocks by joint sets."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Annotated, NamedTuple

import msgspec
import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda import fields
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.geometry import FLAT, without_straight_corners

SLIVER = 0.35
"""Share of the specified mean area below which a block is merged with a neighbour if the union is
convex."""

CHIP = 0.1
"""Share of the specified mean area below which a block is merged with a neighbour even if the union
is not convex: very small blocks would make mass ratios of 1000 and contacts harder to solve."""

AREA_TOLERANCE = 0.05
"""Tolerated relative error of the mean block area. Joints are redrawn, with their spacings
rescaled, until it is met."""

MOST_DRAWS = 200

EDGE_TOLERANCE = 1e-7
"""Distance within which a corner counts as on an edge, relative to the perimeter of the cell [-];
allows for rounding."""


@documented
class JointSet(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A set of nearly parallel joints.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    dip_deg: Annotated[
        float,
        about("Dip of the joints below the horizontal, towards +x.", "deg", ge=-90.0, le=90.0),
    ]
    spacing: Annotated[
        float,
        about(
            "Mean spacing, measured across the joints. If the source specifies a `block_area`, the "
            "spacings of all sets are multiplied by a common factor.",
            "m",
            ge=1e-3,
            le=1e3,
        ),
    ] = 1.0
    scatter: Annotated[
        float,
        about("Standard deviation of the spacing over its mean.", "-", ge=0.0, le=0.4),
    ] = 0.0
    persistence: Annotated[
        float,
        about(
            "Share of a joint that is open. Across the rest, pairs of blocks stay joined if their "
            "union is convex.",
            "-",
            gt=0.0,
            le=1.0,
        ),
    ] = 1.0

    def __post_init__(self) -> None:
        fields.check(self, "joint set: ")


def cut(
    source: shapely.Polygon,
    joints: tuple[JointSet, ...],
    block_area: float | None,
    rng: np.random.Generator,
) -> list[NDArray[np.float64]]:
    """Cut a convex rock mass into blocks.

    Blocks are convex except where a very small block was merged with a neighbour.

    Parameters
    ----------
    source : shapely.Polygon
        The rock mass.
    joints : tuple of JointSet
        At least two sets of different dip.
    block_area : float or None
        Mean area [m2], met within 5 % by multiplying the spacings by a common factor. With None the
        spacings are kept.
    rng : numpy.random.Generator
        Generator for offsets, spacings and rock bridges.

    Returns
    -------
    list of (n, 2) arrays
        Corners of the blocks; their areas add up to that of the source.

    Raises
    ------
    BadInput
        If the joints cannot cut the mass into blocks of that area.
    """
    if block_area is None:
        usual = min(spaced_area(joints), source.area)
        return _outlines(_join_bridges(_cells(source, joints, 1.0, rng), joints, usual, rng))
    scale = math.sqrt(block_area / math.prod(j.spacing for j in joints[:2]))
    for _ in range(MOST_DRAWS):
        cells = _join_bridges(_cells(source, joints, scale, rng), joints, block_area, rng)
        mean = source.area / len(cells)
        if abs(mean / block_area - 1.0) <= AREA_TOLERANCE:
            return _outlines(cells)
        scale *= math.sqrt(block_area / mean)
    raise BadInput(
        "source: block_area",
        block_area,
        f"choose joint sets that cut {source.area:g} m2 into blocks of this mean area",
    )


def spaced_area(joints: tuple[JointSet, ...]) -> float:
    """Return the mean area of the cells between persistent joints in a large mass [m2].

    In a large mass there are as many cells as crossings of joints. Two sets of spacings a and b
    whose dips differ by an angle t cross sin(t) / (a b) times per unit of area.
    """
    crossings = sum(
        abs(math.sin(math.radians(one.dip_deg - two.dip_deg))) / (one.spacing * two.spacing)
        for one, two in combinations(joints, 2)
    )
    return 1.0 / crossings


def _outlines(cells: list[shapely.Polygon]) -> list[NDArray[np.float64]]:
    """Return the corners of cells [m]."""
    corners = [shapely.get_coordinates(cell)[:-1] for cell in cells]
    return [without_straight_corners(outline) for outline in corners]


def _cells(
    source: shapely.Polygon, joints: tuple[JointSet, ...], scale: float, rng: np.random.Generator
) -> list[shapely.Polygon]:
    """Return the pieces between the joints of all sets."""
    centre = np.array(source.centroid.coords[0])
    reach = source.length
    around = source.buffer(1e-3 * reach)  # so that traces cut the source completely
    shapely.prepare(around)
    lines: list[shapely.LineString] = [source.exterior]
    for joint in joints:
        dip = math.radians(joint.dip_deg)
        along = np.array([math.cos(dip), -math.sin(dip)])
        across = np.array([math.sin(dip), math.cos(dip)])
        spacing = joint.spacing * scale
        draws = 1.0 + joint.scatter * rng.standard_normal(int(2 * reach / spacing) + 4)
        steps = spacing * np.clip(draws, 0.5, 1.5)
        offsets = np.cumsum(steps) - reach - spacing * rng.random()
        mids = centre + offsets[np.abs(offsets) < reach, None] * across
        traces = shapely.linestrings(np.stack([mids - reach * along, mids + reach * along], axis=1))
        near = shapely.intersection(traces[shapely.intersects(around, traces)], around)
        lines.extend(near[shapely.length(near) > 0.0])
    nodes = shapely.node(shapely.multilinestrings(lines))
    pieces = shapely.get_parts(shapely.polygonize(shapely.get_parts(nodes)))
    inside = shapely.contains(source, shapely.point_on_surface(pieces))
    return list(pieces[inside])


def _join_bridges(
    cells: list[shapely.Polygon],
    joints: tuple[JointSet, ...],
    block_area: float,
    rng: np.random.Generator,
) -> list[shapely.Polygon]:
    """Merge cells across rock bridges, and then small cells, where the union is convex."""
    centres = shapely.get_coordinates(shapely.centroid(cells)).tolist()
    order = sorted(range(len(cells)), key=centres.__getitem__)
    parts: list[shapely.Polygon | None] = [cells[i] for i in order]
    first, second = shapely.STRtree(parts).query(parts, predicate="intersects")
    other = first != second
    ends = np.cumsum(np.bincount(first[other], minlength=len(parts)))
    beside = [near.tolist() for near in np.split(second[other], ends[:-1])]
    for place, drawn in enumerate(rng.random(len(parts)).tolist()):
        bridged = [drawn < 1.0 - joint.persistence for joint in joints]
        if any(bridged):
            _join(parts, beside, place, Bridges(joints, bridged))
    size = shapely.area(parts)  # nan for parts that were merged
    for i in np.argsort(np.where(size > 0.0, size, math.inf), kind="stable"):
        if 0.0 < shapely.area(parts[i]) < SLIVER * block_area:
            _join(parts, beside, int(i))
    for i in np.flatnonzero(shapely.area(parts) < CHIP * block_area):
        if 0.0 < shapely.area(parts[i]) < CHIP * block_area:
            _join(parts, beside, int(i), convex=False)
    return [c for c in parts if c is not None]


class Bridges(NamedTuple):
    """Joint sets, and which of them have a rock bridge at a block."""

    joints: tuple[JointSet, ...]
    bridged: list[bool]

    def across(self, edges: NDArray[np.object_]) -> NDArray[np.bool_]:
        """Return which common edges of blocks belong to a joint set with a rock bridge.

        An edge may consist of several pieces in any order; its ends are its leftmost and rightmost
        points.
        """
        dips = np.array([joint.dip_deg for joint in self.joints])
        points = [shapely.get_coordinates(edge).tolist() for edge in edges]
        x, y = np.subtract([max(p) for p in points], [min(p) for p in points]).T
        off = (np.degrees(np.arctan2(-y, x))[:, None] - dips) % 180.0
        return np.array(self.bridged)[np.minimum(off, 180.0 - off).argmin(axis=1)]


def _join(
    parts: list[shapely.Polygon | None],
    beside: list[list[int]],
    i: int,
    bridges: Bridges | None = None,
    convex: bool = True,
) -> None:
    """Merge part `i` with the neighbour with the longest common edge whose union is convex.

    With `bridges`, only edges across rock bridges are considered. If not `convex`, the union may be
    any simple polygon.
    """
    cell = parts[i]
    others = [j for j in beside[i] if parts[j] is not None]
    if cell is None or not others:
        return
    shapes = np.array([parts[j] for j in others])
    if not convex:  # merging may have removed a shared node from an edge
        near = EDGE_TOLERANCE * cell.length
        cell = shapely.snap(cell, shapely.multipolygons(shapes), near)
        shapes = shapely.snap(shapes, cell, near)
    common = shapely.intersection(cell, shapes)
    edges = shapely.length(common).round(9)
    shared = edges > 0.0
    if bridges is not None and shared.any():
        edges[shared] *= bridges.across(common[shared])
    for place in np.argsort(-edges, kind="stable"):
        if edges[place] == 0.0:
            return
        joined, best = _union(cell, shapes[place]), others[place]
        if joined is None:
            continue
        if not convex or joined.convex_hull.area - joined.area < 1e-9 * joined.area:
            break
    else:
        return
    parts[best], parts[i] = joined.simplify(EDGE_TOLERANCE * cell.length), None
    beside[best] = sorted({*beside[best], *beside[i]} - {best, i})
    for j in beside[i]:
        beside[j] = sorted({*beside[j], best} - {i, j})


def _union(cell: shapely.Polygon, other: shapely.Polygon) -> shapely.Polygon | None:
    """Return the union of two cells that share an edge, or None if it is not a simple polygon.

    If a cell has lost a node of that edge, the edges nearly coincide, and GEOS 3.14 may return only
    one of the two cells. Restoring the nodes by snapping avoids this.
    """
    area, near = cell.area + other.area, EDGE_TOLERANCE * cell.length
    for _ in range(2):
        joined = shapely.union(cell, other)
        if abs(joined.area - area) <= FLAT * area:
            return joined if joined.geom_type == "Polygon" and not joined.interiors else None
        cell, other = shapely.snap(cell, other, near), shapely.snap(other, cell, near)
    return None
