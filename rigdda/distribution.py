"""Distribution of releases: in threads of this process by default, or in an executor.

Every executor of `concurrent.futures` will do. `connected("dask://HOST:PORT")` gives that of a Dask
scheduler (extra `dask`), whose workers may be on other machines. The outcome of a release depends
only on site, layout, seed and event, so that results do not depend on where they were computed. The
scheduler repeats the work of a worker that dies.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from rigdda.errors import BadInput

Item = TypeVar("Item")
Result = TypeVar("Result")

ADDRESS = re.compile(r"dask://(?P<host>[^:/]+):(?P<port>\d+)$")
"""Form of the address of a scheduler."""

PATIENCE = 10.0
"""Time after which a scheduler that does not answer counts as absent [s]."""

_executors: list[Executor] = []
"""Executors in use, the current one last."""

_remote = False
"""Whether this process is a worker: its releases then use a single thread."""


@contextmanager
def using(executor: Executor) -> Iterator[Executor]:
    """Compute all releases within the context in an executor.

    Parameters
    ----------
    executor : concurrent.futures.Executor
        For example a `ProcessPoolExecutor`, or the executor of a Dask client.

    Raises
    ------
    BadInput
        If it has no method `map`.
    """
    if not callable(getattr(executor, "map", None)):
        raise BadInput("executor", executor, "give a concurrent.futures.Executor")
    _executors.append(executor)
    try:
        yield executor
    finally:
        _executors.remove(executor)


def current() -> Executor | None:
    """Return the executor in use, or None for threads of this process."""
    return _executors[-1] if _executors else None


def threads() -> int:
    """Return the number of threads for the releases of this process: one in a worker."""
    return 1 if _remote else os.cpu_count() or 1


@contextmanager
def connected(address: str) -> Iterator[Executor]:
    """Compute all releases within the context on the workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as "dask://127.0.0.1:8786".

    Raises
    ------
    BadInput
        If the address is invalid, the extra `dask` is not installed, or no scheduler with workers
        answers.
    """
    found = ADDRESS.match(address)
    if not found:
        mend = "give the address of a Dask scheduler as dask://HOST:PORT"
        raise BadInput("executor", address, mend)
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise BadInput("executor", address, "install dask: pip install 'rigdda[dask]'") from None
    try:
        client = Client(f"tcp://{found['host']}:{found['port']}", timeout=PATIENCE)
    except OSError as error:
        mend = f"start the scheduler first: dask scheduler --port {found['port']} ({error})"
        raise BadInput("executor", address, mend) from None
    try:
        if not client.scheduler_info()["workers"]:
            where = f"{found['host']}:{found['port']}"
            mend = f"start workers first: dask worker {where} --nworkers 2 --nthreads 1"
            raise BadInput("executor", address, mend)
        with using(client.get_executor(pure=False)) as executor:
            yield executor
    finally:
        with suppress(OSError):
            client.close()


def mapped(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
    """Yield the results of a function of each item, in order, from the executor in use.

    In a worker, releases use one thread. Without an executor, items are computed one after another
    in this process.
    """
    executor = current()
    if executor is None:
        yield from map(function, items)
    else:
        yield from executor.map(_Worker(function), items)


class _Worker:
    """A function that runs in a worker; it can be pickled if the function can."""

    def __init__(self, function: Callable[[Any], Any]):
        self.function = function

    def __call__(self, item: Any) -> Any:
        """Return the result of the function, with one thread and without an executor."""
        global _remote
        before, _remote = _remote, True
        try:
            return self.function(item)
        finally:
            _remote = before
