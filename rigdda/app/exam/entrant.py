"""The process of an entry: it imports the entry and gives it one task after the other."""

from __future__ import annotations

import importlib
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from threading import Lock
from typing import Any

import msgspec
import numpy as np

from rigdda import BadInput
from rigdda.agents.designers import catalogue
from rigdda.app.exam import guard
from rigdda.app.exam.messages import (
    AnyReply,
    FailRequest,
    FlagRequest,
    Request,
    SubmitRequest,
    TaskOrder,
    decode_reply,
    encode,
)
from rigdda.app.exam.task import CorridorTask, Task, make_task
from rigdda.barriers import as_layout, to_tables
from rigdda.envs.outcome_cache import fingerprint
from rigdda.envs.problem import is_vector

Entry = Callable[[Any], Any]
"""Function that receives a task and returns a layout, or one for each section of a corridor."""


class PipeLine:
    """Connection to the scorer through a pipe."""

    def __init__(self, pipe: Connection):
        self._pipe, self._lock = pipe, Lock()

    def ask(self, request: Request) -> AnyReply:
        """Send a request and return the reply."""
        with self._lock:
            self._pipe.send_bytes(encode(request))
            return decode_reply(self._pipe.recv_bytes())

    def tell(self, message: msgspec.Struct) -> None:
        """Send a message that has no reply."""
        self._pipe.send_bytes(encode(message))

    def order(self) -> TaskOrder | None:
        """Return the next task, or None if there is none."""
        message = self._pipe.recv_bytes()
        return msgspec.msgpack.decode(message, type=TaskOrder) if message else None


def load(name: str) -> Entry:
    """Return the function that is named by "package.module:function".

    Raises
    ------
    BadInput
        If the name has another form, or there is no such function.
    """
    module, _, function = name.partition(":")
    if not module or not function:
        raise BadInput("--entry", name, "give package.module:function")
    try:
        found = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        mend = f"name a function that can be imported from this folder ({error})"
        raise BadInput("--entry", name, mend) from None
    if not callable(found):
        raise BadInput("--entry", name, "name a function that receives a task")
    return found


def run(pipe: Connection, entry: str, corridor_entry: str, secrets: tuple[str, ...]) -> None:
    """Work on tasks until the scorer sends none; the target of the process.

    Parameters
    ----------
    pipe : Connection
        Connection to the scorer.
    entry, corridor_entry : str
        Names of the functions. If the second is empty, corridors are designed section by section
        with the same money for every metre of road.
    secrets : tuple of str
        Files and folders that the entry must not open.
    """
    line, at = PipeLine(pipe), ""
    sys.stdout = sys.stderr  # tables of the command are on standard output
    sys.path.insert(0, os.getcwd())
    guard.install(lambda reason: line.tell(FlagRequest(reason)), secrets)
    try:
        function = load(entry)
        other = load(corridor_entry) if corridor_entry else equal_shares(function)
        while (order := line.order()) is not None:
            at = f"on {order.name}: "
            line.tell(_submission(order, line, function, other))
    except BadInput as bad:
        line.tell(FailRequest(at + (bad.mend if bad.field == "--entry" else str(bad))))
    except BaseException as error:
        print_own_frames(error)
        line.tell(FailRequest(f"{at}{type(error).__name__}: {error}"))


def print_own_frames(error: BaseException) -> None:
    """Print an error with the frames of the entry, without those of its import and of the exam."""
    told = traceback.TracebackException.from_exception(error)
    own = [f for f in told.stack if f.filename != __file__ and not f.filename.startswith("<frozen")]
    told.stack = traceback.StackSummary.from_list(own)
    print("".join(told.format()), end="", file=sys.stderr)


def _submission(
    order: TaskOrder, line: PipeLine, entry: Entry, corridor_entry: Entry
) -> SubmitRequest:
    """Let the entry work on a task and return what it submits."""
    task = make_task(order, line)
    if isinstance(task, CorridorTask):
        sections: Sequence[Task] = task.sections
        _ask_scorer(sections)
        found = corridor_entry(task)
    else:
        sections = (task,)
        _ask_scorer(sections)
        found = (entry(task),)
    try:
        layouts = [_tables(own, layout) for own, layout in zip(sections, found, strict=True)]
    except (BadInput, TypeError, ValueError) as error:
        return SubmitRequest(task.used, [], str(error))
    return SubmitRequest(task.used, layouts)


def _tables(task: Task, layout: Any) -> list[dict[str, Any]]:
    """Return the tables of a layout or vector, which need not be feasible."""
    vector = isinstance(layout, np.ndarray) or is_vector(layout)
    return to_tables(task.problem.decode(layout) if vector else as_layout(layout))


def _ask_scorer(sections: Sequence[Task]) -> None:
    """Let the designers of the package ask the scorer for their releases without barriers."""
    tasks = {own.problem.key: own for own in sections}

    def ask(site: Any, seeds: Any, stations: Any) -> catalogue.CrossingEnsemble:
        return tasks[fingerprint(site)].crossings(seeds, stations)

    catalogue.ensemble = ask


def equal_shares(entry: Entry) -> Entry:
    """Return an entry for corridors that spends the same money on every metre of road."""

    def shared(task: CorridorTask) -> list[Any]:
        most = task.money / float(task.lengths.sum())
        releases = task.budget // len(task.sections)
        return [entry(own.within(most, releases)) for own in task.sections]

    return shared
