"""Messages between the process of an entry and the scorer, in MessagePack.

Nothing that an entry sends is unpickled: messages are checked against the types below.
"""

from __future__ import annotations

from typing import Any

import msgspec

from rigdda.agents.designers.store import StoredEvaluation

Tables = list[dict[str, Any]]
"""A layout as the tables of a layout file."""


class Request(msgspec.Struct, frozen=True, tag=True):
    """A request of an entry; `used` is the number of releases that it counted itself."""

    section: int
    used: int


class EvaluateRequest(Request, frozen=True):
    """Evaluate a layout on release seeds that are distributed over the events."""

    layout: Tables
    seeds: list[int]


class SampleRequest(Request, frozen=True):
    """Simulate release seeds of chosen events with a layout."""

    layout: Tables
    seeds: dict[str, list[int]]


class CrossingsRequest(Request, frozen=True):
    """Simulate releases without barriers and record the blocks that cross stations [m]."""

    seeds: dict[str, list[int]]
    stations: list[float]


class SubmitRequest(msgspec.Struct, frozen=True, tag=True):
    """Submit one layout for each section; `wrong` says why there are none."""

    used: int
    layouts: list[Tables]
    wrong: str = ""


class FlagRequest(msgspec.Struct, frozen=True, tag=True):
    """Report that the entry broke a rule."""

    reason: str


class FailRequest(msgspec.Struct, frozen=True, tag=True):
    """Report that the entry raised an error."""

    error: str


AnyRequest = (
    EvaluateRequest | SampleRequest | CrossingsRequest | SubmitRequest | FlagRequest | FailRequest
)


class BatchReply(msgspec.Struct, frozen=True, tag=True):
    """Evaluated releases, without the layout, the seeds and the outcomes."""

    batch: StoredEvaluation


class CrossingsReply(msgspec.Struct, frozen=True, tag=True):
    """Crossings of stations: the bytes of the arrays of a `CrossingEnsemble`."""

    crossings: bytes
    event: list[int]
    width: list[float]


class RefusedReply(msgspec.Struct, frozen=True, tag=True):
    """A refused request: the field, its value and what to do, as in `rigdda.BadInput`."""

    field: str
    value: str
    mend: str


AnyReply = BatchReply | CrossingsReply | RefusedReply


class TaskOrder(msgspec.Struct, frozen=True, tag=True):
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


def encode(message: msgspec.Struct) -> bytes:
    """Return a message as bytes."""
    return msgspec.msgpack.encode(message)


def decode_request(message: bytes) -> AnyRequest:
    """Return a request from its bytes.

    Raises
    ------
    msgspec.MsgspecError
        If the bytes are no request.
    """
    return msgspec.msgpack.decode(message, type=AnyRequest)


def decode_reply(message: bytes) -> AnyReply:
    """Return a reply from its bytes."""
    return msgspec.msgpack.decode(message, type=AnyReply)
