"""Barrier design as an optimisation problem: vectors, layouts, and what a layout is worth."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from envs import baseline, encoding
from envs.evaluation import Evaluation, student_interval
from rigdda import BadInput, Barrier, Layout, Outcome, Site, check
from rigdda.barriers import KINDS as ALL_KINDS
from rigdda.barriers import Earthwork

Floats = NDArray[np.float64]

KINDS = ("fence",)
"""Kinds of barrier that are designed if none are named: fences, whose capacity is a decision. What
nothing can break, a wall, makes sizes trivial."""

OVERRUN = 10.0
"""How many times the cost above the limit is charged. Soft, so that a search sees a way back."""

MOST_BARRIERS = 100
"""Most slots of a layout; a site has room for a few."""

LEAST, MOST = 1e-12, 1e12
"""Bounds of prices, weights and the limit: between them no objective, nor its square, overflows."""


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
        Kinds of barrier to choose from: "wall", "gravity_wall", "fence", "ditch", "embankment".
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
        where, names = _site(site), _kinds(kinds)
        _room(where, names)
        limit = where.costs.limit if cost_limit is None else cost_limit
        values = {
            "site": where,
            "max_barriers": check.integer("max_barriers", max_barriers, 1, MOST_BARRIERS),
            "kinds": names,
            "risk_weight": check.number("risk_weight", risk_weight, 0.0, MOST),
            "cost_weight": check.number("cost_weight", cost_weight, 0.0, MOST),
            "cost_limit": check.number("cost_limit", limit, LEAST, MOST, open_low=True),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def size(self) -> int:
        """Numbers in a vector: 3 max_barriers, and a score for each kind if there are several."""
        return encoding.slot_size(self.kinds) * self.max_barriers

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest vector, -1 and 1, each (size,)."""
        return np.full(self.size, -1.0), np.full(self.size, 1.0)

    def decode(self, vector: ArrayLike) -> Layout:
        """Return the layout that a (size,) vector stands for, see `encoding.decode`.

        Every vector has one: entries beyond [-1, 1] are clipped; ditches and embankments that do
        not fit the slope, or reach beyond the zone, are absent.

        Raises
        ------
        BadInput
            If the shape is wrong or an entry is not a number.
        """
        values = encoding.vector("vector", vector, self.size)
        return self._fitting(encoding.decode(self.site.barrier_zone, values, self.kinds))

    def _fitting(self, layout: Layout) -> Layout:
        """Return the barriers of a layout that fit the slope, sorted downhill."""
        ground, kept = self.site.profile, []
        for barrier in layout:
            if isinstance(barrier, Earthwork):
                try:
                    moved, changed = barrier.build(ground, self.site.slope.surface)
                except BadInput:
                    continue
                if moved[:, 0].max() > self.site.barrier_zone.end + encoding.TOLERANCE:
                    continue
                ground = changed
            kept.append(barrier)
        return tuple(kept)

    def encode(self, layout: Sequence[Barrier]) -> Floats:
        """Return a (size,) vector that `decode` turns into `layout`.

        Raises
        ------
        BadInput
            If the layout is not one that `decode` can give.
        """
        return encoding.encode(self.site.barrier_zone, layout, self.max_barriers, self.kinds)

    def penalised(self, cost: float) -> float:
        """Return the cost that is charged: as it is up to the limit, tenfold above it."""
        return cost + (OVERRUN - 1.0) * max(cost - self.cost_limit, 0.0)

    def objective(self, debris: float, cost: float) -> float:
        """Return the objective of a debris fraction [-] and a cost."""
        charged = self.penalised(cost) / self.cost_limit
        return self.risk_weight * debris + self.cost_weight * charged

    def evaluate(
        self, layout: Sequence[Barrier], seeds: Sequence[int], executor: Executor | None = None
    ) -> Evaluation:
        """Simulate a layout in one release for each seed.

        Parameters
        ----------
        layout : sequence of Barrier
            Of any kind, inside the zone and its limits; too dear a layout is simulated too.
        seeds : sequence of int
            At least one whole number of at least 0.
        executor : Executor, optional
            Where to simulate, for example a process pool; None: in threads over all cores. The
            numbers are the same.

        Raises
        ------
        BadInput
            If the layout is not inside the zone or does not fit, or the seeds are unsound.
        Diverged
            If a simulation diverges.
        """
        standing = encoding.check_layout(self.site.barrier_zone, layout)
        drawn = _seeds(seeds)
        found = baseline.outcomes([(self.site, standing, seed) for seed in drawn], executor)
        return self.judge(standing, drawn, tuple(found))

    def judge(
        self, layout: Layout, seeds: tuple[int, ...], outcomes: tuple[Outcome, ...]
    ) -> Evaluation:
        """Return what a layout is worth that had these outcomes, one for each seed."""
        cost = self.site.cost(layout)
        debris = np.array([outcome.debris_fraction for outcome in outcomes])
        low, high = student_interval(debris)
        return Evaluation(
            layout=layout,
            seeds=seeds,
            objective=self.objective(float(debris.mean()), cost),
            debris=float(debris.mean()),
            ci=student_interval([self.objective(d, cost) for d in debris.tolist()]),
            debris_ci=(max(low, 0.0), min(high, 1.0)),
            cost=cost,
            outcomes=outcomes,
        )


def _site(site: object) -> Site:
    if isinstance(site, str | os.PathLike):
        site = Site.load(site)
    if not isinstance(site, Site):
        raise BadInput("site", site, "give a name, a TOML file or a rigdda.Site")
    if not {"concrete", "rock"} & site.surfaces.keys():
        mend = "define concrete, of which barriers are, or rock instead"
        raise BadInput("surfaces", sorted(site.surfaces), mend)
    for name, price in msgspec.structs.asdict(site.costs).items():
        check.number(f"costs.{name}", price, 0.0, MOST)
    return site


def _room(site: Site, kinds: tuple[str, ...]) -> None:
    """Check that every barrier has room in the zone."""
    zone = site.barrier_zone
    longest = encoding.longest(zone, kinds)
    if zone.end - zone.start < longest:
        what = "max_thickness" if longest == zone.max_thickness else "the length of a barrier"
        mend = f"put it at least {what} {longest:g} beyond the zone's start"
        raise BadInput("barrier_zone.end", zone.end, mend)


def _seeds(seeds: Sequence[int]) -> tuple[int, ...]:
    try:
        drawn = tuple(check.integer(f"seeds[{i}]", seed, 0) for i, seed in enumerate(seeds))
    except TypeError:
        raise BadInput("seeds", seeds, "give a sequence of whole numbers") from None
    if not drawn:
        raise BadInput("seeds", drawn, "give at least one")
    return drawn


def _kinds(kinds: Sequence[str]) -> tuple[str, ...]:
    if not isinstance(kinds, Sequence) or isinstance(kinds, str):
        raise BadInput("kinds", kinds, "give a sequence of names")
    names = tuple(check.one_of("kinds", kind, ALL_KINDS) for kind in kinds)
    if not names or len(set(names)) < len(names):
        raise BadInput("kinds", kinds, "name each kind once")
    return names
