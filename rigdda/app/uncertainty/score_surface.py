"""Gaussian process through noisy scores on the unit cube, and the places where it is least.

Sources: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), sections 2.2 and
5.4; Matern covariance with smoothness 5/2, eq. 4.17.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.spatial.distance import cdist
from scipy.stats import qmc

Floats = NDArray[np.float64]

NEAREST = 0.6
"""Share of the tried places with the best scores to which the process is fitted; the others are far
from the least score, where the surface has another scale [-]."""

FEWEST = 12
"""Least number of places to which the process is fitted, if there are as many."""

CANDIDATES = 4096
"""Number of places among which the least score is sought, in each of two stages."""

TOGETHER = 250
"""Number of samples of the scores that are treated together, to save memory."""

MARGIN = 0.25
"""Margin of the box of the second stage about the places found in the first [-], relative to it."""


def best_places(places: Floats, scores: Floats, rng: np.random.Generator) -> Floats:
    """Return the place of the least score of each of several samples of scores, (S, P).

    A Gaussian process is fitted to the mean of the samples, which gives the scale on which the
    scores change and their noise. Each sample is then smoothed by this process, with additional
    noise of the same size.

    Parameters
    ----------
    places : (T, P) array
        Places in the unit cube at which scores were computed.
    scores : (T, S) array
        The scores of S samples at these places.
    rng : Generator
        Random generator of the noise.
    """
    middle = scores.mean(axis=1)
    count = min(len(places), max(FEWEST, round(NEAREST * len(places))))
    near = np.argsort(middle, kind="stable")[:count]
    places, scores, middle = places[near], scores[near], middle[near]
    lengths, amplitude, noisy = _scales(places, middle)
    noise = noisy * rng.standard_normal(scores.shape)
    share = (noisy / amplitude) ** 2
    first = np.vstack([_points(places.shape[1], np.zeros_like(lengths), np.ones_like(lengths)),
                       places])  # fmt: skip
    found = _least(places, scores + noise, lengths, share, first)
    low, high = found.min(axis=0), found.max(axis=0)
    room = MARGIN * (high - low) + 1e-3
    box = np.clip(low - room, 0.0, 1.0), np.clip(high + room, 0.0, 1.0)
    second = np.vstack([_points(places.shape[1], *box), first])
    return _least(places, scores + noise, lengths, share, second)


def _points(dimensions: int, low: Floats, high: Floats) -> Floats:
    """Return evenly distributed points in a box, (`CANDIDATES`, P)."""
    cube = qmc.Sobol(dimensions, rng=np.random.default_rng(0)).random(CANDIDATES)
    return np.asarray(low + (high - low) * cube, dtype=np.float64)


def _covariance(a: Floats, b: Floats, lengths: Floats) -> Floats:
    """Return the correlation of a process at two sets of places, (A, B)."""
    r = math.sqrt(5.0) * cdist(a / lengths, b / lengths)
    return np.asarray((1.0 + r + r * r / 3.0) * np.exp(-r), dtype=np.float64)


SHORTEST, LONGEST = 0.05, 10.0
"""Least and greatest length on which scores change, relative to the range of a parameter [-]."""

QUIETEST, LOUDEST = 1e-4, 1.0
"""Least and greatest variance of the noise, relative to that of the scores [-]."""


def _scales(places: Floats, scores: Floats) -> tuple[Floats, float, float]:
    """Return the scales of a process by maximum likelihood.

    They are the lengths (P,), and the standard deviations of the process and of the noise.
    """
    spread = float(scores.std()) or 1.0
    values = (scores - scores.mean()) / spread
    dimensions = places.shape[1]

    def cost(logs: Floats) -> float:
        """Return the negative logarithm of the marginal likelihood, up to a constant."""
        matrix = np.exp(logs[-2]) * _covariance(places, places, np.exp(logs[:dimensions]))
        matrix[np.diag_indices(len(places))] += np.exp(logs[-1])
        factor = cho_factor(matrix, lower=True)
        fitted = float(values @ cho_solve(factor, values))
        return 0.5 * fitted + float(np.log(np.diag(factor[0])).sum())

    bounds = [(math.log(SHORTEST), math.log(LONGEST))] * dimensions
    bounds += [(math.log(0.1), math.log(100.0)), (math.log(QUIETEST), math.log(LOUDEST))]
    starts = [
        np.array([math.log(length)] * dimensions + [0.0, math.log(0.1)]) for length in (0.3, 1.0)
    ]
    found = min(
        (minimize(cost, start, method="L-BFGS-B", bounds=bounds) for start in starts),
        key=lambda one: float(one.fun),
    )
    amplitude, noisy = (spread * float(np.exp(0.5 * log)) for log in found.x[-2:])
    return np.exp(found.x[:dimensions]), amplitude, noisy


def _least(places: Floats, scores: Floats, lengths: Floats, share: float, points: Floats) -> Floats:
    """Return the point at which the smoothed scores of each sample are least, (S, P)."""
    matrix = _covariance(places, places, lengths)
    matrix[np.diag_indices(len(places))] += share
    weights = cho_solve(cho_factor(matrix, lower=True), scores - scores.mean(axis=0))
    cross = _covariance(points, places, lengths)
    best = [
        np.argmin(cross @ weights[:, i : i + TOGETHER], axis=0)
        for i in range(0, scores.shape[1], TOGETHER)
    ]
    return points[np.concatenate(best)]
