"""Blocks that start deep in one another or in the ground: refused, no way out is the right one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda.errors import BadInput
from rigdda.geometry import overlap

MOST_SHARED = 0.01
"""Share of the smaller of two blocks that may be in the other one at the start [-]: that is pushed
out; blocks deeper in one another may stay wedged so, or part where no one expects it. The same of a
block in the ground or in a barrier."""


class Sunk(NamedTuple):
    """The place of a block in a list, and its area that is in something else [m2]."""

    block: int
    shared: float


def check_apart(outlines: Sequence[NDArray[np.float64]], fixed: Sequence[bool]) -> None:
    """Check that no block starts deep in another one, unless both are fixed.

    Parameters
    ----------
    outlines : sequence of (n, 2) arrays
        Corners of the blocks [m].
    fixed : sequence of bool
        Which are fixed.

    Raises
    ------
    BadInput
        If two blocks share more than a hundredth of the smaller one.
    """
    polygons = shapely.polygons([shapely.linearrings(corners) for corners in outlines])
    area = shapely.area(polygons)
    i, j = shapely.STRtree(polygons).query(polygons)
    held = np.array(fixed)
    pair = (i < j) & ~(held[i] & held[j])
    i, j = i[pair], j[pair]
    most = MOST_SHARED * np.minimum(area[i], area[j])
    # quick and, where edges nearly coincide, too much at times: what it finds is looked at again
    for k in np.flatnonzero(shapely.area(shapely.intersection(polygons[i], polygons[j])) > most):
        shared = overlap(polygons[i[k]], polygons[j[k]])
        if shared > most[k]:
            raise BadInput(
                f"blocks[{j[k]}]",
                outlines[j[k]].tolist(),
                f"move it: {shared:.3g} m2 of it are in block {i[k]}",
            )


def deepest(solid: shapely.Polygon, outlines: Sequence[NDArray[np.float64]]) -> Sunk | None:
    """Return the first block of which more than a hundredth is in a solid, None if none is.

    Parameters
    ----------
    solid : shapely.Polygon
        The ground or a barrier.
    outlines : sequence of (n, 2) arrays
        Corners of the blocks [m].
    """
    polygons = shapely.polygons([shapely.linearrings(corners) for corners in outlines])
    near = np.flatnonzero(shapely.intersects(solid, polygons))
    most = MOST_SHARED * shapely.area(polygons)
    shared = shapely.area(shapely.intersection(solid, polygons[near]))
    # as above: what the quick way finds is looked at again
    for k in near[shared > most[near]]:
        sure = overlap(solid, polygons[k])
        if sure > most[k]:
            return Sunk(int(k), sure)
    return None
