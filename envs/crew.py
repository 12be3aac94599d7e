"""Processes that simulate releases: more of them at once than threads under one lock."""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any, Protocol, TypeVar

from rigdda import check

Result = TypeVar("Result")

Job = tuple[Any, ...]
"""A site, what stands on it, the seed of a release and the name of its event."""

MOST = 256
"""Most processes."""

KEPT = 4096
"""Seeds of which it is known where they were simulated: as many as a process keeps the rock of."""


class Workers(Protocol):
    """Where releases are simulated: a `Crew`, or an Executor of the standard library."""

    def map(self, fn: Callable[[Any], Result], jobs: Sequence[Any], /) -> Iterator[Result]:
        """Return an iterator over the results of a function of every job, in order."""


class Crew:
    """Processes that start with the first job and end with `close`.

    The rock of a release takes as long to cut as its fall to simulate, and a process keeps what it
    has cut: so the jobs of a seed go to the process that had the first, as far as each then gets
    its share.

    Parameters
    ----------
    processes : int
        How many.

    Raises
    ------
    BadInput
        If that is not a whole number of 1 to 256.
    """

    def __init__(self, processes: int):
        number = check.integer("processes", processes, 1, MOST)
        self._pools = [
            ProcessPoolExecutor(1, get_context("spawn"), _end_with_parent) for _ in range(number)
        ]
        self._home: dict[int, int] = {}

    def __reduce__(self) -> tuple[type[Crew], tuple[int]]:
        """Return what makes a crew of as many: a copy of an environment has its own."""
        return Crew, (len(self._pools),)

    def map(self, fn: Callable[[Any], Result], jobs: Sequence[Job], /) -> Iterator[Result]:
        """Start all jobs and return an iterator over the results of a function, in order.

        The function is at module level, for the processes to find it.
        """
        share = math.ceil(len(jobs) / len(self._pools))
        load = [0] * len(self._pools)
        started = []
        for job in jobs:
            home = self._home.get(job[2])
            if home is None or load[home] == share:
                home = load.index(min(load))
                self._keep(job[2], home)
            load[home] += 1
            started.append(self._pools[home].submit(fn, job))
        return (future.result() for future in started)

    def _keep(self, seed: int, home: int) -> None:
        """Note which process has the jobs of a seed, and forget the oldest ones."""
        self._home[seed] = home
        if len(self._home) > KEPT:
            del self._home[next(iter(self._home))]

    def close(self) -> None:
        """End the processes; jobs that have not begun are dropped."""
        for pool in self._pools:
            pool.shutdown(cancel_futures=True)


def _end_with_parent() -> None:
    """End this process with the one that started it, even if that was killed, and not before.

    An interrupt from the keyboard reaches both: it is for the parent to say what follows.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
