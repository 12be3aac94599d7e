"""Corners of polygons: checked, anticlockwise, read-only."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.validation import explain_validity

from rigdda import check
from rigdda.errors import BadInput
from rigdda.geometry import clearly_convex, edges, is_convex


def convex_polygon(where: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of a convex polygon, (n, 2), anticlockwise and read-only.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner, has no area or is not convex.
    """
    corners = simple_polygon(where, value)
    if not is_convex(corners):
        raise BadInput(where, corners.tolist(), "make it convex, or cut it into convex blocks")
    return corners


def simple_polygon(where: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of a simple polygon, (n, 2), anticlockwise and read-only.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner or has no area.
    """
    corners = check.points(where, value, 3)
    if clearly_convex(corners):
        return corners
    polygon = shapely.Polygon(corners)
    if not polygon.is_valid:
        raise BadInput(where, corners.tolist(), f"untangle it: {explain_validity(polygon)}")
    size = polygon.length
    if polygon.area < 1e-9 * size**2:
        raise BadInput(where, corners.tolist(), "give it an area")
    short = np.flatnonzero(np.hypot(*edges(corners).T) < 1e-9 * size)
    if short.size:
        raise BadInput(
            f"{where}[{short[0]}]", corners[short[0]].tolist(), "remove it: the next one repeats it"
        )
    if not polygon.exterior.is_ccw:
        corners = corners[::-1]
    corners = np.ascontiguousarray(corners)
    corners.setflags(write=False)
    return corners
