"""Area, centroid and second moment of polygons, and their decomposition into convex parts."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda.kernel import Direct, kernel, short_kernel

CLEARLY = 1e-6
"""Cross product of the edges at a corner, or area, over the square of the perimeter, above which it
is more than a rounding error [-]."""

FLAT = 1e-9
"""Cross product of the edges at a corner over the square of the perimeter, below which it is a
rounding error [-]."""

STRAIGHT = 1e-7
"""Distance of a corner from the line through its neighbours over the perimeter, below which it lies
within an edge [-]. It is above rounding errors even for coordinates of kilometres, and below any
feature of a rock."""

GRID = 1e-9
"""Grid size of polygon intersections [m], much finer than blocks and much coarser than rounding."""


@kernel
def moments(vertices: NDArray, low: int, high: int) -> tuple[float, float, float, float]:
    """Return area, centroid x and y, and polar second moment of polygon vertices[low:high]."""
    x0, y0 = vertices[low, 0], vertices[low, 1]
    twice, sum_x, sum_y, second = 0.0, 0.0, 0.0, 0.0
    for k in range(low, high):
        j = k + 1 if k + 1 < high else low
        px, py = vertices[k, 0] - x0, vertices[k, 1] - y0
        qx, qy = vertices[j, 0] - x0, vertices[j, 1] - y0
        cross = px * qy - py * qx
        twice += cross
        sum_x += (px + qx) * cross
        sum_y += (py + qy) * cross
        second += cross * ((px * px + px * qx + qx * qx) + (py * py + py * qy + qy * qy))
    area = 0.5 * twice
    x, y = sum_x / (6.0 * area), sum_y / (6.0 * area)
    return area, x0 + x, y0 + y, second / 12.0 - area * (x * x + y * y)


@short_kernel
def moments_of(vertices: NDArray) -> tuple[float, float, float, float]:
    """Return the `moments` of a whole polygon."""
    return moments(vertices, 0, len(vertices))


_moments = Direct(moments_of)


def polygon_properties(
    vertices: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64], float]:
    """Return area [m2], centroid (2,) [m] and polar second moment of area [m4] of a polygon.

    These are exact sums over the edges of the (n, 2) corners, which must be anticlockwise. The
    second moment is about the centroid. Coordinates are taken relative to the first corner, so that
    a distant origin does not reduce the accuracy.
    """
    area, x, y, second = _moments.call(np.array(vertices, dtype=np.float64, order="C"))
    return area, np.array([x, y]), second


@short_kernel
def is_sound(vertices: NDArray) -> bool:
    """Return whether a polygon is anticlockwise and clearly convex, and therefore simple.

    Every corner must turn left by much more than rounding errors, and the edges must go round once:
    their direction changes from leftward to rightward only once. No edge and no area may be close
    to zero.
    """
    n, around, twice, turned = len(vertices), 0.0, 0.0, 0
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        dx, dy = vertices[j, 0] - vertices[k, 0], vertices[j, 1] - vertices[k, 1]
        around += math.sqrt(dx * dx + dy * dy)
    for k in range(n):
        i, j = k - 1 if k > 0 else n - 1, k + 1 if k + 1 < n else 0
        bx, by = vertices[k, 0] - vertices[i, 0], vertices[k, 1] - vertices[i, 1]
        ex, ey = vertices[j, 0] - vertices[k, 0], vertices[j, 1] - vertices[k, 1]
        if not bx * ey - by * ex > CLEARLY * around * around:
            return False
        turned += int(bx < 0.0 <= ex)
        twice += (vertices[k, 0] - vertices[0, 0]) * (vertices[j, 1] - vertices[0, 1])
        twice -= (vertices[k, 1] - vertices[0, 1]) * (vertices[j, 0] - vertices[0, 0])
    return turned == 1 and 0.5 * twice > CLEARLY * around * around


_is_sound = Direct(is_sound)


def clearly_convex(vertices: NDArray[np.float64]) -> bool:
    """Return whether a polygon is certainly simple, convex and anticlockwise, in a microsecond."""
    return bool(_is_sound.call(np.array(vertices, dtype=np.float64, order="C")))


def overlap(a: shapely.Polygon, b: shapely.Polygon) -> float:
    """Return the area of the intersection of two polygons [m2].

    A grid is used because without one, GEOS 3.14 may return all of `a` if two edges nearly
    coincide.
    """
    return float(shapely.intersection(a, b, grid_size=GRID).area)


def edges(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the edge vector that starts at each of the (n, 2) corners, (n, 2) [m]."""
    return np.concatenate([vertices[1:], vertices[:1]]) - vertices


def turns(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cross product of the two edges at each corner [m2], negative if concave."""
    edge = edges(vertices)
    before = np.concatenate([edge[-1:], edge[:-1]])
    return before[:, 0] * edge[:, 1] - before[:, 1] * edge[:, 0]


def is_convex(vertices: NDArray[np.float64]) -> bool:
    """Return whether an anticlockwise simple polygon is convex to rounding."""
    if clearly_convex(vertices):
        return True
    perimeter = np.hypot(*edges(vertices).T).sum()
    return bool(turns(vertices).min() >= -FLAT * perimeter**2)


def without_straight_corners(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a polygon without the corners that lie within an edge.

    `shapely.simplify` leaves some of them, because it never reduces a ring below four corners and
    removes none from the start of a ring until four corners have been kept.

    Parameters
    ----------
    vertices : (n, 2) array
        Corners of a simple polygon in either winding [m].

    Returns
    -------
    (m, 2) array
        The corners that are more than `STRAIGHT` times the perimeter from the line through their
        neighbours, in the same order [m]; at least three.
    """
    near = STRAIGHT * np.hypot(*edges(vertices).T).sum()
    while len(vertices) > 3:  # one at a time: one of two nearly coincident corners must stay
        across = np.roll(vertices, -1, axis=0) - np.roll(vertices, 1, axis=0)
        width = np.hypot(across[:, 0], across[:, 1])
        distance = np.abs(turns(vertices)) / np.where(width > 0.0, width, np.inf)
        flattest = int(distance.argmin())
        if distance[flattest] > near:
            break
        vertices = np.delete(vertices, flattest, axis=0)
    return vertices


def convex_parts(vertices: NDArray[np.float64]) -> list[list[int]]:
    """Return the corners of convex parts that together form a simple polygon.

    The polygon is triangulated, and cuts are removed again, the longest first, wherever the union
    is convex (Hertel and Mehlhorn 1983). This gives at most four times the minimum number of parts.

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
