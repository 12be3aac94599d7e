"""Area, centroid and second moment of polygons, and their convex parts."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

FLAT = 1e-9
"""Turn at a corner over the square of the perimeter that counts as none [-]: rounding."""

GRID = 1e-9
"""Grid of overlaps [m]: far finer than blocks, far coarser than rounding."""


def polygon_properties(
    vertices: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64], float]:
    """Return area [m2], centroid (2,) [m] and polar second moment of area [m4] of a polygon.

    Exact sums over the edges of the (n, 2) corners, anticlockwise; the second moment is about the
    centroid. Taken relative to the first corner, so that far coordinates cost no digits.
    """
    origin = vertices[0]
    p = vertices - origin
    q = np.concatenate([p[1:], p[:1]])
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    area = 0.5 * cross.sum()
    centre = ((p + q) * cross[:, None]).sum(axis=0) / (6.0 * area)
    about_origin = (cross * ((p * p + p * q + q * q).sum(axis=1))).sum() / 12.0
    return float(area), origin + centre, float(about_origin - area * centre @ centre)


def overlap(a: shapely.Polygon, b: shapely.Polygon) -> float:
    """Return the area that two polygons share [m2].

    Taken on a grid: without one GEOS 3.14 may return all of `a` where two edges nearly coincide.
    """
    return float(shapely.intersection(a, b, grid_size=GRID).area)


def edges(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the edge that starts at each of the (n, 2) corners, (n, 2) [m]."""
    return np.concatenate([vertices[1:], vertices[:1]]) - vertices


def turns(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cross product of the two edges at each corner [m2], negative where concave."""
    edge = edges(vertices)
    before = np.concatenate([edge[-1:], edge[:-1]])
    return before[:, 0] * edge[:, 1] - before[:, 1] * edge[:, 0]


def is_convex(vertices: NDArray[np.float64]) -> bool:
    """Return whether an anticlockwise simple polygon is convex but for rounding."""
    perimeter = np.hypot(*edges(vertices).T).sum()
    return bool(turns(vertices).min() >= -FLAT * perimeter**2)


def convex_parts(vertices: NDArray[np.float64]) -> list[list[int]]:
    """Return the corners of convex parts that together are a simple polygon.

    Hertel and Mehlhorn (1983): the polygon is cut into triangles, and cuts are left out again,
    the longest first, wherever what they join is convex; at most four times the fewest parts.

    Parameters
    ----------
    vertices : (n, 2) array
        Corners of a simple polygon, anticlockwise.

    Returns
    -------
    list of list of int
        Indices of the corners of each part, anticlockwise; no corners are added.
    """
    if is_convex(vertices):
        return [list(range(len(vertices)))]
    number = {tuple(v): i for i, v in enumerate(vertices.tolist())}
    triangles = shapely.constrained_delaunay_triangles(shapely.Polygon(vertices))
    rings = [np.array(shapely.normalize(t).exterior.coords)[:3] for t in triangles.geoms]
    parts = [[number[tuple(v)] for v in ring[::-1].tolist()] for ring in rings]

    def length(cut: tuple[int, int]) -> float:
        return float(np.hypot(*(vertices[cut[0]] - vertices[cut[1]])))

    for cut in sorted({e for part in parts for e in _edges(part) if e[0] < e[1]}, key=length)[::-1]:
        beside = [p for p in parts if cut in _edges(p) or cut[::-1] in _edges(p)]
        if len(beside) == 2:
            union = _join_at(beside[0], beside[1], cut)
            if is_convex(vertices[union]):
                parts = [p for p in parts if p not in beside] + [union]
    return parts


def _edges(part: list[int]) -> list[tuple[int, int]]:
    """Return the edges of a part as pairs of corners."""
    return list(zip(part, part[1:] + part[:1], strict=True))


def _join_at(first: list[int], second: list[int], cut: tuple[int, int]) -> list[int]:
    """Return the union of two anticlockwise parts that share a cut."""
    if cut not in _edges(first):
        first, second = second, first
    i, j = first.index(cut[1]), second.index(cut[0])
    return first[i:] + first[:i] + (second[j:] + second[:j])[1:-1]
