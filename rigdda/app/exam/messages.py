"""Messages between the process of an entry and the scorer, in MessagePack.

Nothing that an entry sends is unpickled: messages are checked against the types below.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec
import numpy as np

from rigdda.agents.designers.catalogue import CROSSING, CrossingEnsemble
from rigdda.agents.designers.store import StoredEvaluation

Tables = list[dict[str, Any]]
"""A layout as the tables of a layout file."""

Seeds = list[int] | dict[str, list[int]]
"""Release seeds that are distributed over the events, or those of each event."""


class Message(msgspec.Struct, frozen=True, tag=True):
    """A message of either side."""


class ReleaseRequest(Message, frozen=True):
    """Simulate releases of a section with a layout.

    Parameters
    ----------
    section : int
        Index of the section.
    layout : list of dict
        The layout, as the tables of a layout file.
    seeds : list of int, or dict of str to list of int
        Release seeds. A list gives the evaluation only; a dict also gives the releases of each
        event.
    stations : list of float, optional
        If given, the layout is ignored, and the reply contains the blocks that cross these stations
        [m] in releases without barriers.
    """

    section: int
    layout: Tables
    seeds: Seeds
    stations: list[float] | None = None

    @property
    def releases(self) -> int:
        """Number of releases."""
        own = self.seeds
        return sum(map(len, own.values())) if isinstance(own, dict) else len(own)


class SubmitRequest(Message, frozen=True):
    """Submit one layout for each section; `wrong` says why there are none."""

    layouts: list[Tables]
    wrong: str = ""


class FlagRequest(Message, frozen=True):
    """Report that the entry broke a rule."""

    reason: str


class ReadyRequest(Message, frozen=True):
    """Report that the functions are imported, and ask for the first task."""


Option = Literal["--entry", "--corridor-entry"]
"""Option that names a function."""


class FailRequest(Message, frozen=True):
    """Report that the function of an option raised an error or cannot be imported."""

    option: Option
    error: str


AnyRequest = ReleaseRequest | SubmitRequest | FlagRequest | ReadyRequest | FailRequest


class BatchReply(Message, frozen=True):
    """Evaluated releases, without their outcomes."""

    batch: StoredEvaluation


class CrossingsReply(Message, frozen=True):
    """Crossings of stations: the arrays of a `CrossingEnsemble`."""

    crossings: bytes
    event: list[int]
    width: list[float]

    @classmethod
    def of(cls, found: CrossingEnsemble) -> CrossingsReply:
        """Return the message with an ensemble."""
        table = np.ascontiguousarray(found.crossings).tobytes()
        return cls(table, found.event.tolist(), found.width.tolist())

    def ensemble(self, stations: list[float]) -> CrossingEnsemble:
        """Return the ensemble of a message."""
        table = np.frombuffer(self.crossings, dtype=CROSSING)
        event = np.array(self.event, dtype=np.int64)
        return CrossingEnsemble(np.array(stations), table, event, np.array(self.width))


class RefusedReply(Message, frozen=True):
    """A refused request: the field, its value and what to do, as in `rigdda.BadInput`."""

    field: str
    value: str
    hint: str


AnyReply = BatchReply | CrossingsReply | RefusedReply


class TaskOrder(Message, frozen=True):
    """A site or a corridor that an entry is to work on.

    Parameters
    ----------
    name : str
        Name of the site or corridor.
    sites : list of str
        Sites of the sections; one for a task on a single site.
    lengths : list of float
        Lengths of the sections [m].
    money : float or None
        Budget for construction of a corridor [EUR]; None for a task on a single site.
    max_barriers : int
        Largest number of barriers of a layout.
    budget : int
        Releases per section.
    seed : int
        Seed of the task.
    """

    name: str
    sites: list[str]
    lengths: list[float]
    money: float | None
    max_barriers: int
    budget: int
    seed: int


encode = msgspec.msgpack.encode


def decode_request(message: bytes) -> AnyRequest:
    """Return a request from its bytes; `msgspec.MsgspecError` if they are none."""
    return msgspec.msgpack.decode(message, type=AnyRequest)


def decode_reply(message: bytes) -> AnyReply:
    """Return a reply from its bytes."""
    return msgspec.msgpack.decode(message, type=AnyReply)
