"""Distribution of releases: in threads of this process by default, or in an executor.

Every executor of `concurrent.futures` will do. `connected("dask://HOST:PORT")` gives that of a Dask
scheduler (extra `dask`), whose workers may be on other machines. The outcome of a release depends
only on site, layout, seed and event, so that results do not depend on where they were computed. The
scheduler repeats the work of a worker that dies. If none is left, the computation waits for another
one and says so; it fails after `DESERTED` seconds.
"""

from __future__ import annotations

import os
import re
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from rigdda.errors import BadInput, Error

Item = TypeVar("Item")
Result = TypeVar("Result")

ADDRESS = re.compile(r"dask://(?P<host>[^:/]+):(?P<port>\d+)$")
"""Form of the address of a scheduler."""

PATIENCE = 10.0
"""Time after which a scheduler that does not answer counts as absent [s]."""

DESERTED = 600.0
"""Time without any worker after which a computation fails [s]."""

GLANCE = 5.0
"""Time without a result after which the workers of a scheduler are counted [s]."""

_executors: list[Executor] = []
"""Executors in use, the current one last."""

_remote = threading.local()
"""`on`: whether this thread works for an executor; its releases then use a single thread."""


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
    return 1 if getattr(_remote, "on", False) else os.cpu_count() or 1


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
    Error
        If the scheduler stops, or has no worker for `DESERTED` seconds.
    """
    found = ADDRESS.match(address)
    if not found:
        hint = "give the address of a Dask scheduler as dask://HOST:PORT"
        raise BadInput("executor", address, hint)
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise BadInput("executor", address, "install dask: pip install 'rigdda[dask]'") from None
    try:
        client = Client(f"tcp://{found['host']}:{found['port']}", timeout=PATIENCE)
    except OSError as error:
        hint = f"start the scheduler first: dask scheduler --port {found['port']} ({error})"
        raise BadInput("executor", address, hint) from None
    try:
        where = f"{found['host']}:{found['port']}"
        if not client.scheduler_info()["workers"]:
            raise BadInput("executor", address, f"start workers first: {_start(where)}")
        with using(_Scheduler(client, where)) as executor:
            yield executor
    finally:
        with suppress(OSError):
            client.close()


def _start(where: str) -> str:
    """Return the command that starts workers of the scheduler at HOST:PORT."""
    return f"dask worker {where} --nworkers 2 --nthreads 1"


class _Scheduler(Executor):
    """The workers of a Dask scheduler, which are watched while results are awaited.

    Parameters
    ----------
    client : distributed.Client
        The client.
    where : str
        Address of the scheduler, HOST:PORT.
    """

    def __init__(self, client: Any, where: str):
        self._client, self._where = client, where
        self._plain: Executor = client.get_executor(pure=False)
        self._deserted: float | None = None

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit a function as `concurrent.futures.Executor` does; its result is not watched."""
        return self._plain.submit(fn, *args, **kwargs)

    def map(
        self,
        fn: Callable[..., Any],
        *iterables: Any,
        timeout: float | None = None,
        chunksize: int = 1,
    ) -> Iterator[Any]:
        """Return the results of a function of each item, in order.

        Raises
        ------
        Error
            If the scheduler stops, or has no worker for `DESERTED` seconds.
        """
        end = None if timeout is None else time.monotonic() + timeout
        futures = deque(self._client.map(fn, *iterables, pure=False))

        def results() -> Iterator[Any]:
            try:
                while futures:
                    yield self._awaited(futures.popleft(), end)
            finally:
                with suppress(OSError):
                    self._client.cancel(list(futures))

        return results()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Release the resources of the executor; futures are cancelled unless it waits for them."""
        self._plain.shutdown(wait=wait and not cancel_futures)

    def _awaited(self, future: Any, end: float | None) -> Any:
        """Return the result of a future; `end` is the time at which to give up, if any [s]."""
        try:
            return self._followed(future, end)
        except CancelledError:
            raise Error(
                f"the scheduler tcp://{self._where} stopped: start it and its workers, and run the "
                "command again"
            ) from None

    def _followed(self, future: Any, end: float | None) -> Any:
        """Return the result of a future, and watch the workers until it is there."""
        while not future.done():
            left = GLANCE if end is None else min(GLANCE, end - time.monotonic())
            try:
                found = future.result(timeout=max(left, 0.0))
            except TimeoutError:
                if future.done():
                    break
                if end is not None and time.monotonic() >= end:
                    raise
                self._watch()
            else:
                self._returned()
                return found
        self._returned()
        return future.result()

    def _returned(self) -> None:
        """Tell once that a worker is back, if none was left."""
        if self._deserted is not None:
            self._deserted = None
            _tell(f"a worker is back on tcp://{self._where}: going on")

    def _watch(self) -> None:
        """Tell once if no worker is left, and when one is back; fail if that takes too long."""
        what = self._missing()
        if not what:
            self._returned()
            return
        hint = f"start one by {_start(self._where)}"
        if self._deserted is None:
            self._deserted = time.monotonic()
            _tell(
                f"{what} on tcp://{self._where}: waiting for one; {hint}, or stop with Ctrl+C "
                f"(gives up after {DESERTED / 60.0:.3g} min)"
            )
        elif time.monotonic() - self._deserted > DESERTED:
            raise Error(
                f"{what} on tcp://{self._where} for {DESERTED / 60.0:.3g} min: {hint}, and run the "
                "command again"
            )

    def _missing(self) -> str:
        """Return in words what is missing, nothing if there is a worker."""
        try:
            known = self._client.nthreads()
        except (OSError, TimeoutError):
            return "no scheduler answers"
        return "" if known else "no worker is left"


def _tell(words: str) -> None:
    """Print a line on standard error."""
    print(words, file=sys.stderr, flush=True)


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
        before, _remote.on = getattr(_remote, "on", False), True
        try:
            return self.function(item)
        finally:
            _remote.on = before
