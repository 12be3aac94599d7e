"""Layouts worth trying first: what one barrier-free ensemble suggests to every search.

The optima of `convex`, the engineering rule, its barrier lower and weaker (the rule does not know
what it costs), and no barrier at all.
"""

from __future__ import annotations

import msgspec

from agents import convex
from agents.crossings import Ensemble
from agents.rule import rule
from envs import DesignProblem
from envs.encoding import MIN_HEIGHT
from rigdda import Fence, Layout, Wall
from rigdda.site import BarrierZone

CHEAPER = ((0.75, 1.0), (0.5, 1.0), (1.0, 0.4), (0.75, 0.4))
"""Shares of the rule's height and capacity that are tried."""


def starts(problem: DesignProblem, ensemble: Ensemble) -> list[Layout]:
    """Return the different layouts that an ensemble suggests, the most promising first."""
    found = [choice.layout for choice in convex.optima(problem, ensemble)]
    for kind in ("fence", "wall"):
        if kind in problem.kinds:
            one = rule(problem.site, ensemble, kind)
            found += [
                one,
                *(_cheaper(problem.site.barrier_zone, one, *shares) for shares in CHEAPER),
            ]
    return list(dict.fromkeys([*found, ()]))


def _cheaper(
    zone: BarrierZone, layout: tuple[Wall | Fence, ...], height: float, capacity: float
) -> Layout:
    """Return a layout at a share of its heights and capacities, none below the least."""
    out: list[Wall | Fence] = []
    for b in layout:
        lower = msgspec.structs.replace(b, height=max(MIN_HEIGHT, height * b.height))
        if isinstance(lower, Fence):
            weaker = max(zone.min_capacity, capacity * lower.capacity)
            lower = msgspec.structs.replace(lower, capacity=weaker)
        out.append(lower)
    return tuple(out)
