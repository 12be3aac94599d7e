"""How computed run-outs meet observed ones: their score, means and quantiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

QUANTILES = (0.05, 0.5, 0.95)


class Quality(NamedTuple):
    """How a prediction meets what was observed; run-outs in m."""

    score: float
    mean: float
    quantiles: tuple[float, ...]
    means: Mapping[str, float]
    stopped: float
    """Share that stops uphill of the toe of the slope [-]."""


def scores(computed: Floats, observed: Floats) -> Floats:
    """Return the continuous ranked probability score of each observed run [m]."""
    x = np.sort(computed)
    n = len(x)
    spread = (2.0 * np.arange(1, n + 1) - n - 1) @ x / n**2  # half of the mean distance
    return np.abs(x[None, :] - observed[:, None]).mean(axis=1) - spread


def quality(
    observed: Mapping[str, Floats], predicted: Sequence[Floats], score: float, toe: float
) -> Quality:
    """Return the figures of a prediction: the computed run-outs for each observed run."""
    events = [event for event in observed for _ in observed[event]]
    every = np.concatenate(predicted)
    weight = np.concatenate([np.full(len(p), 1.0 / len(p)) for p in predicted]) / len(predicted)
    order = np.argsort(every)
    share = np.cumsum(weight[order])
    quantiles = tuple(float(every[order][np.searchsorted(share, q)]) for q in QUANTILES)
    each = list(zip(predicted, events, strict=True))
    means = {name: float(np.mean([p.mean() for p, e in each if e == name])) for name in observed}
    stopped = float(weight[every < toe].sum())
    return Quality(score, float(weight @ every), quantiles, means, stopped)


def seen(observed: Mapping[str, Floats], toe: float) -> Quality:
    """Return the figures of what was observed."""
    every = np.concatenate(list(observed.values()))
    quantiles = tuple(float(q) for q in np.quantile(every, QUANTILES))
    means = {event: float(values.mean()) for event, values in observed.items()}
    return Quality(0.0, float(every.mean()), quantiles, means, float((every < toe).mean()))
