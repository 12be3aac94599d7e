"""Detection of entries that simulate behind the counter or read what they must not know.

The guard replaces the constructors and methods through which every simulation of this package runs,
and listens to the audit events of the interpreter (PEP 578), which cannot be switched off. It is no
sandbox: an entry that calls compiled kernels itself, carries a copy of the mechanics or attacks
other processes is not detected. The processor time of the entry, which is recorded, shows the first
two.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rigdda import BadInput, Simulation
from rigdda.dynamics.single_block import SingleBlock

Report = Callable[[str], None]
"""Called with the reason when an entry breaks a rule."""

SIMULATED = "simulated releases itself ({name}) instead of asking Task.evaluate"
READ = "read the recorded references or results of the exam ({path})"
STARTED = "started another process ({event})"

PROCESSES = (
    "os.fork", "os.forkpty", "os.system", "os.exec", "os.posix_spawn", "os.spawn",
    "subprocess.Popen",
)  # fmt: skip
"""Audit events of new processes."""

HARMLESS = ("uname", "ldconfig", "gcc", "cc", "c++", "g++", "fc-list", "lscpu")
"""Programs that packages start when they are imported."""


def install(report: Report, secrets: tuple[str, ...]) -> None:
    """Watch this process until it ends.

    Parameters
    ----------
    report : callable
        Called once or several times for each rule that is broken.
    secrets : tuple of str
        Files, and folders with files, that the entry must not open.
    """
    _watch(Simulation, "__init__", "Simulation", report)
    _watch(SingleBlock, "run", "rigdda.release", report)
    hidden = tuple(os.path.realpath(path) for path in secrets)

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path = _secret(arguments[0], hidden)
            if path:
                report(READ.format(path=path))
                raise BadInput("path", path, "the exam does not let entries read it")
        elif event in PROCESSES and not _harmless(arguments):
            report(STARTED.format(event=event))
        elif event == "import" and str(arguments[0]).startswith("multiprocessing.popen_"):
            report(STARTED.format(event="multiprocessing"))

    sys.addaudithook(audit)


def _watch(kind: type, method: str, name: str, report: Report) -> None:
    """Report and refuse every call of a method."""

    def refuse(self: Any, *arguments: Any, **keywords: Any) -> None:
        report(SIMULATED.format(name=name))
        raise BadInput("simulation", name, "simulate with Task.evaluate, which counts releases")

    setattr(kind, method, refuse)


def _secret(path: Any, hidden: tuple[str, ...]) -> str:
    """Return the name of a file that must not be opened, or an empty text."""
    if not isinstance(path, str | bytes | os.PathLike):
        return ""
    real = os.path.realpath(os.fsdecode(path))
    return Path(real).name if any(real == h or real.startswith(h + os.sep) for h in hidden) else ""


def _harmless(arguments: tuple[Any, ...]) -> bool:
    """Return whether a new process is one of `HARMLESS`."""
    first = arguments[0] if arguments else ""
    if isinstance(first, bytes | os.PathLike):
        first = os.fsdecode(first)
    return isinstance(first, str) and Path(first.split(" ")[0]).name in HARMLESS
