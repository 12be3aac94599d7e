"""Area, centroid and second moment of polygons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def polygon_properties(
    vertices: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64], float]:
    """Return area [m2], centroid (2,) [m] and polar second moment of area [m4] of a polygon.

    Exact sums over the edges of the (n, 2) corners, anticlockwise; the second moment is about the
    centroid. Taken relative to the first corner, so that far coordinates cost no digits.
    """
    origin = vertices[0]
    p = vertices - origin
    q = np.roll(p, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    area = 0.5 * cross.sum()
    centre = ((p + q) * cross[:, None]).sum(axis=0) / (6.0 * area)
    about_origin = (cross * ((p * p + p * q + q * q).sum(axis=1))).sum() / 12.0
    return float(area), origin + centre, float(about_origin - area * centre @ centre)
