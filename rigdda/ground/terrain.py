"""Natural ground, and its roughness: random pits, spaced about one block size apart."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from rigdda import check
from rigdda.errors import BadInput
from rigdda.rounding import chainage

SAME_POINT = 1e-9
"""Distance below which two points of the ground are the same [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Terrain:
    """Ground surface as a chain of segments with the ground on its right-hand side.

    A slope whose points run from left to right has the ground below. Overhangs are permitted, but
    the chain must not cross itself.

    Parameters
    ----------
    points : (m, 2) array_like
        Corners of the chain [m].
    surfaces : sequence of str, optional
        Surface name of each of the m - 1 segments; "rock" by default.

    Raises
    ------
    BadInput
        If the chain crosses itself, a segment has zero length or the number of names is wrong.
    """

    points: NDArray[np.float64]
    surfaces: tuple[str, ...]

    def __init__(self, points: ArrayLike, surfaces: Sequence[str] | None = None):
        chain = check.points("terrain points", points, 2)
        short = np.flatnonzero(np.hypot(*np.diff(chain, axis=0).T) < SAME_POINT)
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
        """Return a terrain of valid points and surfaces without checking them."""
        terrain = object.__new__(cls)
        object.__setattr__(terrain, "points", points)
        object.__setattr__(terrain, "surfaces", surfaces)
        return terrain

    @property
    def solid(self) -> shapely.Polygon:
        """The ground as a polygon, extended outwards and downwards by about the size of the chain.

        It is empty if the chain does not end at its outermost points, so that the extension would
        cross it.
        """
        first, last = self.points[0], self.points[-1]
        if np.hypot(*(last - first)) < 1e-9:
            closed = shapely.Polygon(self.points)
            return closed if not closed.exterior.is_ccw else shapely.Polygon()
        (left, low), (right, high) = self.points.min(axis=0), self.points.max(axis=0)
        far = 1.0 + right - left + high - low
        # the ground is below a chain from left to right and above one from right to left
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
        chain = self.points[:, 0]
        low, high = np.minimum(chain[:-1], chain[1:]), np.maximum(chain[:-1], chain[1:])
        over = np.flatnonzero((low <= x) & (x <= high))
        if not over.size:
            told = f"stay on the terrain, {chainage(low.min())} to {chainage(high.max())} m"
            raise BadInput("x", x, told)
        ends = zip(self.points[over].tolist(), self.points[over + 1].tolist(), strict=True)
        return max(
            max(ay, by) if ax == bx else ay + (x - ax) / (bx - ax) * (by - ay)
            for (ax, ay), (bx, by) in ends
        )

    def inclination(self, x: ArrayLike, base: ArrayLike) -> NDArray[np.float64]:
        """Return the inclination of the ground around chainages, positive where it falls [rad].

        It is that of the line between the highest ground half a base uphill and half a base
        downhill; beyond its ends, the terrain counts as level.

        Parameters
        ----------
        x, base : array_like
            Chainages and lengths of the bases, of the same shape or one of them a number [m].
        """
        middle, half = np.broadcast_arrays(np.asarray(x, float), 0.5 * np.asarray(base, float))
        low, high = self.points[:, 0].min(), self.points[:, 0].max()
        ends = np.clip(np.stack([middle - half, middle + half]), low, high)
        rise = np.diff(self._heights(ends), axis=0)[0]
        return np.arctan2(-rise, 2.0 * half)

    def _heights(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the elevations of the highest ground at chainages on the terrain [m]."""
        chain, level = self.points.T
        if (np.diff(chain) > 0.0).all():
            return np.interp(x, chain, level)
        return np.array([self.height(at) for at in x.ravel().tolist()]).reshape(x.shape)


STEEPEST = 5.0
"""Slope, rise over run, above which the ground has no pits [-]. Pits are vertical, so that they
would hardly change a face of 80 degrees."""

PIT_CLEARANCE = 0.25
"""Minimum distance of a pit from an interval without pits, relative to the spacing [-], which
avoids steps at its ends."""

SAME_PLACE = 1e-3
"""Distance within which a corner of the ground replaces a pit, relative to the spacing [-]."""

REACH = 1.0 + PIT_CLEARANCE
"""Distance from an interval without pits within which that interval affects the ground, relative to
the spacing [-]."""


class Roughness(msgspec.Struct, frozen=True):
    """Random pits in the ground of a scene.

    At each multiple of `spacing` the ground lies below the smooth surface by the absolute value of
    a standard normal number times the `amplitude` of its surface; between them the depth is linear
    in x. Pits therefore do not depend on the resolution of the survey, and objects clear of the
    smooth ground remain clear of the rough ground. The ground is smooth under barriers; beyond 1.25
    spacings of a barrier the pits are the same for every layout.

    Parameters
    ----------
    spacing : float
        Distance between pits [m], about the size of a block.
    amplitude : mapping of str to float
        Root-mean-square depth of the pits by name of the surface [m].
    seed : sequence of int
        Seed of the random numbers.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    spacing: float
    amplitude: Mapping[str, float]
    seed: tuple[int, ...]

    def __post_init__(self) -> None:
        spacing = check.number("roughness.spacing", self.spacing, 0.0, 1e3, open_low=True)
        amplitude: Any = self.amplitude
        if not isinstance(amplitude, Mapping):
            raise BadInput("roughness.amplitude", amplitude, "give a depth for each surface")
        depths = {
            str(name): check.number(f"roughness.amplitude[{name!r}]", depth, 0.0, 1e2)
            for name, depth in amplitude.items()
        }
        if not isinstance(self.seed, list | tuple):
            raise BadInput("roughness.seed", self.seed, "give a sequence of whole numbers")
        seed = tuple(check.integer("roughness.seed", number, 0) for number in self.seed)
        for name, value in (("spacing", spacing), ("amplitude", depths), ("seed", seed)):
            msgspec.structs.force_setattr(self, name, value)

    def applied(self, ground: Terrain, even: Sequence[tuple[float, float]] = ()) -> Terrain:
        """Return the ground with pits, except in the intervals `even` of x [m].

        Ground with overhangs is returned unchanged.
        """
        x, y = ground.points.T
        if (np.diff(x) < 0.0).any():
            return ground
        nodes, depths = self._nodes(x[0], x[-1], even)
        points, names = [], []
        rise, run = np.abs(np.diff(y)), np.diff(x)
        amplitude = np.array([self.amplitude.get(name, 0.0) for name in ground.surfaces])
        amplitude[rise > STEEPEST * run] = 0.0
        for i, name in enumerate(ground.surfaces):
            inner = np.zeros(0)
            if amplitude[i] > 0.0:
                away = SAME_PLACE * self.spacing
                inner = nodes[(nodes > x[i] + away) & (nodes < x[i + 1] - away)]
            at = np.concatenate([x[i : i + 1], inner])
            level = np.concatenate([y[i : i + 1], np.interp(inner, x[i : i + 2], y[i : i + 2])])
            deep = np.full(len(at), amplitude[i])
            deep[0] = min(amplitude[max(i - 1, 0)], amplitude[i])  # no step between two surfaces
            points.append(np.column_stack([at, level - deep * np.interp(at, nodes, depths)]))
            names += [name] * len(at)
        points.append(ground.points[-1:])
        return Terrain.sound(np.concatenate(points), tuple(names))

    def _nodes(
        self, left: float, right: float, even: Sequence[tuple[float, float]]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the nodes of the pit depth, ascending [m], and the depth over amplitude."""
        first, last = math.floor(left / self.spacing), math.ceil(right / self.spacing)
        nodes: NDArray[np.float64] = self.spacing * np.arange(first, last + 1, dtype=np.float64)
        rng = np.random.Generator(np.random.PCG64(self.seed))
        depths: NDArray[np.float64] = np.abs(rng.standard_normal(len(nodes)))
        for low, high in even:
            clear = PIT_CLEARANCE * self.spacing
            kept = (nodes < low - clear) | (nodes > high + clear)
            kept |= (depths == 0.0) & ((nodes < low) | (nodes > high))  # ends of another interval
            nodes, depths = nodes[kept], depths[kept]
            nodes, depths = np.append(nodes, (low, high)), np.append(depths, (0.0, 0.0))
        order = np.unique(nodes, return_index=True)[1]
        return nodes[order], depths[order]
