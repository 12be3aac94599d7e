"""Trials in a separate process, so that one that hangs or crashes is only recorded."""

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
"""Time limit for loading or compiling the kernels in a process [s]."""

IDLE = 20.0
"""Time over the processor time limit after which an idle trial counts as hung [-], with allowance
for a busy machine."""


def limit_processor_time(seconds: float) -> None:
    """End this process, even within a kernel, after this processor time; 0 removes the limit.

    Processor time does not depend on other load. Windows has no such timer: there, only the waiting
    time of `Worker.run` ends a trial that hangs.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def serve(pipe: Connection, limit: float) -> None:
    """Run trials on request by name and step, because scenes cannot be pickled.

    A trial that takes more than `limit` [s of processor time] ends the process.
    """
    cases = {case.name: case for case in CASES}
    Simulation(Scene(Terrain(FLAT), (box(0.0, 0.5),))).step()  # compile or load first
    pipe.send(None)
    while True:
        name, dt = pipe.recv()
        limit_processor_time(limit)
        result = trial(cases[name], dt)
        limit_processor_time(0.0)
        pipe.send(result)


class Worker:
    """A process that runs trials and is replaced if it hangs or dies.

    Parameters
    ----------
    limit : float
        Processor time limit of a trial [s].
    target : callable
        Function that the process runs, with its end of the pipe and the limit.
    """

    def __init__(self, limit: float, target: Any = serve):
        self._limit, self._target = limit, target
        self._process: Any = None
        self._pipe: Any = None

    def run(self, name: str, dt: float) -> Result:
        """Return the result of a case at a step [s]."""
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
        """Return the result of a case at a step [s] as columns of a table, without these two."""
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
