"""What one layout costs more than another, from releases that both meet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from envs.accounts import Account, account
from rigdda import BadInput, Layout, Outcome, Site

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
        95 % interval, Student's with Welch's freedom. Releases are paired: the same rock comes down
        with both, and what both let past, or both keep off, does not widen it. It is too short
        where few releases of an event differ: look at `differ`.
    releases, differ : int
        How many both met, and in how many of these they did not cost the same.
    """

    value: float
    ci: tuple[float, float]
    releases: int
    differ: int


def difference(
    site: Site,
    layouts: tuple[Layout, Layout],
    outcomes: tuple[Sequence[Outcome], Sequence[Outcome]],
) -> Difference:
    """Return what the first layout costs more than the second.

    Parameters
    ----------
    outcomes : two sequences of Outcome
        Of each layout, of the same releases in the same order.

    Raises
    ------
    BadInput
        If an event that happens has fewer than `LEAST` releases.
    """
    one, two = (account(site, a, b) for a, b in zip(layouts, outcomes, strict=True))
    value = site.annual(layouts[0]) - site.annual(layouts[1])
    spread, freedom, differ = 0.0, 0.0, 0
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
        square = float(more.var(ddof=1)) / len(more)
        spread += square
        freedom += square**2 / (len(more) - 1)
    half = 0.0
    if spread > 0.0:
        half = float(stdtrit(spread**2 / freedom, 0.975)) * math.sqrt(spread)
    return Difference(value, (value - half, value + half), len(one.event), differ)


def _spent(found: Account) -> NDArray[np.float64]:
    """Return harm and repair of each release [EUR]."""
    return found.harm + found.repair
