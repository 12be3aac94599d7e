"""What single barriers are worth, learnt from their neighbours: a Gaussian process a kind.

A handful of releases tells little of one barrier, but barriers of one kind at nearly the same place
and of nearly the same size do nearly the same (Rasmussen and Williams 2006, Gaussian Processes for
Machine Learning, section 2.2). What a barrier costs is known; what is learnt is the rest of Z.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Mesh
from rigdda.agents.menu import numbers

Floats = NDArray[np.float64]

NEAR, SHARE = 2.0, 0.06
"""Distance of stations over which what they are worth is alike [m], and the same as a share of the
zone: the greater counts. Benches are a few metres long."""
SIZES = 0.35
"""The same of sizes, as a share of the range of each."""
SPREAD = 0.3
"""Standard deviation of what is left of Z about what is expected, over Z of nothing [-]."""


class Surface:
    """What is left of Z behind each of some barriers of one kind.

    Parameters
    ----------
    barriers : sequence of n barriers
        All of one kind.
    expected : (n,) array
        What they are expected to leave of Z, their own cost not included [EUR per m and year].
    nothing : float
        Z of nothing [EUR per m and year].
    length : float
        Length of the zone [m].
    """

    def __init__(
        self, barriers: Sequence[Barrier], expected: Floats, nothing: float, length: float
    ):
        table = np.array([numbers(b) for b in barriers])
        scale = SIZES * np.maximum(np.ptp(table, axis=0), 1e-9)
        mesh = isinstance(barriers[0], Mesh)  # options have nothing to do with each other
        scale[0] = 1e-6 if mesh else max(NEAR, SHARE * length)
        self._table = table / scale
        self._prior, self._variance = expected, (SPREAD * nothing) ** 2
        self._index = {barrier: i for i, barrier in enumerate(barriers)}
        self.mean, self.deviation = expected, np.full(len(barriers), SPREAD * nothing)

    def knows(self, barrier: Barrier) -> bool:
        """Tell whether a barrier is one of them."""
        return barrier in self._index

    def learn(self, seen: Sequence[tuple[Barrier, float, float]]) -> None:
        """Learn from barriers, what each left of Z, and the variance of that; all over again."""
        rows = np.array([self._index[barrier] for barrier, _, _ in seen], dtype=np.int64)
        if not len(rows):
            return
        left, noise = np.array([(value, error) for _, value, error in seen]).T
        among = self._alike(rows)[:, rows] + np.diag(noise + 1e-9 * self._variance)
        weight = np.linalg.solve(among, self._alike(rows))
        self.mean = self._prior + weight.T @ (left - self._prior[rows])
        explained = np.einsum("ij,ij->j", weight, self._alike(rows))
        self.deviation = np.sqrt(np.maximum(self._variance - explained, 0.0))

    def _alike(self, rows: NDArray[np.int64]) -> Floats:
        """Return the covariance of some barriers with all, (m, n)."""
        apart = self._table[rows][:, None] - self._table
        alike: Floats = self._variance * np.exp(-0.5 * np.square(apart).sum(axis=2))
        return alike
