"""Which barriers of a catalogue to build: a mixed-integer linear programme, by HiGHS.

With z[j] = 1 for barrier j, and h_r the harm that release r still does,

    minimise    annual.z + weight.h
    subject to  h_r >= base_r - sum_j relief[r, j] z[j],  h_r >= 0
                sum z <= max_barriers, and none where another stands

The sum of reliefs is more than two barriers take off together, so a second programme has them
scaled down: its layouts are the more careful ones.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from rigdda import Layout
from rigdda.agents.catalogue import Catalogue, Floats
from rigdda.envs.siting import MIN_GAP


@dataclass(frozen=True, slots=True)
class Choice:
    """An optimum of the programme.

    Parameters
    ----------
    layout : tuple of Barrier
        What is built, downhill.
    objective : float
        Its Z as the programme sees it [EUR per m and year].
    bound : float
        That of the programme's linear relaxation: none is better.
    """

    layout: Layout
    objective: float
    bound: float


def choose(catalogue: Catalogue, slots: int, share: float = 1.0) -> Choice:
    """Return the best choice of at most `slots` barriers.

    Parameters
    ----------
    share : float
        Share of each relief that counts.
    """
    if not catalogue.barriers:
        nothing = float(catalogue.weight @ catalogue.base)
        return Choice((), nothing, nothing)
    bound, _ = _solve(catalogue, slots, share, boolean=False)
    value, z = _solve(catalogue, slots, share, boolean=True)
    built = [catalogue.barriers[j] for j in np.flatnonzero(z > 0.5).tolist()]
    return Choice(tuple(sorted(built, key=lambda b: b.x)), value, min(bound, value))


def _solve(catalogue: Catalogue, slots: int, share: float, boolean: bool) -> tuple[float, Floats]:
    """Return the least objective and its z (J,), whole numbers or between 0 and 1."""
    import cvxpy as cp

    useful = np.flatnonzero(catalogue.weight * catalogue.base > 0.0)
    scale = max(float(catalogue.weight @ catalogue.base), 1e-12)
    z = cp.Variable(len(catalogue.barriers), boolean=boolean)
    left = cp.Variable(len(useful), nonneg=True)  # of a release's share of the harm [-]
    weigh = (catalogue.weight * catalogue.base)[useful] / scale
    part = share * catalogue.relief[useful] / catalogue.base[useful, None]
    goal = (catalogue.annual / scale) @ z + weigh @ left
    rules = [left >= 1.0 - part @ z, cp.sum(z) <= slots, z >= 0, z <= 1]
    clashes = _clashes(catalogue)
    if len(clashes):
        rules.append(clashes @ z <= 1)
    problem = cp.Problem(cp.Minimize(goal), rules)
    with suppress(ValueError, cp.SolverError):
        problem.solve(solver=cp.HIGHS, mip_rel_gap=GAP)
    if z.value is None:  # nothing built is always a solution
        return scale, np.zeros(len(catalogue.barriers))
    return scale * float(problem.value), np.asarray(z.value, dtype=np.float64)


GAP = 0.01
"""Relative gap at which an optimum is good enough: the estimates are worse."""


def _clashes(catalogue: Catalogue) -> Floats:
    """Return which barriers stand at, or just beyond, the start of each other one, (n, J)."""
    start, end = catalogue.span.T
    starts = np.unique(start)
    over = (start <= starts[:, None]) & (starts[:, None] < end + MIN_GAP)
    kinds = np.array([b.kind == "mesh" for b in catalogue.barriers])
    over &= ~kinds
    rows = np.concatenate([over, kinds[None]])  # one mesh at most
    return np.unique(rows[rows.sum(axis=1) > 1], axis=0).astype(np.float64)
