"""Sets of values of a fit: where they are tried, and what comes of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import cma
import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from rigdda.agents.parameters import Parameter
from rigdda.agents.prediction import scores

Floats = NDArray[np.float64]
Compute = Callable[[Floats, range], Mapping[str, Floats]]


class Candidate(NamedTuple):
    """Values of the parameters, and the computed run-outs of each event [m]."""

    values: Floats
    run_outs: Mapping[str, Floats]


class Trials:
    """Sets of values that were tried, with the scores that they give each observed run.

    Parameters
    ----------
    observed, parameters, compute
        See `search`.

    Attributes
    ----------
    tried : list of Candidate
        In the order in which they were computed.
    table : list of (runs,) array
        Scores of each [m].
    """

    def __init__(
        self, observed: Mapping[str, Floats], parameters: Sequence[Parameter], compute: Compute
    ):
        self._observed, self._compute = observed, compute
        self._low = np.array([p.low for p in parameters])
        self._range = np.array([p.high for p in parameters]) - self._low
        self.tried: list[Candidate] = []
        self.table: list[Floats] = []

    def values(self, place: Floats) -> Floats:
        """Return the values at a place of the unit cube, (P,)."""
        return self._low + self._range * np.clip(place, 0.0, 1.0)

    def compute(self, values: Floats, seeds: range) -> tuple[Candidate, Floats]:
        """Return what values give, and the scores of the observed runs."""
        found = self._compute(values, seeds)
        each = [scores(found[event], self._observed[event]) for event in self._observed]
        return Candidate(values, found), np.concatenate(each)

    def add(self, place: Floats, seeds: range) -> float:
        """Try a place of the unit cube; return its mean score [m]."""
        candidate, each = self.compute(self.values(place), seeds)
        self.tried.append(candidate)
        self.table.append(each)
        return float(each.mean())

    def best(self, count: int) -> list[Candidate]:
        """Return the candidates of the least mean scores, the best first."""
        order = np.argsort([each.mean() for each in self.table])[:count]
        return [self.tried[i] for i in order]


def explore(score: Callable[[Floats], float], dimensions: int, budget: int, seed: int) -> None:
    """Score places of the unit cube, (dimensions,): spread over it, then about the best of them.

    `score` takes a place and returns what is to be least; places come by Sobol, then by CMA-ES.
    """
    spread = 1 << max(2, round(math.log2(budget / 2)))
    places = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(spread)
    best = places[int(np.argmin([score(place) for place in places]))]
    own = seed % (2**32 - 1) + 1  # of 0 cma would take the time
    options = {"bounds": [0, 1], "seed": own, "verbose": -9, "maxfevals": budget - spread}
    evolution = cma.CMAEvolutionStrategy(best, 0.15, options)
    done = spread
    while budget - done >= evolution.popsize and not evolution.stop():
        asked = evolution.ask()
        evolution.tell(asked, [score(np.asarray(place)) for place in asked])
        done += len(asked)
