"""The natural ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from rigdda import check
from rigdda.errors import BadInput


@dataclass(frozen=True, slots=True, eq=False)
class Terrain:
    """The ground, a chain of segments walked with the ground on its right.

    A slope that is walked from left to right has the ground below. Overhangs are allowed, the
    chain must not cross itself.

    Parameters
    ----------
    points : (m, 2) array_like
        Corners of the chain [m].
    surfaces : sequence of str, optional
        Surface name of each of the m - 1 segments; "rock" by default.

    Raises
    ------
    BadInput
        If the chain crosses itself, a segment has no length or the number of names is wrong.
    """

    points: NDArray[np.float64]
    surfaces: tuple[str, ...]

    def __init__(self, points: ArrayLike, surfaces: Sequence[str] | None = None):
        chain = check.points("terrain points", points, 2)
        short = np.flatnonzero(np.hypot(*np.diff(chain, axis=0).T) < 1e-9)
        if short.size:
            raise BadInput(
                f"terrain points[{short[0] + 1}]",
                chain[short[0] + 1].tolist(),
                "remove it: it repeats the point before it",
            )
        if not shapely.LineString(chain).is_simple:
            raise BadInput("terrain points", "chain", "untangle it: the chain crosses itself")
        if surfaces is None:
            surfaces = ("rock",) * (len(chain) - 1)
        names = check.sequence("terrain surfaces", surfaces, str, "names")
        if len(names) != len(chain) - 1:
            raise BadInput(
                "terrain surfaces",
                f"{len(names)} names",
                f"give one name for each of the {len(chain) - 1} segments",
            )
        object.__setattr__(self, "points", chain)
        object.__setattr__(self, "surfaces", names)

    @classmethod
    def sound(cls, points: NDArray[np.float64], surfaces: tuple[str, ...]) -> Terrain:
        """Return a terrain of sound points and surfaces, which are not checked."""
        terrain = object.__new__(cls)
        object.__setattr__(terrain, "points", points)
        object.__setattr__(terrain, "surfaces", surfaces)
        return terrain

    @property
    def solid(self) -> shapely.Polygon:
        """The ground as a polygon, as far out as the chain is long; empty where it has no inside.

        That is where a chain that does not end at its outermost points would cross its own frame.
        """
        first, last = self.points[0], self.points[-1]
        if np.hypot(*(last - first)) < 1e-9:
            closed = shapely.Polygon(self.points)
            return closed if not closed.exterior.is_ccw else shapely.Polygon()
        (left, low), (right, high) = self.points.min(axis=0), self.points.max(axis=0)
        far = 1.0 + right - left + high - low
        # the ground is on the right: below a chain from left to right, above one from right to left
        down = last[0] > first[0]
        near, away = (right + far, left - far) if down else (left - far, right + far)
        deep = low - far if down else high + far
        frame = [(near, last[1]), (near, deep), (away, deep), (away, first[1])]
        solid = shapely.Polygon([*self.points, *frame])
        return solid if solid.is_valid else shapely.Polygon()

    def height(self, x: float) -> float:
        """Return the elevation of the highest ground at chainage `x` [m].

        Raises
        ------
        BadInput
            If the terrain does not reach `x`.
        """
        p, q = self.points[:-1], self.points[1:]
        low, high = np.minimum(p[:, 0], q[:, 0]), np.maximum(p[:, 0], q[:, 0])
        over = (low <= x) & (x <= high)
        if not over.any():
            raise BadInput("x", x, f"stay on the terrain, {low.min():g} to {high.max():g} m")
        p, q = p[over], q[over]
        run = q[:, 0] - p[:, 0]
        share = np.where(run == 0.0, 1.0, (x - p[:, 0]) / np.where(run == 0.0, 1.0, run))
        return float(
            np.where(
                run == 0.0,
                np.maximum(p[:, 1], q[:, 1]),
                p[:, 1] + share * (q[:, 1] - p[:, 1]),
            ).max()
        )
