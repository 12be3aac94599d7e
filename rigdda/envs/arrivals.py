"""Rates of releases from rates of arrivals.

A log of rock on the road counts events of which rock arrives at the road; the model needs the rate
of releases, some of which come to rest on the slope or behind existing barriers. With the
probability p that a block of a release reaches the road without new barriers,

    rate of releases = rate of arrivals / p.

p is estimated once, from releases without new barriers with seeds of their own, and the site with
the rates of releases is then used for everything. The releases of all sites have the same seeds, so
that sites with other prices or rates have the same p. Its interval is not part of those of results.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import msgspec

from rigdda import BadInput, Site
from rigdda.envs.ensemble import bare_outcomes
from rigdda.envs.intervals import Estimate, estimate
from rigdda.model.site_tables import ARRIVAL, MOST_OFTEN, RELEASE, Event
from rigdda.releases import as_site

LEAST_RELEASES, MOST_RELEASES = 64, 2048
"""Least and greatest number of releases of an event from which p is estimated."""

ENOUGH = 0.05
"""Standard deviation of p, relative to p, from which no more releases are simulated [-]."""


class ReleaseRate(NamedTuple):
    """The rate of the releases of an event whose rate of arrivals is given.

    Parameters
    ----------
    event : str
        Name of the event.
    arrivals : float
        Rate at which rock of it reaches the road without new barriers [1/year per 100 m of slope].
    chance : Estimate
        Probability that a block of a release reaches the road without new barriers.
    releases : float
        Rate of the releases [1/year per 100 m of slope].
    """

    event: str
    arrivals: float
    chance: Estimate
    releases: float


def release_rates(site: Site) -> list[ReleaseRate]:
    """Return the rates of the releases of all events whose rate is that of arrivals.

    Parameters
    ----------
    site : Site
        The site, with its existing barriers.

    Raises
    ------
    BadInput
        If no release of such an event reaches the road, or the rate of its releases is too high.
    Diverged
        If a simulation diverges.
    """
    where = as_site(site)
    return [_converted(where, e) for e in where.events if e.rate_of == ARRIVAL]


def with_release_rates(site: Site, rates: Sequence[ReleaseRate] | None = None) -> Site:
    """Return a copy of a site in which the rates of all events are those of releases.

    Parameters
    ----------
    site : Site
        The site.
    rates : sequence of ReleaseRate, optional
        Its `release_rates`, if they are known.

    Raises
    ------
    BadInput
        As `release_rates` does.
    Diverged
        If a simulation diverges.
    """
    where = as_site(site)
    known = release_rates(where) if rates is None else rates
    own = {rate.event: rate.releases for rate in known}
    events = tuple(
        msgspec.structs.replace(e, rate=own[e.name], rate_of=RELEASE) if e.name in own else e
        for e in where.events
    )
    return msgspec.structs.replace(where, events=events) if own else where


def _converted(site: Site, event: Event) -> ReleaseRate:
    """Return the rate of the releases of an event whose rate is that of arrivals."""
    chance = _chance(site, event.name)
    if chance.count == 0:
        hint = (
            f"give the rate of releases: rock of this event reaches the road in none of "
            f"{chance.releases:,} releases without new barriers, so that its rate does not follow "
            "from that of arrivals"
        )
        raise BadInput(f"{event.words}.rate_of", event.rate_of, hint)
    rate = event.rate / chance.probability
    if rate > MOST_OFTEN:
        hint = (
            f"give a lower rate of arrivals: this is {rate:,.0f} releases a year on 100 m, at most "
            f"{MOST_OFTEN:g}"
        )
        raise BadInput(f"{event.words}.rate", event.rate, hint)
    return ReleaseRate(event.name, event.rate, chance, rate)


def _chance(site: Site, event: str) -> Estimate:
    """Return the probability that rock of an event reaches the road without new barriers."""
    count = LEAST_RELEASES
    while True:
        outcomes = bare_outcomes(site, {event: count})[event]
        reached = sum(outcome.reached for outcome in outcomes)
        if suffices(reached, count):
            return estimate(reached, count)
        count *= 2


def suffices(reached: int, releases: int) -> bool:
    """Return whether the share of releases that reach the road is known well enough.

    It is if its relative standard error is at most `ENOUGH`, or after `MOST_RELEASES`.
    """
    if releases >= MOST_RELEASES:
        return True
    share = reached / releases
    return share > 0.0 and math.sqrt((1.0 - share) / (share * releases)) <= ENOUGH
