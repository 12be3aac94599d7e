"""Blocks that start deep in one another: refused, since no way out of it is the right one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda.errors import BadInput
from rigdda.geometry import overlap

MOST_SHARED = 0.01
"""Share of the smaller of two blocks that may be in the other one at the start [-]: that is pushed
out; blocks deeper in one another may stay wedged so, or part where no one expects it."""


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
