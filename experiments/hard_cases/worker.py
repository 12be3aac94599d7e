"""Trials in a process of their own: one that hangs or crashes is a result, not the end."""

from __future__ import annotations

import multiprocessing
import signal
from dataclasses import asdict
from multiprocessing.connection import Connection
from typing import Any

from experiments.hard_cases.case import FAILS, Result
from experiments.hard_cases.suite import CASES
from experiments.hard_cases.trial import trial
from rigdda import Scene, Simulation, Terrain
from rigdda.validation.scenes import FLAT, box

START = 1800.0
"""Time within which a process must have loaded or compiled the kernels [s]."""

IDLE = 20.0
"""Time over processor time after which a trial counts as hung although it does not compute [-]:
more than a busy machine makes of it."""


def limit_processor_time(seconds: float) -> None:
    """End this process, even within a kernel, when it has computed for so long; 0 lifts the limit.

    Other load on the machine does not change processor time. Windows has no timer of it: there
    only the time that `Worker.run` waits ends a trial that hangs.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def serve(pipe: Connection, limit: float) -> None:
    """Run trials as they are asked for, by name and step; scenes cannot be sent.

    A trial that computes for longer than `limit` [s of processor time] ends the process.
    """
    cases = {case.name: case for case in CASES}
    Simulation(Scene(Terrain(FLAT), (box(0.0, 0.5),))).step()  # compiled, or loaded, before times
    pipe.send(None)
    while True:
        name, dt = pipe.recv()
        limit_processor_time(limit)
        result = trial(cases[name], dt)
        limit_processor_time(0.0)
        pipe.send(result)


class Worker:
    """A process that runs trials; it is replaced when it hangs or dies.

    Parameters
    ----------
    limit : float
        Processor time in which a trial must end [s].
    target : callable
        What the process runs, with its end of the pipe and the limit.
    """

    def __init__(self, limit: float, target: Any = serve):
        self._limit, self._target = limit, target
        self._process: Any = None
        self._pipe: Any = None

    def run(self, name: str, dt: float) -> Result:
        """Return what came of a case at a step [s]."""
        if self._process is None:
            self._start()
        try:
            self._pipe.send((name, dt))
            if self._pipe.poll(IDLE * self._limit):
                return self._pipe.recv()
            note = f"no end within {IDLE * self._limit:g} s"
        except (EOFError, OSError):
            self._process.join()
            code = self._process.exitcode
            late = hasattr(signal, "SIGPROF") and code == -signal.SIGPROF
            note = f"no end within {self._limit:g} s" if late else f"the process died: {code}"
        self.stop()
        return Result(name, dt, FAILS, note=note)

    def measure(self, case: str, dt: float) -> dict[str, Any]:
        """Return what came of a case at a step [s], but for these two, as columns of a table."""
        found = asdict(self.run(case, dt))
        return {name: found[name] for name in found if name not in ("case", "dt")}

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=self._target, args=(theirs, self._limit), daemon=True
        )
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
