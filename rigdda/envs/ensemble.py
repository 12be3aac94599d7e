"""Barrier-free statistics of a site: the evaluation without barriers, and the share of each event.

They are computed once per site and stored on disk. Rewards are measured relative to them.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from rigdda import Outcome, Site
from rigdda.envs import outcome_cache, site_store
from rigdda.envs.cost import Evaluation, Facts, account, judge, learn
from rigdda.envs.outcome_cache import Memory
from rigdda.releases import check_duration
from rigdda.seeds import NO_BARRIERS

FIRST_ROUND, BOTH_ROUNDS = 32, 2048
"""Number of releases of each event in the first round, and total number in both rounds together."""

FIRST_SEEDS = range(NO_BARRIERS, NO_BARRIERS + FIRST_ROUND)
"""Seeds of the first round."""

LEAST_EVENT_SHARE = 0.2
"""Minimum share of an event of single blocks relative to an equal share; events with more blocks
have a lower minimum because they take longer to simulate. It ensures that events which are rare or
cause no cost without barriers are sampled, too."""

DESIGN_FLOOR = 1.0 / 30.0
"""Least share of the releases for a design event [-]. Of 3,000 releases at least 100 are of this
event: if no block reaches the road in any of them, the probability is below 3 % (95 %)."""

OWN_TIME, BLOCK_COST = 1.0, 1.2
"""Model of the processor time of a release relative to that of one block [-]: a constant part, plus
the number of blocks raised to a power. On `shu-hwa` releases of 1, 7 and 120 blocks take 1.5, 5 and
450 ms."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Statistics of a site without barriers.

    Parameters
    ----------
    nothing : Evaluation
        Evaluation of the empty layout, without its outcomes.
    facts : dict of str to Facts
        Statistics of each event.
    shares : dict of str to float
        Share of the releases for each event with which the variance of Z is least; they add up to
        1.
    """

    nothing: Evaluation
    facts: dict[str, Facts]
    shares: dict[str, float]

    def planned_shares(self, site: Site) -> dict[str, float]:
        """Return the shares with at least `DESIGN_FLOOR` for each design event of the site."""
        design = {event.name for event in site.events if event.design}
        floor = min(DESIGN_FLOOR, 1.0 / len(self.shares))
        raised: set[str] = set()
        shares = self.shares
        while low := {name for name in design - raised if shares[name] < floor}:
            raised |= low
            left = 1.0 - floor * len(raised)
            whole = sum(share for name, share in self.shares.items() if name not in raised)
            shares = {
                name: floor if name in raised else share * left / whole
                for name, share in self.shares.items()
            }
        return shares


STORED_AS = "ensemble"
"""Name under which ensembles are stored on disk; see `rigdda.envs.site_store`."""

memory: Memory[bytes, Ensemble] = Memory(4096)
"""Ensembles by site, about 3 kB each."""


def of(site: Site, key: bytes) -> Ensemble:
    """Return the barrier-free statistics of a site, simulating them if they are not stored.

    Parameters
    ----------
    site, key : Site, bytes
        The site and its `fingerprint`.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    known = memory.recall([key]).get(key)
    if known is None:
        known = site_store.read(STORED_AS, key, Ensemble)
        if known is None:
            known = _simulate(site)
            site_store.write(STORED_AS, key, known)
        memory.remember({key: known})
    return known


def _simulate(site: Site) -> Ensemble:
    """Simulate an equal number of releases of each event, then more where they reduce variance."""
    names = site.event_names
    first = bare_outcomes(site, dict.fromkeys(names, FIRST_ROUND))
    wanted = _shared(_shares(site, _facts(site, _joined(first))), BOTH_ROUNDS)
    counts = {name: max(wanted[name], FIRST_ROUND) for name in names}
    more = bare_outcomes(site, counts)
    both = _joined(first) + _joined({name: more[name][FIRST_ROUND:] for name in names})
    facts = _facts(site, both)
    shares = _shares(site, facts)
    bare = judge(site, (), both, facts, shares)
    found = replace(bare, outcomes=(), simulated=len(both), seconds=0.0)
    return Ensemble(found, facts, shares)


BARE = "bare"
"""Name under which outcomes without barriers are stored on disk, about 100 bytes each."""


