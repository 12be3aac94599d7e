"""Sites of the command line, in which the rates of all events are those of releases."""

from __future__ import annotations

import os

from rigdda import Site
from rigdda.app.reports.wording import percent
from rigdda.app.terminal import note
from rigdda.envs.arrivals import ReleaseRate, release_rates, with_release_rates


def released(site: Site | str | os.PathLike[str]) -> Site:
    """Return a site, which may be given by name or file, with all rates as those of releases.

    For each event whose rate is that of arrivals, a note gives both rates and their ratio.

    Raises
    ------
    BadInput
        If there is no such site, or as `rigdda.envs.arrivals.release_rates` does.
    Diverged
        If a simulation diverges.
    """
    where = site if isinstance(site, Site) else Site.load(site)
    rates = release_rates(where)
    for rate in rates:
        note(in_words(rate))
    return with_release_rates(where, rates)


def in_words(rate: ReleaseRate) -> str:
    """Return the rates of arrivals and releases of an event, and their ratio, in words."""
    chance = rate.chance
    ends = f"{percent(chance.low, 'down')} to {percent(chance.high, 'up')}"
    return (
        f"event {rate.event!r}: rock arrives {rate.arrivals:.3g} times a year per 100 m (given); "
        f"P(arrival) is {percent(chance.probability)} ({ends}, from {chance.releases:,} releases "
        f"without new barriers); {rate.releases:.3g} releases a year per 100 m are used"
    )
