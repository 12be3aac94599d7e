"""Comparison of two layouts by the difference of their objective Z on common releases.

Most releases cost the same with both layouts. The extra cost of the first layout and its savings
are therefore treated as two separate means of rarely incurred costs, each with its own interval
(see `rigdda.envs.intervals`). A release cannot have both, so that the covariance of the two means
over n releases is -E[extra] E[saving] / n, and the variance of the mean difference is the sum of
the two variances plus 2 E[extra] E[saving] / n.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Mesh, Outcome, Site
from rigdda.envs import ensemble
from rigdda.envs.cost import Account, Facts, account
from rigdda.envs.intervals import Known, Mean, mean_cost, quantile
from rigdda.envs.problem import DesignProblem

LEAST_PER_EVENT = 2
"""Least number of releases of each event needed to estimate a difference."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference in Z between two layouts [EUR per metre of road and year].

    Parameters
    ----------
    value : float
        Z of the first layout minus Z of the second; negative if the first is cheaper.
    ci : (low, high)
        95 % interval. Because both layouts are tested with the same releases, it is narrower than
        the interval of two independent estimates of Z, particularly for similar layouts.
    releases, differ : int
        Number of common releases, and the number of them in which the costs differ.
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
) -> Difference:
    """Return the difference in Z between two layouts on the same releases.

    The layouts and seeds are those of `DesignProblem.evaluate`. At least two seeds per event are
    needed.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    a, b = (problem.evaluate(layout, seeds) for layout in (one, two))
    facts = ensemble.of(problem.site, problem.key).facts
    return difference(problem.site, (a.layout, b.layout), (a.outcomes, b.outcomes), facts)


def difference(
    site: Site,
    layouts: tuple[Layout, Layout],
    outcomes: tuple[Sequence[Outcome], Sequence[Outcome]],
    facts: Mapping[str, Facts],
) -> Difference:
    """Return the difference in Z between two layouts from their outcomes.

    Parameters
    ----------
    site : Site
        The site.
    layouts : (Layout, Layout)
        The two layouts.
    outcomes : two sequences of Outcome
        The outcomes of each layout for the same releases in the same order.
    facts : mapping of str to Facts
        Barrier-free statistics of each event. They bound the difference for events in which no
        release showed one.

    Raises
    ------
    BadInput
        If an event with a non-zero rate has fewer than `LEAST_PER_EVENT` releases.
    """
    one, two = (account(site, a, b) for a, b in zip(layouts, outcomes, strict=True))
    return difference_of_accounts(site, layouts, (one, two), facts)


def difference_of_accounts(
    site: Site,
    layouts: tuple[Layout, Layout],
    accounts: tuple[Account, Account],
    facts: Mapping[str, Facts],
) -> Difference:
    """Return the difference in Z between two layouts from the costs of their releases.

    The arguments are those of `difference`, with an account instead of outcomes for each layout.

    Raises
    ------
    BadInput
        If an event with a non-zero rate has fewer than `LEAST_PER_EVENT` releases.
    """
    one, two = accounts
    value = site.annual(layouts[0]) - site.annual(layouts[1])
    same = same_structures(site, *layouts)
    below, above, differ = 0.0, 0.0, 0
    for name in site.event_names:
        rates = [site.rate(name, layout) for layout in layouts]
        if not any(rates):
            continue
        own = one.event == name
        if own.sum() < LEAST_PER_EVENT:
            least = LEAST_PER_EVENT * len(site.events)
            hint = f"give {LEAST_PER_EVENT} or more per event: at least {least} seeds"
            raise BadInput("seeds", f"{own.sum()} of {name}", hint)
        more = rates[0] * _spent(one)[own] - rates[1] * _spent(two)[own]
        differ += int(np.count_nonzero(more))
        value += float(more.mean())
        if same:
            continue
        harm = facts[name].harm
        known = Known(max(rates) * harm.mean, harm.variation)
        up, down = (mean_cost(np.maximum(part, 0.0), part > 0.0, known) for part in (more, -more))
        both = 2.0 * up.value * down.value * quantile(len(more) - 1) ** 2 / len(more)
        below += _below(up) ** 2 + _above(down) ** 2 + both
        above += _above(up) ** 2 + _below(down) ** 2 + both
    ends = value - math.sqrt(below), value + math.sqrt(above)
    return Difference(value, ends, len(one.event), differ)


def same_structures(site: Site, one: Layout, two: Layout) -> bool:
    """Return whether two layouts leave the same barriers and meshes on a site.

    An existing barrier may be removed by a removal or by the barrier that replaces it.
    """
    meshes = [sorted(b.option for b in layout if isinstance(b, Mesh)) for layout in (one, two)]
    return meshes[0] == meshes[1] and set(site.standing(one)) == set(site.standing(two))


def _below(mean: Mean) -> float:
    return mean.value - mean.low


def _above(mean: Mean) -> float:
    return mean.high - mean.value


def _spent(found: Account) -> NDArray[np.float64]:
    """Return the harm plus repair cost of each release [EUR]."""
    return found.harm + found.repair
