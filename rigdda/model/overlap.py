"""Checks for blocks that overlap each other, the ground or a barrier at the start.

Such blocks are rejected, because there is no unique way to separate them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda.errors import BadInput
from rigdda.geometry import overlap
from rigdda.ground.terrain import Terrain
from rigdda.kernel import Direct, short_kernel

FEW = 16
"""Number of blocks up to which bounding boxes are compared in pairs; a tree is faster for more."""

MOST_SHARED = 0.01
"""Maximum overlap of two blocks at the start, relative to the area of the smaller one [-]; it is
removed by the contacts. Blocks with larger overlaps may remain wedged or separate in an unexpected
direction. The limit also applies to a block in the ground or in a barrier."""


class Sunk(NamedTuple):
    """Index of a block, and its area of overlap with something else [m2]."""

    block: int
    shared: float


def check_apart(outlines: Sequence[NDArray[np.float64]], fixed: Sequence[bool]) -> None:
    """Check that no two blocks overlap by too much, unless both are fixed.

    Parameters
    ----------
    outlines : sequence of (n, 2) arrays
        Corners of the blocks [m].
    fixed : sequence of bool
        Whether each is fixed.

    Raises
    ------
    BadInput
        If two blocks overlap by more than a hundredth of the smaller one.
    """
    if len(outlines) <= FEW and all_beside(outlines):
        return
    polygons = shapely.polygons([shapely.linearrings(corners) for corners in outlines])
    area = shapely.area(polygons)
    i, j = shapely.STRtree(polygons).query(polygons)
    held = np.array(fixed)
    pair = (i < j) & ~(held[i] & held[j])
    i, j = i[pair], j[pair]
    most = MOST_SHARED * np.minimum(area[i], area[j])
    # fast, but sometimes too large if edges nearly coincide: verify what it finds
    for k in np.flatnonzero(shapely.area(shapely.intersection(polygons[i], polygons[j])) > most):
        shared = overlap(polygons[i[k]], polygons[j[k]])
        if shared > most[k]:
            raise BadInput(
                f"blocks[{j[k]}]",
                outlines[j[k]].tolist(),
                f"move it: it overlaps block {i[k]} by {shared:.3g} m2",
            )


def all_beside(outlines: Sequence[NDArray[np.float64]]) -> bool:
    """Return whether the bounding boxes of all outlines are disjoint."""
    if len(outlines) == 1:
        return True
    boxes = [_box(corners) for corners in outlines]
    return not any(_overlap(a, b) for k, a in enumerate(boxes) for b in boxes[:k])


def _box(corners: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Return the least x and y and the greatest x and y of corners [m]."""
    x, y = zip(*corners.tolist(), strict=True)
    return min(x), min(y), max(x), max(y)


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]


def in_ground(ground: Terrain, outlines: Sequence[NDArray[np.float64]]) -> Sunk | None:
    """Return the first block with more than a hundredth of its area in the ground, or None."""
    chain = np.array(ground.points)
    doubtful = [k for k, o in enumerate(outlines) if not _on_ground.call(chain, np.array(o))]
    if not doubtful:
        return None
    found = _deepest(ground.solid, [outlines[k] for k in doubtful])
    return found and Sunk(doubtful[found.block], found.shared)


@short_kernel
def surely_on_ground(chain: NDArray, corners: NDArray) -> bool:
    """Return whether at most a hundredth of a polygon is certainly below a chain.

    The chain must run from left to right. The area below it is bounded by the greatest depth times
    the width of the polygon; the greatest depth is at a corner of either.
    """
    n, last = len(corners), len(chain) - 1
    low, high, twice, depth = math.inf, -math.inf, 0.0, 0.0
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        low, high = min(low, corners[k, 0]), max(high, corners[k, 0])
        twice += (corners[k, 0] - corners[0, 0]) * (corners[j, 1] - corners[0, 1])
        twice -= (corners[k, 1] - corners[0, 1]) * (corners[j, 0] - corners[0, 0])
        if corners[k, 0] <= chain[0, 0]:
            depth = max(depth, chain[0, 1] - corners[k, 1])
        if corners[k, 0] >= chain[last, 0]:
            depth = max(depth, chain[last, 1] - corners[k, 1])
    for s in range(last):
        x0, y0, x1, y1 = chain[s, 0], chain[s, 1], chain[s + 1, 0], chain[s + 1, 1]
        if x1 < x0:
            return False
        if x1 < low or x0 > high:
            continue
        for k in range(n):
            j = k + 1 if k + 1 < n else 0
            ax, ay, bx, by = corners[k, 0], corners[k, 1], corners[j, 0], corners[j, 1]
            if x0 <= ax <= x1:  # a corner of the polygon over the segment
                over = y0 + (y1 - y0) * (ax - x0) / (x1 - x0) if x1 > x0 else max(y0, y1)
                depth = max(depth, over - ay)
            for end in range(2):  # the ends of the segment under an edge of the polygon
                x, y = (x0, y0) if end == 0 else (x1, y1)
                if min(ax, bx) <= x <= max(ax, bx):
                    under = ay + (by - ay) * (x - ax) / (bx - ax) if ax != bx else min(ay, by)
                    depth = max(depth, y - under)
    return depth * (high - low) <= 0.5 * MOST_SHARED * abs(0.5 * twice)


_on_ground = Direct(surely_on_ground)


def deepest(solid: NDArray[np.float64], outlines: Sequence[NDArray[np.float64]]) -> Sunk | None:
    """Return the first block with more than a hundredth of its area in a polygon, or None.

    Parameters
    ----------
    solid : (n, 2) array
        Corners of a barrier [m].
    outlines : sequence of (n, 2) arrays
        Corners of the blocks [m].
    """
    box = _box(solid)
    near = [k for k, corners in enumerate(outlines) if _overlap(_box(corners), box)]
    if not near:
        return None
    found = _deepest(shapely.Polygon(solid), [outlines[k] for k in near])
    return found and Sunk(near[found.block], found.shared)


def _deepest(solid: shapely.Polygon, outlines: Sequence[NDArray[np.float64]]) -> Sunk | None:
    """Return the first block with more than a hundredth of its area in a solid, or None."""
    polygons = shapely.polygons([shapely.linearrings(corners) for corners in outlines])
    near = np.flatnonzero(shapely.intersects(solid, polygons))
    most = MOST_SHARED * shapely.area(polygons)
    shared = shapely.area(shapely.intersection(solid, polygons[near]))
    # verify what the fast intersection finds, as in `check_apart`
    for k in near[shared > most[near]]:
        sure = overlap(solid, polygons[k])
        if sure > most[k]:
            return Sunk(int(k), sure)
    return None
