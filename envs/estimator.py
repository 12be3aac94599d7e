"""From releases to the cost of a year and its parts, with intervals.

    Z = sum_b capital_b (annuity + upkeep_b) + sum_k rate_k E[harm_k + repair_k]

over barriers b and events k [EUR per metre of road and year]. Releases are stratified by event:
each event's mean counts with its rate, however many releases it has. Where there are too few
releases for that, each has drawn its event with a known chance; it then counts with rate / chance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout, Outcome, Site
from rigdda.barriers.fence import PANEL
from rigdda.envs.accounts import Account, account
from rigdda.envs.evaluation import Evaluation, Facts
from rigdda.envs.intervals import Estimate, Known, Mean, cost, estimate, pair, total
from rigdda.model.economy import capitals

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

REPAIR_VARIATION = 0.2
"""Coefficient of variation of what the repair of a failed barrier costs [-]: widths of events
differ little beyond the panel or element that is mended at least."""

FAIL = ("fence", "gravity_wall", "embankment")
"""Kinds of barrier that can fail."""


@dataclass(frozen=True, slots=True)
class Sums:
    """Sums over the releases of a layout, in EUR and m3 per metre of road and year."""

    harm: Mean
    repair: Mean
    both: Mean
    volume: Mean
    by_event: dict[str, float]


def judge(
    site: Site,
    layout: Layout,
    outcomes: Sequence[Outcome],
    facts: Mapping[str, Facts],
    shares: Mapping[str, float],
) -> Evaluation:
    """Return what a layout is worth that had these outcomes; nothing is asked of it.

    Parameters
    ----------
    site, layout : Site, tuple of Barrier
        The site and what stands on it.
    outcomes : sequence of Outcome
        At least two for each event on the average, each event at least once; fewer must have drawn
        their events by `shares`.
    facts : mapping of str to Facts
        What is known of each event; of those left out nothing is.
    shares : mapping of str to float
        Chance of each event.

    Raises
    ------
    BadInput
        If there are no releases, or none of an event that has a rate.
    """
    if not len(outcomes):
        raise BadInput("outcomes", outcomes, "give at least one")
    found, names = account(site, layout, outcomes), site.event_names
    if len(outcomes) >= 2 * len(names):
        sums = stratified(site, layout, found, facts)
    else:
        sums = _weighted(site, layout, found, facts, shares)
    annual = site.annual(layout)
    return Evaluation(
        layout=layout,
        seeds=(),
        objective=annual + sums.both.value,
        ci=(annual + sums.both.low, annual + sums.both.high),
        capital=annual,
        harm=sums.harm.value,
        harm_ci=sums.harm.interval,
        repair=sums.repair.value,
        repair_ci=sums.repair.interval,
        cost=site.capital(layout),
        debris=sums.volume.value,
        debris_ci=sums.volume.interval,
        debris_share=1.0 if sums.volume.value else 0.0,
        reach=_probabilities(names, found, found.reached),
        failure=_probabilities(names, found, found.failed),
        by_event=sums.by_event,
        targets=None,
        outcomes=tuple(outcomes),
        releases=len(outcomes),
    )


def stratified(site: Site, layout: Layout, found: Account, facts: Mapping[str, Facts]) -> Sums:
    """Return sums in which each event's mean counts with its rate.

    Raises
    ------
    BadInput
        If there are no releases of an event that has a rate.
    """
    parts: list[tuple[Mean, ...]] = []
    mend = _mending(site, layout)
    by_event: dict[str, float] = {}
    for name in site.event_names:
        rate, own = site.rate(name, layout), found.of(found.event == name)
        if rate == 0.0:
            by_event[name] = 0.0
            continue
        if not len(own.harm):
            raise BadInput("outcomes", f"none of {name}", "give releases of every event")
        known = facts.get(name)
        parts.append(tuple(part.times(rate) for part in _means(own, known, mend)))
        by_event[name] = parts[-1][2].value
    harm, repair, both, volume = (total(part[i] for part in parts) for i in range(4))
    return Sums(harm, repair, both, volume, by_event)


def _weighted(
    site: Site,
    layout: Layout,
    found: Account,
    facts: Mapping[str, Facts],
    shares: Mapping[str, float],
) -> Sums:
    """Return sums in which each release counts with the rate of its event over its chance.

    What events cost without barriers is known, so that releases tell only what barriers change (a
    control variate); else which events are drawn would decide most of a sum. It may be negative.
    """
    rate = {name: site.rate(name, layout) for name in site.event_names}
    weight = np.array([rate[name] / shares[name] for name in found.event.tolist()])
    drawn = Account(
        found.event,
        weight * found.harm,
        weight * found.repair,
        weight * found.volume,
        found.reached,
        found.failed,
    )
    mixed = _mixture(rate, facts, shares) if facts else None
    harm, repair, both, volume = _means(drawn, mixed, _mending(site, layout) * sum(rate.values()))
    often = {name: rate[name] * fact.reached / fact.releases for name, fact in facts.items()}
    seen = {n: float((found.event == n).mean()) / shares[n] for n in often}
    dear = {n: (1.0 - seen[n]) * often[n] * facts[n].harm.mean for n in often}
    much = math.fsum((1.0 - seen[n]) * often[n] * facts[n].volume.mean for n in often)
    spent = drawn.harm + drawn.repair
    by_event = {
        n: float(spent[found.event == n].sum() / len(spent)) + dear.get(n, 0.0)
        for n in site.event_names
    }
    more = math.fsum(dear.values())
    return Sums(harm.moved(more), repair, both.moved(more), volume.moved(much), by_event)


def _mixture(
    rate: Mapping[str, float], facts: Mapping[str, Facts], shares: Mapping[str, float]
) -> Facts:
    """Return what is known of a release that draws its event, weighted by rate over chance."""
    names = list(facts)
    chance = np.array([shares[n] * (facts[n].reached + 0.5) for n in names])
    chance /= np.array([facts[n].releases + 1.0 for n in names])
    weight = np.array([rate[n] / shares[n] for n in names])

    def known(of: Callable[[Facts], Known]) -> Known:
        mean = weight * np.array([of(facts[n]).mean for n in names])
        square = mean**2 * (1.0 + np.array([of(facts[n]).variation for n in names]) ** 2)
        one, two = float(chance @ mean / chance.sum()), float(chance @ square / chance.sum())
        return Known(one, float(np.sqrt(max(two - one * one, 0.0)) / one) if one else 0.0)

    return Facts(1, 1, known(lambda f: f.harm), known(lambda f: f.volume), 1.0)


def _means(own: Account, known: Facts | None, mend: float) -> tuple[Mean, Mean, Mean, Mean]:
    """Return the means of harm, repair, both and volume of releases that weigh the same.

    A wall that slides onto the road does harm where no block reaches it.
    """
    harm = cost(own.harm, own.reached | (own.harm > 0.0), known.harm if known else None)
    repair = cost(own.repair, own.failed, Known(mend, REPAIR_VARIATION))
    volume = cost(own.volume, own.reached, known.volume if known else None)
    return harm, repair, pair(harm, repair, _correlation(own.harm, own.repair)), volume


def _correlation(one: Floats, two: Floats) -> float:
    """Return the correlation of two costs of releases, 0 where it is negative or unknown."""
    a, b = one - one.mean(), two - two.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return max(float(a @ b) / size, 0.0) if size > 0.0 else 0.0


def _probabilities(names: Sequence[str], found: Account, happened: Bools) -> dict[str, Estimate]:
    """Return for each event how often something happened."""
    out = {}
    for name in names:
        own = found.event == name
        out[name] = estimate(int((happened & own).sum()), int(own.sum()))
    return out


def _mending(site: Site, layout: Layout) -> float:
    """Return what it costs to mend the dearest barrier of a layout that can fail [EUR].

    A panel of it, the least that is mended; 0 if none can.
    """
    prices = zip(layout, capitals(site, layout), strict=True)
    return PANEL * max((price for b, price in prices if b.kind in FAIL), default=0.0)
