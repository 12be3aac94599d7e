"""Outcomes of releases, many at once; what need not be simulated again is not.

A release without barriers whose blocks never come to where a layout stands is that of the layout,
too. And a single fence that held what one block brought holds the same block in any class above
what it took: the flight up to the fence does not depend on it, and its height falls in releases of
several blocks only.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import rigdda
from envs import untouched
from envs.crew import Workers
from envs.memory import Memory, fingerprint
from envs.samples import Sample
from rigdda import Fence, Layout, Mesh, Outcome, Site

Job = tuple[Site, Layout, int, str]
"""A site, what stands on it, the seed of a release and the name of its event."""


class Key(NamedTuple):
    """A release: on which site, with what but mesh, and which one.

    Of a single fence without its class `layout` is its x, height and thickness [m].
    """

    site: bytes
    layout: tuple[Any, ...]
    seed: int
    event: str


free: Memory[Key, Outcome] = Memory(1 << 16)
"""Outcomes without barriers, about 1 kB each."""

held: Memory[Key, Outcome] = Memory(1 << 16)
"""Outcomes of single fences that held one block, by the fence without its class."""


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
    fences = {key: _place(sites[key.site], key) for key in wanted}
    stood = held.recall({place for place in fences.values() if place is not None})
    known: dict[Key, Outcome] = {}
    for key, place in fences.items():
        without = bare.get(key._replace(layout=()))
        before = stood.get(place) if place is not None else None
        found: Outcome | None
        found = (
            untouched.outcome(sites[key.site], key.site, key.layout, without) if without else None
        )
        if found is None and before is not None:
            found = _of_class(key.layout[0], before)
        if found is not None:
            known[key] = found
    return known


def _remember(fresh: Mapping[Key, Outcome], jobs: Mapping[Key, Job]) -> None:
    """Keep what later releases may follow from."""
    bare, stood = {}, {}
    for key, outcome in fresh.items():
        site = jobs[key][0]
        # a wall that moved before may be struck where it did not stand
        struck = any(barrier.hits for barrier in outcome.barriers)
        if not struck and untouched.misses(site, key.site, key.layout, outcome):
            lies = outcome.slope_fraction + outcome.held_fraction
            alone = replace(outcome, barriers=(), held_fraction=0.0, slope_fraction=lies)
            bare[key._replace(layout=())] = alone
        place = _place(site, key)
        if place is not None and not outcome.barriers[0].failed:
            stood[place] = outcome
    free.remember(bare)
    held.remember(stood)


def _place(site: Site, key: Key) -> Key | None:
    """Return a release with a single fence without its class, None of any other release."""
    if len(key.layout) != 1 or not isinstance(key.layout[0], Fence):
        return None
    event = site.event(key.event)
    source = site.source(event.source)
    single = event.number == (1, 1) if source.band is not None else len(source.blocks) == 1
    fence = key.layout[0]
    return key._replace(layout=(fence.x, fence.height, fence.thickness)) if single else None


def _of_class(fence: Fence, before: Outcome) -> Outcome | None:
    """Return the outcome of a fence where another class held the block, None if it may not."""
    own, took = fence.for_width(before.width), before.barriers[0]
    assert own.capacity is not None
    if took.absorbed_energy > own.capacity or took.thrust > own.bears:
        return None
    left = own.left_height(took.absorbed_energy)
    if left < took.left_height and before.held_fraction > 0.0:
        return None  # so low it may not hold what lies there
    if left > took.left_height and before.slope_fraction > 0.0:
        return None  # so high it may
    mine = replace(took, resistance=own.bears, left_height=left)
    return replace(before, barriers=(mine,))
