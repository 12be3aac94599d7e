"""What one layout costs more than another, from releases that both meet.

Most releases cost the same with both. What the first one costs more, and what it costs less, are
two means of costs that few releases have, with the intervals of such, see `rigdda.envs.intervals`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Outcome, Site
from rigdda.envs import ensemble
from rigdda.envs.cost import Account, Facts, account
from rigdda.envs.intervals import Known, Mean, cost
from rigdda.envs.problem import DesignProblem

LEAST = 2
"""Releases of an event that tell how much they differ."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Z of one layout less that of another [EUR per metre of road and year].

    Parameters
    ----------
    value : float
        Below 0 the first one costs less.
    ci : (low, high)
        95 % interval. Releases are paired: the same rock comes down with both, so that it is
        shorter than that of two Z taken apart, the more so the more alike the layouts are.
    releases, differ : int
        How many both met, and in how many of these they did not cost the same.
    """

    value: float
    ci: tuple[float, float]
    releases: int
    differ: int


def compare(
    problem: DesignProblem,
    one: Sequence[Barrier] | ArrayLike,
    two: Sequence[Barrier] | ArrayLike,
    seeds: Sequence[int],
    executor: Executor | None = None,
) -> Difference:
    """Return what one layout costs more than another in the same releases.

    Layouts, seeds and executor as of `DesignProblem.evaluate`; at least two seeds for each event.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    a, b = (problem.evaluate(layout, seeds, executor) for layout in (one, two))
    facts = ensemble.of(problem.site, problem.key).facts
    return difference(problem.site, (a.layout, b.layout), (a.outcomes, b.outcomes), facts)


def difference(
    site: Site,
    layouts: tuple[Layout, Layout],
    outcomes: tuple[Sequence[Outcome], Sequence[Outcome]],
    facts: Mapping[str, Facts],
) -> Difference:
    """Return what the first layout costs more than the second.

    Parameters
    ----------
    outcomes : two sequences of Outcome
        Of each layout, of the same releases in the same order.
    facts : mapping of str to Facts
        What is known of each event: what a release may differ by, where none was seen to.

    Raises
    ------
    BadInput
        If an event that happens has fewer than `LEAST` releases.
    """
    one, two = (account(site, a, b) for a, b in zip(layouts, outcomes, strict=True))
    value = site.annual(layouts[0]) - site.annual(layouts[1])
    below, above, differ = 0.0, 0.0, 0
    for name in site.event_names:
        rates = [site.rate(name, layout) for layout in layouts]
        if not any(rates):
            continue
        own = one.event == name
        if own.sum() < LEAST:
            mend = f"give {LEAST} or more of every event: {LEAST * len(site.events)} seeds in all"
            raise BadInput("seeds", f"{own.sum()} of {name}", mend)
        more = rates[0] * _spent(one)[own] - rates[1] * _spent(two)[own]
        differ += int(np.count_nonzero(more))
        value += float(more.mean())
        if layouts[0] == layouts[1]:
            continue
        dear = facts[name].harm
        known = Known(max(rates) * dear.mean, dear.variation)
        up, down = (cost(np.maximum(part, 0.0), part > 0.0, known) for part in (more, -more))
        below += _below(up) ** 2 + _above(down) ** 2
        above += _above(up) ** 2 + _below(down) ** 2
    ends = value - math.sqrt(below), value + math.sqrt(above)
    return Difference(value, ends, len(one.event), differ)


def _below(mean: Mean) -> float:
    return mean.value - mean.low


def _above(mean: Mean) -> float:
    return mean.high - mean.value


def _spent(found: Account) -> NDArray[np.float64]:
    """Return harm and repair of each release [EUR]."""
    return found.harm + found.repair
