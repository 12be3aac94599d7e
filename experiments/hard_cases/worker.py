"""Trials in a process of their own: one that hangs or crashes is a result, not the end."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterable, Iterator
from multiprocessing.connection import Connection
from typing import Any

from experiments.hard_cases.case import FAILS, Case, Result
from experiments.hard_cases.trial import trial
from rigdda import Scene, Simulation, Terrain
from rigdda.validation.scenes import FLAT, box

START = 600.0
"""Time within which a process must have loaded or compiled the kernels [s]."""

Trial = tuple[Case, float]


def serve(pipe: Connection, cases: dict[str, Case]) -> None:
    """Run trials as they are asked for, by name and step, until there is nothing more."""
    Simulation(Scene(Terrain(FLAT), (box(0.0, 0.5),))).step()  # compiled, or loaded, before times
    pipe.send(None)
    while (asked := pipe.recv()) is not None:
        name, dt = asked
        pipe.send(trial(cases[name], dt))


def serve_suite(pipe: Connection) -> None:
    """Serve the cases of the suite, which a new process imports: scenes cannot be sent."""
    from experiments.hard_cases.suite import CASES

    serve(pipe, {case.name: case for case in CASES})


class Worker:
    """A process that runs trials; it is replaced when it hangs or dies.

    Parameters
    ----------
    limit : float
        Time in which a trial must end [s].
    target : callable
        What the process runs, with its end of the pipe.
    """

    def __init__(self, limit: float, target: Any = serve_suite):
        self._limit, self._target = limit, target
        self._process: Any = None
        self._pipe: Any = None

    def run(self, name: str, dt: float) -> Result:
        """Return what came of a case at a step [s]."""
        if self._process is None:
            self._start()
        try:
            self._pipe.send((name, dt))
            if self._pipe.poll(self._limit):
                return self._pipe.recv()
            note = f"no end within {self._limit:g} s"
        except (EOFError, OSError):
            note = "the process died"
        self.stop()
        return Result(name, dt, FAILS, note=note)

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=self._target, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        if not self._pipe.poll(START):
            self.stop()
            raise TimeoutError(f"the kernels were not ready within {START:g} s")
        self._pipe.recv()

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = None


def sweep(trials: Iterable[Trial], limit: float) -> Iterator[Result]:
    """Yield the results of trials in their order, each ended after `limit` [s]."""
    worker = Worker(limit)
    try:
        for case, dt in trials:
            yield worker.run(case.name, dt)
    finally:
        worker.stop()
