"""How the releases of an evaluation spread over the events of a site."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Points this far apart on a circle of length 1 spread evenly, however many there are."""


def events(shares: Mapping[str, float], seeds: Sequence[int]) -> tuple[str, ...]:
    """Return the event of each release; the first ones' do not depend on how many follow.

    With at least two releases an event on the average, each event has one, then one more, and then
    as many as its share asks for. With fewer, each draws its event with its share as the chance:
    one number, drawn from the first seed, and steps of `GOLDEN` from it, so that every release
    has the right chances and together they are spread evenly.

    Parameters
    ----------
    shares : mapping of str to float
        Share of each event; they add up to 1.
    seeds : sequence of int
        Seeds of the releases.
    """
    names = tuple(shares)
    if len(seeds) >= 2 * len(names):
        return tuple(names[i] for i in _order(tuple(shares.values()), len(seeds)))
    edges = np.cumsum(list(shares.values()))[:-1]
    first = np.random.default_rng([int(seeds[0]), len(names), 2**31]).random()
    place = (first + GOLDEN * np.arange(len(seeds))) % 1.0
    return tuple(names[i] for i in np.searchsorted(edges, place, side="right"))


@lru_cache(maxsize=256)
def _order(shares: tuple[float, ...], releases: int) -> tuple[int, ...]:
    """Return the place of the event of each release."""
    number = len(shares)
    out = [*range(number), *range(number)]
    counts = [2] * number
    while len(out) < releases:
        lacks = [
            share * (len(out) + 1) - count for share, count in zip(shares, counts, strict=True)
        ]
        most = lacks.index(max(lacks))
        counts[most] += 1
        out.append(most)
    return tuple(out)
