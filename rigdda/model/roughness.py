"""Roughness of the ground: pits at random, one in each length of a block."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

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

    def applied(self, ground: Terrain, even: Sequence[tuple[float, float]] = ()) -> Terrain:
        """Return a ground with pits, but for the intervals of x that are to stay even [m]."""
        chain, names = ground.points, ground.surfaces
        first = math.floor(chain[:, 0].min() / self.spacing)
        last = math.ceil(chain[:, 0].max() / self.spacing)
        depth = np.abs(np.random.default_rng(self.seed).standard_normal(last - first + 1))
        points, surfaces = [tuple(chain[0])], []
        for (ax, ay), (bx, by), name in zip(chain, chain[1:], names, strict=False):
            amplitude = self.amplitude.get(name, 0.0)
            if amplitude > 0.0 and abs(by - ay) <= STEEPEST * (bx - ax):
                rise = (by - ay) / (bx - ax)
                for x, place in self._corners(ax, bx, even):
                    pit = amplitude * depth[place - first] if place is not None else 0.0
                    points.append((x, ay + rise * (x - ax) - pit))
                    surfaces.append(name)
            points.append((bx, by))
            surfaces.append(name)
        return Terrain.sound(np.array(points), tuple(surfaces))

    def _corners(
        self, ax: float, bx: float, even: Sequence[tuple[float, float]]
    ) -> list[tuple[float, int | None]]:
        """Return the new corners of a piece of the ground from left to right.

        The chainage of each [m], and the number of its pit, None for an end of an even interval.
        """
        clear = 0.25 * self.spacing  # from corners that are there, so that no piece is short
        low, high = math.ceil((ax + clear) / self.spacing), math.floor((bx - clear) / self.spacing)
        pits = [(k * self.spacing, k) for k in range(low, high + 1)]
        found: list[tuple[float, int | None]] = [
            (x, k) for x, k in pits if not any(a <= x <= b for a, b in even)
        ]
        found += [(x, None) for ends in even for x in ends if ax < x < bx]
        return sorted(found, key=lambda corner: corner[0])
