"""Memory of what happens without barriers: environments and designers ask for it again and again.

Only outcomes of the empty layout are kept, by site and seed, the latest `ROOM` of this process.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping
from threading import Lock

import msgspec

from rigdda import Outcome, Site

ROOM = 4096
"""Outcomes kept, about 1 kB each."""

_kept: OrderedDict[tuple[bytes, int], Outcome] = OrderedDict()
_lock = Lock()


def fingerprint(site: Site) -> bytes:
    """Return a key for a site: the whole of it as JSON, in which numbers survive exactly."""
    return msgspec.json.encode(site)


def recall(site: Site, seeds: Iterable[int]) -> dict[int, Outcome]:
    """Return the outcomes without barriers that are known, by seed."""
    key, known = fingerprint(site), {}
    with _lock:
        for seed in seeds:
            if (key, seed) in _kept:
                _kept.move_to_end((key, seed))
                known[seed] = _kept[key, seed]
    return known


def remember(site: Site, outcomes: Mapping[int, Outcome]) -> None:
    """Keep outcomes without barriers, by seed, and forget the oldest beyond `ROOM`."""
    key = fingerprint(site)
    with _lock:
        for seed, outcome in outcomes.items():
            _kept[key, seed] = outcome
        while len(_kept) > ROOM:
            _kept.popitem(last=False)
