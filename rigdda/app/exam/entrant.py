"""The process of an entry: it imports the entry and gives it one task after the other."""

from __future__ import annotations

import importlib
import os
import sys
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from threading import Lock
from typing import Any

import msgspec
import numpy as np

from rigdda import BadInput, Simulation, lumped_mass
from rigdda.app.exam.messages import (
    BatchReply,
    CrossingsReply,
    FailRequest,
    FlagRequest,
    Message,
    Option,
    ReadyRequest,
    RefusedReply,
    ReleaseRequest,
    SubmitRequest,
    TaskOrder,
    decode_reply,
    encode,
)
from rigdda.app.exam.task import CorridorTask, Task, count_crossings, make_task
from rigdda.barriers import as_layout, to_tables
from rigdda.dynamics.single_block import SingleBlock
from rigdda.envs.problem import is_vector

Entry = Callable[[Any], Any]
"""Function that receives a task and returns a layout, or one for each section of a corridor."""

SITE_ENTRY: Option = "--entry"
CORRIDOR_ENTRY: Option = "--corridor-entry"

SIMULATED = "simulated releases itself ({name}) instead of asking Task.evaluate"
"""Reason for a flag."""


class PipeLine:
    """Connection to the scorer through a pipe."""

    def __init__(self, pipe: Connection):
        self._pipe, self._lock = pipe, Lock()

    def ask(self, request: ReleaseRequest) -> BatchReply | CrossingsReply:
        """Send a request for releases and return the reply.

        Raises
        ------
        BadInput
            If the scorer refuses the request.
        """
        with self._lock:
            self._pipe.send_bytes(encode(request))
            reply = decode_reply(self._pipe.recv_bytes())
        if isinstance(reply, RefusedReply):
            raise BadInput(reply.field, reply.value, reply.hint)
        return reply

    def tell(self, message: Message) -> None:
        """Send a message that has no reply."""
        self._pipe.send_bytes(encode(message))

    def order(self) -> TaskOrder | None:
        """Return the next task, or None if there is none."""
        message = self._pipe.recv_bytes()
        return msgspec.msgpack.decode(message, type=TaskOrder) if message else None


def refuse_simulations(line: PipeLine) -> None:
    """Make the simulations of this package report and refuse their use in this process.

    This prevents an entry from simulating uncounted releases by mistake. It does not prevent an
    entry from doing so on purpose.
    """
    for owner, attribute, name in (
        (Simulation, "__init__", "Simulation"),
        (SingleBlock, "run", "rigdda.release"),
        (lumped_mass, "trajectories", "rigdda.lumped"),
    ):

        def refuse(*_: Any, name: str = name, **__: Any) -> None:
            line.tell(FlagRequest(SIMULATED.format(name=name)))
            raise BadInput("simulation", name, "simulate with Task.evaluate, which counts releases")

        setattr(owner, attribute, refuse)


def load(option: Option, name: str) -> Entry:
    """Return the function that is named by "package.module:function" in an option.

    Raises
    ------
    BadInput
        If the name has another form, or there is no such function.
    """
    module, _, function = name.partition(":")
    if not module or not function:
        raise BadInput(option, name, "give package.module:function")
    try:
        found = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        hint = f"name a function that can be imported from this folder ({error})"
        raise BadInput(option, name, hint) from None
    if not callable(found):
        raise BadInput(option, name, "name a function that receives a task")
    return found


def run(pipe: Connection, entry: str, corridor_entry: str) -> None:
    """Import the entry, report it and work on tasks until the scorer sends none.

    This is the target of the process.

    Parameters
    ----------
    pipe : Connection
        Connection to the scorer.
    entry, corridor_entry : str
        Names of the functions. If the second is empty, corridors are designed section by section
        with the same money for every metre of road.
    """
    line, option, at = PipeLine(pipe), SITE_ENTRY, "correct its module: "
    sys.stdout = sys.stderr  # tables of the command are on standard output
    sys.path.insert(0, os.getcwd())
    refuse_simulations(line)
    try:
        function = other = load(option, entry)
        if corridor_entry:
            option = CORRIDOR_ENTRY
            other = load(option, corridor_entry)
        else:
            other = equal_shares(function)
        line.tell(ReadyRequest())
        while (order := line.order()) is not None:
            option, at = option_of(order, corridor_entry), f"on {order.name}: "
            line.tell(_submission(order, line, function, other))
    except BadInput as bad:
        words = bad.hint if bad.field == option else at + str(bad)
        line.tell(FailRequest(option, words))
    except BaseException as error:
        print_own_frames(error)
        line.tell(FailRequest(option, f"{at}{type(error).__name__}: {error}"))


def option_of(order: TaskOrder, corridor_entry: str) -> Option:
    """Return the option that names the function for a task."""
    return CORRIDOR_ENTRY if corridor_entry and order.money is not None else SITE_ENTRY


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
    sections = task.sections if isinstance(task, CorridorTask) else (task,)
    count_crossings(sections)
    found = corridor_entry(task) if isinstance(task, CorridorTask) else (entry(task),)
    try:
        layouts = [_tables(own, layout) for own, layout in zip(sections, found, strict=True)]
    except (BadInput, TypeError, ValueError) as error:
        return SubmitRequest([], str(error))
    return SubmitRequest(layouts)


def _tables(task: Task, layout: Any) -> list[dict[str, Any]]:
    """Return the tables of a layout or vector, which need not be feasible."""
    vector = isinstance(layout, np.ndarray) or is_vector(layout)
    return to_tables(task.problem.decode(layout) if vector else as_layout(layout))


def equal_shares(entry: Entry) -> Entry:
    """Return an entry for corridors that spends the same money on every metre of road."""

    def shared(task: CorridorTask) -> list[Any]:
        most = task.money / float(task.lengths.sum())
        releases = task.budget // len(task.sections)
        return [entry(own.within(most, releases)) for own in task.sections]

    return shared
