"""What falls without barriers: the cost of nothing, and how releases spread over events.

Known once a site, and kept on disk: every reward is measured against it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from rigdda import Outcome, Site
from rigdda.envs import outcome_cache, site_store
from rigdda.envs.cost import Evaluation, Facts, account, judge, learn
from rigdda.envs.outcome_cache import Memory, Sample

SEEDS = 2**33
"""First seed of the releases without barriers that a site is known by. Episodes score releases of
seeds below 2**31, envelopes look at some from 2**32 on."""

FIRST, ALL = 32, 2048
"""Releases of each event from which the spread of its cost is judged, and of all together."""

FLOOR = 0.2
"""Least share of an event of single blocks, over an equal share, less of others as they take more
time: one that costs nothing without barriers, or happens seldom, is looked at, too."""

OWN_TIME, CROWDED = 1.0, 1.2
"""Processor time of a release beyond that of its blocks, over that of a block, and the power of
their number by which that of blocks grows [-]: on `shu-hwa` 1.5, 5 and 450 ms for 1, 7 and 120."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """What is known of a site without barriers.

    Parameters
    ----------
    nothing : Evaluation
        Of the layout without barriers; its outcomes are not kept.
    facts : dict of str to Facts
        What is known of each event.
    shares : dict of str to float
        Share of the releases for each event; they add up to 1.
    """

    nothing: Evaluation
    facts: dict[str, Facts]
    shares: dict[str, float]


NAME = "ensemble"
"""Of what is kept on disk, see `rigdda.envs.site_store`."""

memory: Memory[bytes, Ensemble] = Memory(4096)
"""Ensembles by site, about 3 kB each."""


def of(site: Site, key: bytes, executor: Executor | None = None) -> Ensemble:
    """Return what is known of a site without barriers, simulated if it is not kept.

    Parameters
    ----------
    site, key : Site, bytes
        The site and its `fingerprint`.
    executor : Executor, optional
        Where to simulate; None: in threads over all cores.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    known = memory.recall([key]).get(key)
    if known is None:
        known = site_store.read(NAME, key, Ensemble)
        if known is None:
            known = _simulate(site, executor)
            site_store.write(NAME, key, known)
        memory.remember({key: known})
    return known


def _simulate(site: Site, executor: Executor | None) -> Ensemble:
    """Simulate releases: at first as many of each event, then where they tell most."""
    names = site.event_names
    first = _releases(site, {name: range(SEEDS, SEEDS + FIRST) for name in names}, executor)
    wanted = _shared(_shares(site, _facts(site, first)), ALL)
    more = {name: range(SEEDS + FIRST, SEEDS + max(wanted[name], FIRST)) for name in names}
    both = first + _releases(site, more, executor)
    facts = _facts(site, both)
    bare = judge(site, (), both, {}, {})
    found = replace(bare, outcomes=(), simulated=both.simulated, seconds=both.seconds)
    return Ensemble(found, facts, _shares(site, facts))


def _releases(site: Site, seeds: Mapping[str, range], executor: Executor | None) -> Sample:
    jobs = [(site, (), seed, name) for name, drawn in seeds.items() for seed in drawn]
    return outcome_cache.outcomes(jobs, executor)


def _facts(site: Site, outcomes: Sequence[Outcome]) -> dict[str, Facts]:
    """Return what releases without barriers tell of each event."""
    found, out = account(site, (), outcomes), {}
    released = np.array([o.released_volume for o in outcomes])
    for name in site.event_names:
        own = found.event == name
        blocks = [len(site.draw(seed, name).blocks) for seed in range(SEEDS, SEEDS + FIRST)]
        out[name] = learn(site, found.of(own), released[own], float(np.mean(blocks)))
    return out


def _shares(site: Site, facts: Mapping[str, Facts]) -> dict[str, float]:
    """Return the share of the releases for each event.

    In proportion to rate x spread / root of the time of a release (Neyman's allocation), and no
    less than a floor. The spread is the greatest that a layout can give the cost
    of the event which lets it onto the road at most as often as nothing does: barriers make sure
    harm a matter of chance.
    """
    free = all(fact.harm.mean == 0.0 for fact in facts.values())  # then debris is what counts
    weight = {}
    for name, fact in facts.items():
        dear = fact.volume if free else fact.harm
        chance = min((fact.reached + 0.5) / (fact.releases + 1.0), 0.5)
        spread = dear.mean * math.sqrt(chance * (1.0 - chance) + chance * dear.variation**2)
        weight[name] = site.rate(name, ()) * spread / math.sqrt(_time(fact))
    whole = sum(weight.values())
    equal = 1.0 / len(weight)
    least = {name: FLOOR * equal * (OWN_TIME + 1.0) / _time(fact) for name, fact in facts.items()}
    raised = {n: max(w / whole if whole else equal, least[n]) for n, w in weight.items()}
    return {name: share / sum(raised.values()) for name, share in raised.items()}


def _time(fact: Facts) -> float:
    """Return the processor time of a release of an event, over that of a block [-]."""
    return float(OWN_TIME + fact.blocks**CROWDED)


def _shared(shares: Mapping[str, float], releases: int) -> dict[str, int]:
    return {name: math.ceil(share * releases) for name, share in shares.items()}
