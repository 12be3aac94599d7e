"""Allocation of further releases to the options of sections whose choice they are likely to change.

With the shadow price of each budget, the choice of a section is that of the option with the least
total cost plus price x construction cost. The expected opportunity cost of this choice follows from
the differences between options and their standard errors (Chick and Inoue 2001, Operations Research
49, 732-743). Each batch of releases goes to the option for which it reduces this cost most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Floats = NDArray[np.float64]

BATCH_RELEASES = 25
"""Number of releases of a batch."""

LEAST_ERROR = 1e-12
"""Least standard error of a difference [EUR/m and year], to avoid a division by zero."""


@dataclass(slots=True)
class Estimates:
    """Estimates of the options of a section.

    Parameters
    ----------
    length : float
        Length of the section [m].
    cost : (K,) array
        Construction cost of each option [EUR/m]. The first option is to build nothing; its value is
        known well, and it gets no further releases.
    value : (K,) array
        Estimated total cost [EUR/m and year].
    variance : (K,) array
        Variance of the cost of one release.
    releases : (K,) array
        Number of releases so far.
    """

    length: float
    cost: Floats
    value: Floats
    variance: Floats
    releases: Floats

    def worth(self, prices: Sequence[float]) -> Floats:
        """Return the reduction of the opportunity cost by one more batch for each option, (K,).

        It is the sum over the prices of capital [1/year], in EUR/year.
        """
        now = self.variance / self.releases
        after = self.variance / (self.releases + BATCH_RELEASES)
        total = np.zeros(len(self.value))
        for price in prices:
            goal = self.value + price * self.cost
            best = int(np.argmin(goal))
            behind = goal - goal[best]
            loss = opportunity(behind, now + now[best])
            saved = loss - opportunity(behind, after + now[best])
            others = loss - opportunity(behind, now + after[best])
            saved[best] = others.sum() - others[best]
            total += saved
        total[0] = 0.0
        return self.length * total


def opportunity(behind: Floats, variance: Floats) -> Floats:
    """Return the expected loss because an option may be better than the best one after all.

    Parameters
    ----------
    behind : (K,) array
        Estimated difference from the best option.
    variance : (K,) array
        Variance of the difference.
    """
    error = np.maximum(np.sqrt(variance), LEAST_ERROR)
    z = behind / error
    density = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
    return error * (density - z * ndtr(-z))


def batches(
    sections: Sequence[Estimates], prices: Sequence[float], releases: int
) -> dict[tuple[int, int], int]:
    """Return the number of batches of the options by section and option; the others get none.

    The numbers of releases in `sections` are increased accordingly.

    Parameters
    ----------
    sections : sequence of Estimates
        The sections.
    prices : sequence of float
        Shadow prices of the budgets [1/year].
    releases : int
        Number of releases to allocate.
    """
    worth = [section.worth(prices) for section in sections]
    most = np.array([own.max() for own in worth])
    out: dict[tuple[int, int], int] = {}
    for _ in range(releases // BATCH_RELEASES):
        s = int(np.argmax(most))
        if most[s] <= 0.0:
            break
        k = int(np.argmax(worth[s]))
        out[s, k] = out.get((s, k), 0) + 1
        sections[s].releases[k] += BATCH_RELEASES
        worth[s] = sections[s].worth(prices)
        most[s] = worth[s].max()
    return out
