"""Sites of the page in which the rates of all events are those of releases, as in the commands.

The conversion of a rate of arrivals needs releases without new barriers, see
`rigdda.envs.arrivals`. They are simulated in portions, so that a thread can leave them when the
site changes. They are stored on disk: no thread and no command simulates them again.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import NamedTuple

from rigdda import BadInput, Site
from rigdda.app.page.portions import FIRST, next_size
from rigdda.app.released import in_words
from rigdda.envs.arrivals import LEAST_RELEASES, release_rates, suffices, with_release_rates
from rigdda.envs.ensemble import bare_outcomes
from rigdda.model.site_tables import ARRIVAL

REMEDY = "Change its return period, or what it counts, in the tab Slope."
"""What a user does about a rate that cannot be converted."""


class Released(NamedTuple):
    """A site in which the rates of all events are those of releases."""

    site: Site
    notes: tuple[str, ...]
    """How each rate of arrivals was converted, in words."""


def simulate(site: Site) -> Iterator[str]:
    """Simulate the releases that `released` needs, and yield after each portion what is done."""
    for event in site.events:
        if event.rate_of == ARRIVAL:
            yield from _simulate(site, event.name)


def _simulate(site: Site, event: str) -> Iterator[str]:
    """Simulate the releases from which the rate of an event is converted."""
    done, size, wanted = 0, FIRST, LEAST_RELEASES
    while done < wanted:
        start = time.monotonic()
        done = min(wanted, done + size)
        outcomes = bare_outcomes(site, {event: done})[event]
        size = next_size(size, time.monotonic() - start)
        yield f"computing the rate of {event} from {done:,} releases without new barriers"
        if done == wanted and not suffices(sum(one.reached for one in outcomes), done):
            wanted *= 2


def released(site: Site) -> Released:
    """Return a site with the rates of releases of all events, as the commands use them.

    Raises
    ------
    BadInput
        If a rate cannot be converted; the message tells a user of the page what to do.
    Diverged
        If a simulation diverges.
    """
    try:
        rates = release_rates(site)
    except BadInput as bad:
        raise BadInput(bad.field, bad.value, f"{bad.hint}. {REMEDY}") from None
    return Released(with_release_rates(site, rates), tuple(map(in_words, rates)))
