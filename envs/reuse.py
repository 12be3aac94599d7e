"""Outcomes of releases, many at once; what need not be simulated again is not.

A release without barriers whose blocks never come to where a layout stands is that of the layout,
too.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import rigdda
from rigdda import Layout, Mesh, Outcome, Site
from rigdda.barriers import Built
from rigdda.envs import untouched
from rigdda.envs.crew import Workers
from rigdda.envs.memory import Memory, fingerprint
from rigdda.envs.samples import Sample

Job = tuple[Site, Layout, int, str]
"""A site, what stands on it, the seed of a release and the name of its event."""


class Key(NamedTuple):
    """A release: on which site, with what but mesh, and which one."""

    site: bytes
    layout: tuple[Built, ...]
    seed: int
    event: str


free: Memory[Key, Outcome] = Memory(1 << 16)
"""Outcomes without barriers, about 1 kB each."""


def outcomes(jobs: Sequence[Job], workers: Workers | None = None) -> Sample:
    """Return the outcome of every job; equal jobs are simulated once.

    Parameters
    ----------
    jobs : sequence of (Site, Layout, int, str)
        Releases.
    workers : Workers, optional
        Where to simulate; None: in threads over all cores.

    Raises
    ------
    BadInput, Diverged
        As `rigdda.release` does.
    """
    prints = {id(site): fingerprint(site) for site, *_ in jobs}
    keys = [
        Key(prints[id(site)], tuple(b for b in layout if not isinstance(b, Mesh)), seed, event)
        for site, layout, seed, event in jobs
    ]
    known = _recall(keys, jobs)
    new = {key: job for key, job in zip(keys, jobs, strict=True) if key not in known}
    found, seconds = _simulate(list(new.values()), workers)
    fresh = dict(zip(new, found, strict=True))
    _remember(fresh, new)
    known |= fresh
    ran = []
    for key in keys:
        ran.append(key in new)
        new.pop(key, None)
    return Sample([known[key] for key in keys], ran, seconds)


def _simulate(jobs: list[Job], workers: Workers | None) -> tuple[list[Outcome], float]:
    """Return outcomes and the processor time that they took [s]."""
    if workers is not None:
        timed = list(workers.map(_timed, jobs))
        return [outcome for outcome, _ in timed], sum(seconds for _, seconds in timed)
    start = time.process_time()
    found = rigdda.release_many(jobs) if jobs else []
    return found, time.process_time() - start


def _timed(job: Job) -> tuple[Outcome, float]:
    """Return an outcome and its processor time; at module level, for process pools to find it."""
    start = time.process_time()
    (outcome,) = rigdda.release_many([job])
    return outcome, time.process_time() - start


def _recall(keys: Sequence[Key], jobs: Sequence[Job]) -> dict[Key, Outcome]:
    """Return the outcomes that follow from what was simulated before."""
    sites = {key.site: job[0] for key, job in zip(keys, jobs, strict=True)}
    wanted = set(keys)
    bare = free.recall({key._replace(layout=()) for key in wanted})
    known: dict[Key, Outcome] = {}
    for key in wanted:
        without = bare.get(key._replace(layout=()))
        if without is not None:
            found = untouched.outcome(sites[key.site], key.site, key.layout, without)
            if found is not None:
                known[key] = found
    return known


def _remember(fresh: Mapping[Key, Outcome], jobs: Mapping[Key, Job]) -> None:
    """Keep what later releases may follow from."""
    bare = {}
    for key, outcome in fresh.items():
        # a wall that moved before may be struck where it did not stand
        struck = any(barrier.hits for barrier in outcome.barriers)
        if not struck and untouched.misses(jobs[key][0], key.site, key.layout, outcome):
            lies = outcome.slope_fraction + outcome.held_fraction
            alone = replace(outcome, barriers=(), held_fraction=0.0, slope_fraction=lies)
            bare[key._replace(layout=())] = alone
    free.remember(bare)
