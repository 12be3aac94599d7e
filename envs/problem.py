"""Barrier design as an optimisation problem: vectors, layouts, and what a layout is worth."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rigdda
from envs import baseline, encoding
from envs.evaluation import Evaluation, student_interval
from rigdda import BadInput, Layout, Outcome, Site, Wall, check

Floats = NDArray[np.float64]

KINDS = ("wall",)
"""Kinds of barrier that can be designed."""

OVERRUN = 10.0
"""How many times the cost above the limit is charged. Soft, so that a search sees a way back."""


@dataclass(frozen=True, slots=True, init=False)
class DesignProblem:
    """Where to put which barriers on a site.

    objective = risk_weight * debris fraction + cost_weight * charged cost / cost_limit, to be
    made small. The cost is charged tenfold above the limit.

    Parameters
    ----------
    site : str, path or Site
        Name of a built-in site, a TOML file or the site itself.
    max_barriers : int
        Slots for barriers; each may be empty.
    kinds : sequence of str
        Kinds of barrier.
    risk_weight, cost_weight : float
        Weights in the objective [-].
    cost_limit : float, optional
        Budget in the units of the site's costs; None: the site's own.

    Raises
    ------
    BadInput
        If there is no such site, a number is outside its range or the zone is too short.
    """

    site: Site
    max_barriers: int
    kinds: tuple[str, ...]
    risk_weight: float
    cost_weight: float
    cost_limit: float

    def __init__(
        self,
        site: str | os.PathLike[str] | Site,
        max_barriers: int = 3,
        kinds: Sequence[str] = KINDS,
        risk_weight: float = 1.0,
        cost_weight: float = 0.2,
        cost_limit: float | None = None,
    ):
        where = _site(site)
        limit = where.costs.limit if cost_limit is None else cost_limit
        values = {
            "site": where,
            "max_barriers": check.integer("max_barriers", max_barriers, 1),
            "kinds": _kinds(kinds),
            "risk_weight": check.number("risk_weight", risk_weight, 0.0),
            "cost_weight": check.number("cost_weight", cost_weight, 0.0),
            "cost_limit": check.number("cost_limit", limit, 0.0, open_low=True),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def size(self) -> int:
        """Numbers in a vector, 3 max_barriers."""
        return encoding.NUMBERS * self.max_barriers

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest vector, -1 and 1, each (3 max_barriers,)."""
        return np.full(self.size, -1.0), np.full(self.size, 1.0)

    def decode(self, vector: ArrayLike) -> Layout:
        """Return the layout that a (3 max_barriers,) vector stands for, see `encoding.decode`.

        Every vector has one: entries beyond [-1, 1] are clipped.

        Raises
        ------
        BadInput
            If the shape is wrong or an entry is not a number.
        """
        values = encoding.vector("vector", vector, self.size)
        return encoding.decode(self.site.barrier_zone, values)

    def encode(self, layout: Sequence[Wall]) -> Floats:
        """Return a (3 max_barriers,) vector that `decode` turns into `layout`.

        Raises
        ------
        BadInput
            If the layout is not one that `decode` can give.
        """
        return encoding.encode(self.site.barrier_zone, layout, self.max_barriers)

    def penalised(self, cost: float) -> float:
        """Return the cost that is charged: as it is up to the limit, tenfold above it."""
        return cost + (OVERRUN - 1.0) * max(cost - self.cost_limit, 0.0)

    def objective(self, debris: float, cost: float) -> float:
        """Return the objective of a debris fraction [-] and a cost."""
        charged = self.penalised(cost) / self.cost_limit
        return self.risk_weight * debris + self.cost_weight * charged

    def evaluate(
        self, layout: Sequence[Wall], seeds: Sequence[int], executor: Executor | None = None
    ) -> Evaluation:
        """Simulate a layout in one release for each seed.

        Parameters
        ----------
        layout : sequence of Wall
            Barriers inside the zone and its limits; too dear a layout is simulated all the same.
        seeds : sequence of int
            At least one whole number of at least 0.
        executor : Executor, optional
            Where to simulate, for example a process pool; None: in threads over all cores. The
            numbers are the same.

        Raises
        ------
        BadInput
            If the layout is not inside the zone or the seeds are unsound.
        Diverged
            If a simulation diverges.
        """
        walls = encoding.check_layout(self.site.barrier_zone, layout)
        drawn = _seeds(seeds)
        outcomes = self._simulate(walls, drawn, executor)
        cost = self.site.cost(walls)
        debris = np.array([outcome.debris_fraction for outcome in outcomes])
        low, high = student_interval(debris)
        return Evaluation(
            layout=walls,
            seeds=drawn,
            objective=self.objective(float(debris.mean()), cost),
            debris=float(debris.mean()),
            ci=student_interval([self.objective(d, cost) for d in debris.tolist()]),
            debris_ci=(max(low, 0.0), min(high, 1.0)),
            cost=cost,
            outcomes=outcomes,
        )

    def _simulate(
        self, layout: Layout, seeds: tuple[int, ...], executor: Executor | None
    ) -> tuple[Outcome, ...]:
        """Return the outcome of every seed; without barriers, what was simulated is remembered."""
        known = {} if layout else baseline.recall(self.site, seeds)
        jobs = [(self.site, layout, seed) for seed in dict.fromkeys(seeds) if seed not in known]
        new = rigdda.release_many(jobs) if executor is None else executor.map(_outcome, jobs)
        fresh = {seed: outcome for (_, _, seed), outcome in zip(jobs, new, strict=True)}
        if not layout:
            baseline.remember(self.site, fresh)
        known |= fresh
        return tuple(known[seed] for seed in seeds)


def _outcome(job: tuple[Site, Layout, int]) -> Outcome:
    """Return the outcome of one release; at module level, for process pools to find it."""
    return rigdda.release(*job)[1]


def _site(site: object) -> Site:
    if isinstance(site, str | os.PathLike):
        site = Site.load(site)
    if not isinstance(site, Site):
        raise BadInput("site", site, "give a name, a TOML file or a rigdda.Site")
    zone = site.barrier_zone
    if zone.end - zone.start < zone.max_thickness:
        mend = f"put it at least max_thickness {zone.max_thickness:g} beyond the zone's start"
        raise BadInput("barrier_zone.end", zone.end, mend)
    if not {"concrete", "rock"} & site.surfaces.keys():
        mend = "define concrete, of which barriers are, or rock instead"
        raise BadInput("surfaces", sorted(site.surfaces), mend)
    return site


def _seeds(seeds: Sequence[int]) -> tuple[int, ...]:
    try:
        drawn = tuple(check.integer(f"seeds[{i}]", seed, 0) for i, seed in enumerate(seeds))
    except TypeError:
        raise BadInput("seeds", seeds, "give a sequence of whole numbers") from None
    if not drawn:
        raise BadInput("seeds", drawn, "give at least one")
    return drawn


def _kinds(kinds: Sequence[str]) -> tuple[str, ...]:
    names = tuple(check.one_of("kinds", kind, KINDS) for kind in kinds)
    if not names or len(set(names)) < len(names):
        raise BadInput("kinds", kinds, "name each kind once")
    return names