def bare_outcomes(site: Site, counts: Mapping[str, int]) -> dict[str, list[Outcome]]:
    """Return the outcomes of the first releases of each event without new barriers.

    They are stored on disk by what affects them, see `rigdda.envs.outcome_cache.release_key`, so
    that sites with other prices or rates do not simulate them again.

    Parameters
    ----------
    site : Site
        The site, with its existing barriers.
    counts : mapping of str to int
        Number of releases of each event; their seeds begin at
        `rigdda.seeds.NO_BARRIERS`.

    Raises
    ------
    Diverged
        If a simulation diverges.

    Warns
    -----
    DoubtfulInput
        If `motion.duration` cuts off more than one release in twenty.
    """
    known = {name: _stored(site, name) for name in counts}
    stored = _joined(known)
    check_duration([site] * len(stored), stored)
    jobs = [
        (site, (), NO_BARRIERS + i, name)
        for name, count in counts.items()
        for i in range(len(known[name]), count)
    ]
    if jobs:
        for (*_, name), outcome in zip(jobs, outcome_cache.outcomes(jobs), strict=True):
            known[name].append(outcome)
        for name in {name for *_, name in jobs}:
            site_store.write(BARE, _bare_key(site, name), outcome_cache.pack(known[name]))
    return {name: known[name][:count] for name, count in counts.items()}


def _stored(site: Site, event: str) -> list[Outcome]:
    """Return the outcomes of an event that are stored on disk; empty if there are none."""
    packed = site_store.read(BARE, _bare_key(site, event), bytes)
    with suppress(ValueError):
        return outcome_cache.unpack(packed) if packed else []
    return []


def _bare_key(site: Site, event: str) -> bytes:
    parts = outcome_cache.release_key(site).hex(), site.existing, event
    return hashlib.sha256(msgspec.json.encode(parts)).digest()[:16]


def _joined(found: Mapping[str, Sequence[Outcome]]) -> list[Outcome]:
    return [outcome for own in found.values() for outcome in own]


def _facts(site: Site, outcomes: Sequence[Outcome]) -> dict[str, Facts]:
    """Return the statistics of each event from releases without barriers."""
    blocks = {
        name: float(np.mean([len(site.draw(seed, name).blocks) for seed in FIRST_SEEDS]))
        for name in site.event_names
    }
    return statistics(site, outcomes, blocks)


def statistics(
    site: Site, outcomes: Sequence[Outcome], blocks: Mapping[str, float]
) -> dict[str, Facts]:
    """Return the statistics of each event from releases without barriers.

    Parameters
    ----------
    site : Site
        The site.
    outcomes : sequence of Outcome
        The outcomes.
    blocks : mapping of str to float
        Mean number of blocks in a release of each event.
    """
    found, out = account(site, (), outcomes), {}
    released = np.array([o.released_volume for o in outcomes])
    widths = np.array([o.width for o in outcomes])
    for name in site.event_names:
        own = found.event == name
        out[name] = learn(site, found.of(own), released[own], widths[own], blocks[name])
    return out


def _shares(site: Site, facts: Mapping[str, Facts]) -> dict[str, float]:
    """Return the share of the releases for each event.

    The share is proportional to rate x standard deviation / sqrt(time per release) (Neyman
    allocation), with a minimum share. The standard deviation is the largest that a layout can cause
    if it lets the event reach the road at most as often as without barriers: barriers can turn
    certain harm into random harm.
    """
    free = all(fact.harm.mean == 0.0 for fact in facts.values())  # then the debris is used instead
    weight = {}
    for name, fact in facts.items():
        loss = fact.volume if free else fact.harm
        chance = min((fact.reached + 0.5) / (fact.releases + 1.0), 0.5)
        spread = loss.mean * math.sqrt(chance * (1.0 - chance) + chance * loss.variation**2)
        weight[name] = site.rate(name, ()) * spread / math.sqrt(_time(fact))
    whole = sum(weight.values())
    equal = 1.0 / len(weight)
    least = {
        name: LEAST_EVENT_SHARE * equal * (OWN_TIME + 1.0) / _time(fact)
        for name, fact in facts.items()
    }
    raised = {n: max(w / whole if whole else equal, least[n]) for n, w in weight.items()}
    return {name: share / sum(raised.values()) for name, share in raised.items()}


def _time(fact: Facts) -> float:
    """Return the processor time of a release of an event relative to that of one block [-]."""
    return float(OWN_TIME + fact.blocks**BLOCK_COST)


def _shared(shares: Mapping[str, float], releases: int) -> dict[str, int]:
    return {name: math.ceil(share * releases) for name, share in shares.items()}
