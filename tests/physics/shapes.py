"""Blocks that are not convex, and measures of overlap, shared by tests."""

from __future__ import annotations

import numpy as np
import shapely

import rigdda

L = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], dtype=float)
U = np.array([(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)], dtype=float)
T = np.array([(1, 0), (2, 0), (2, 2), (3, 2), (3, 3), (0, 3), (0, 2), (1, 2)], dtype=float)
PLUS = np.array(
    [
        *[(1, 0), (2, 0), (2, 1), (3, 1), (3, 2), (2, 2)],
        *[(2, 3), (1, 3), (1, 2), (0, 2), (0, 1), (1, 1)],
    ],
    dtype=float,
)
DART = np.array([(0, 0), (3, 1.5), (0, 3), (1, 1.5)], dtype=float)
KEYHOLE = np.array(
    [
        *[(0, 0), (5, 0), (5, 5), (3, 5), (3, 4), (4, 4), (4, 1), (1, 1), (1, 4), (2, 4), (2, 5)],
        (0, 5),
    ],
    dtype=float,
)
SHAPES = {"L": L, "U": U, "T": T, "plus": PLUS, "dart": DART, "keyhole": KEYHOLE}


def star(rng, n, radius=1.0) -> np.ndarray:
    """Return n corners at random distances round a point: a simple polygon, its centroid at 0."""
    turn = 2.0 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    reach = radius * rng.uniform(0.35, 1.0, n)
    corners = reach[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return corners - rigdda.geometry.polygon_properties(corners)[1]


def overlap(sim, i, j) -> float:
    """Return the area that blocks i and j share now [m2]."""
    first, second = (shapely.Polygon(sim.vertices(k)) for k in (i, j))
    return first.intersection(second).area
