"""Roughness of the ground: pits at random, one in each length of a block."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import msgspec
import numpy as np

from rigdda.model.terrain import Terrain

STEEPEST = 5.0
"""Rise over run beyond which a piece of the ground stays as it is [-]: pits go straight down, which
on a face of 80 degrees would hardly change it."""


class Roughness(msgspec.Struct, frozen=True):
    """Pits in the ground of a scene.

    The ground gets a corner at each multiple of `spacing`, which lies below the mean surface by the
    size of a normal number, with the `amplitude` of its surface as standard deviation. Pits depend
    on chainage and seed alone, so that they are the same with every layout; where barriers stand
    there are none. Corners that the ground has already stay where they are, so what starts clear of
    the ground stays clear of it.

    Parameters
    ----------
    spacing : float
        Distance of the pits [m], about the size of a block.
    amplitude : mapping of str to float
        Standard deviation by the name of the surface [m].
    seed : sequence of int
        Of the random numbers.
    """

    spacing: float
    amplitude: Mapping[str, float]
    seed: tuple[int, ...]

    def applied(self, ground: Terrain, even: Iterable[tuple[float, float]] = ()) -> Terrain:
        """Return a ground with pits, but for the intervals of x that are to stay even [m]."""
        chain, names = ground.points, ground.surfaces
        first = math.floor(chain[:, 0].min() / self.spacing)
        last = math.ceil(chain[:, 0].max() / self.spacing)
        depth = np.abs(np.random.default_rng(self.seed).standard_normal(last - first + 1))
        points, surfaces = [tuple(chain[0])], []
        for (ax, ay), (bx, by), name in zip(chain, chain[1:], names, strict=False):
            for x in self._inner(ax, ay, bx, by, self.amplitude.get(name, 0.0), even):
                pit = self.amplitude[name] * depth[round(x / self.spacing) - first]
                points.append((x, ay + (by - ay) * (x - ax) / (bx - ax) - pit))
                surfaces.append(name)
            points.append((bx, by))
            surfaces.append(name)
        return Terrain.sound(np.array(points), tuple(surfaces))

    def _inner(
        self,
        ax: float,
        ay: float,
        bx: float,
        by: float,
        amplitude: float,
        even: Iterable[tuple[float, float]],
    ) -> list[float]:
        """Return the chainages of the pits within a piece of the ground, in its order [m]."""
        if amplitude == 0.0 or abs(by - ay) > STEEPEST * (bx - ax):
            return []
        clear = 0.25 * self.spacing  # from corners that are there, so that no piece is short
        low, high = math.ceil((ax + clear) / self.spacing), math.floor((bx - clear) / self.spacing)
        found = [k * self.spacing for k in range(low, high + 1)]
        return [x for x in found if not any(a <= x <= b for a, b in even)]
