"""Layouts worth trying first: what one barrier-free ensemble suggests to every search.

The optima of `convex`, the engineering rule, its barrier at lower heights (the rule does not know
what height costs), and no barrier at all.
"""

from __future__ import annotations

import msgspec

from agents import convex
from agents.crossings import Ensemble
from agents.rule import rule
from envs import DesignProblem
from envs.encoding import MIN_HEIGHT
from rigdda import Fence, Layout, Wall

LOWER = (0.75, 0.5)
"""Shares of the rule's height that are tried."""


def starts(problem: DesignProblem, ensemble: Ensemble) -> list[Layout]:
    """Return the different layouts that an ensemble suggests, the most promising first."""
    found = [choice.layout for choice in convex.optima(problem, ensemble)]
    for kind in ("fence", "wall"):
        if kind in problem.kinds:
            one = rule(problem.site, ensemble, kind)
            found += [one, *(_lower(one, share) for share in LOWER)]
    return list(dict.fromkeys([*found, ()]))


def _lower(layout: tuple[Wall | Fence, ...], share: float) -> Layout:
    """Return a layout at a share of its heights, none below the least."""
    return tuple(
        msgspec.structs.replace(b, height=max(MIN_HEIGHT, share * b.height)) for b in layout
    )
