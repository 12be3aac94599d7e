"""Which barriers of a catalogue to build: a mixed-integer linear programme, by HiGHS.

With z[k, j] = 1 for barrier j at station k, and p_r the share of release r that still reaches the
road,

    minimise    cost.z
    subject to  p_r >= base_r - sum_kj relief[r, k, j] z[k, j],  p_r >= 0
                CVaR_0.9(p) <= c CVaR_0.9(base),  cost.z <= limit,  sum z <= max_barriers
                barriers at least MIN_GAP apart

with CVaR as in Rockafellar and Uryasev (2000, J. Risk 2, 21-41), a linear programme but for z.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.catalogue import Catalogue, Floats
from envs.encoding import MIN_GAP
from rigdda import Layout

TAIL = 0.9


@dataclass(frozen=True, slots=True)
class Choice:
    """An optimum of the programme.

    Parameters
    ----------
    layout : tuple of Barrier
        What is built.
    cost : float
        Its price, as a share of the limit.
    bound : float
        The price of the programme's linear relaxation: none that keeps the limit is cheaper.
    """

    layout: Layout
    cost: float
    bound: float


def choose(catalogue: Catalogue, slots: int, limit: float) -> Choice | None:
    """Return the cheapest choice of at most `slots` barriers, None if none keeps the limit.

    Parameters
    ----------
    limit : float
        Largest CVaR, as a share of that without barriers.
    """
    bound = _solve(catalogue, slots, limit, boolean=False)
    found = None if bound is None else _solve(catalogue, slots, limit, boolean=True)
    if bound is None or found is None:
        return None
    built = np.argwhere(found > 0.5)
    layout = tuple(catalogue.barriers[k][j] for k, j in built)
    cost = float((catalogue.cost * (found > 0.5)).sum())
    return Choice(layout, cost, float((catalogue.cost * bound).sum()))


def _solve(catalogue: Catalogue, slots: int, limit: float, boolean: bool) -> Floats | None:
    """Return z (K, J), whole numbers or between 0 and 1, or None if nothing keeps the limit."""
    import cvxpy as cp

    releases = len(catalogue.base)
    stations, options = np.nonzero(_worth_it(catalogue))
    if not len(stations):  # nothing helps
        kept = limit >= 1.0 or not catalogue.base.any()
        return np.zeros_like(catalogue.cost) if kept else None
    relief, cost = catalogue.relief[:, stations, options], catalogue.cost[stations, options]
    z = cp.Variable(len(stations), boolean=boolean)
    passing = cp.Variable(releases, nonneg=True)
    at = (np.arange(len(catalogue.cost))[:, None] == stations).astype(np.float64)
    rules = [
        passing >= catalogue.base - relief @ z,
        cp.cvar(passing, TAIL) <= limit * cp.cvar(catalogue.base, TAIL).value,
        cost @ z <= 1.0,
        cp.sum(z) <= slots,
        (_near(catalogue) @ at) @ z <= 1,
        z >= 0,
        z <= 1,
    ]
    with suppress(ValueError):  # HiGHS ends some infeasible programmes as "unknown"
        cp.Problem(cp.Minimize(cost @ z), rules).solve(solver=cp.HIGHS)
    if z.value is None:
        return None
    out = np.zeros_like(catalogue.cost)
    out[stations, options] = z.value
    return out


def _worth_it(catalogue: Catalogue) -> NDArray[np.bool_]:
    """Return which barriers do something that no cheaper one at their station does, (K, J)."""
    kept = np.zeros(catalogue.cost.shape, dtype=bool)
    for k, cost in enumerate(catalogue.cost):
        relief = catalogue.relief[:, k, :].T
        chosen: list[int] = []
        for j in np.argsort(cost, kind="stable"):
            if relief[j].any() and not any((relief[i] >= relief[j]).all() for i in chosen):
                chosen.append(int(j))
        kept[k, chosen] = True
    return kept


def _near(catalogue: Catalogue) -> Floats:
    """Return for each station which ones are too close downhill of it, itself included, (K, K)."""
    x = np.array([row[0].x for row in catalogue.barriers])
    reach = np.array([max(b.extent for b in row) for row in catalogue.barriers]) + MIN_GAP
    ahead = x[None, :] - x[:, None]
    return ((ahead >= 0.0) & (ahead < reach[:, None])).astype(np.float64)
