"""Outcomes of releases, many at once; those without barriers are asked for again and again."""

from __future__ import annotations

from collections.abc import Sequence

import rigdda
from envs.crew import Job, Workers
from envs.memory import Memory, fingerprint
from rigdda import Layout, Outcome

Key = tuple[bytes, Layout, int]

memory: Memory[Key, Outcome] = Memory(4096)
"""Outcomes without barriers by site and seed, about 1 kB each."""


def outcomes(jobs: Sequence[Job], workers: Workers | None = None) -> list[Outcome]:
    """Return the outcome of every job; equal jobs are simulated once.

    Parameters
    ----------
    jobs : sequence of (Site, Layout, int)
        Releases.
    workers : Workers, optional
        Where to simulate; None: in threads over all cores.

    Raises
    ------
    BadInput, Diverged
        As `rigdda.release` does.
    """
    prints = {id(site): fingerprint(site) for site, _, _ in jobs}
    keys = [(prints[id(site)], layout, seed) for site, layout, seed in jobs]
    known = memory.recall(key for key in keys if not key[1])
    new = {key: job for key, job in zip(keys, jobs, strict=True) if key not in known}
    if workers is None:
        found = rigdda.release_many(list(new.values()))
    else:
        found = list(workers.map(_outcome, list(new.values())))
    fresh = dict(zip(new, found, strict=True))
    memory.remember({key: outcome for key, outcome in fresh.items() if not key[1]})
    known |= fresh
    return [known[key] for key in keys]


def _outcome(job: Job) -> Outcome:
    """Return the outcome of one release; at module level, for process pools to find it."""
    return rigdda.release_outcome(*job)
