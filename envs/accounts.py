"""What releases of a layout cost, one by one, and what those of an event tell of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import Layout, Outcome, Site
from rigdda.envs.evaluation import Facts
from rigdda.envs.intervals import Known

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Account:
    """What each of some releases of one layout costs, in arrays (n,)."""

    event: NDArray[np.str_]
    harm: Floats
    repair: Floats
    volume: Floats
    reached: Bools
    failed: Bools

    def of(self, which: Bools) -> Account:
        """Return the account of some of the releases."""
        return Account(
            self.event[which],
            self.harm[which],
            self.repair[which],
            self.volume[which],
            self.reached[which],
            self.failed[which],
        )


def account(site: Site, layout: Layout, outcomes: Sequence[Outcome]) -> Account:
    """Return what each release costs."""
    bills = [site.bill(layout, outcome) for outcome in outcomes]
    return Account(
        event=np.array([outcome.event for outcome in outcomes]),
        harm=np.array([bill.harm for bill in bills]),
        repair=np.array([bill.repair for bill in bills]),
        volume=np.array([outcome.road_volume for outcome in outcomes]),
        reached=np.array([outcome.reached for outcome in outcomes], dtype=bool),
        failed=np.array([any(b.failed for b in o.barriers) for o in outcomes], dtype=bool),
    )


def learn(site: Site, own: Account, released: Floats, blocks: float) -> Facts:
    """Return what some releases of an event tell of it.

    If none came onto the road it is as if all rock had come: none of n is not never.

    Parameters
    ----------
    own : Account
        What they cost.
    released : (n,) array
        Volume that each released [m3].
    blocks : float
        Mean number of blocks.
    """
    harm, volume = own.harm[own.reached], own.volume[own.reached]
    if not len(harm):
        volume = released
        harm = np.array([site.consequences.harm(v, True) for v in volume.tolist()])
    count = len(own.harm), int(own.reached.sum())
    return Facts(*count, Known.of(harm), Known.of(volume), blocks)
