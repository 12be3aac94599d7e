"""Memory of what was simulated: the latest results of this process, shared by its threads."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Hashable, Iterable, Mapping
from threading import Lock
from typing import Generic, TypeVar

import msgspec

from rigdda import Site

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


def fingerprint(site: Site) -> bytes:
    """Return a key for a site: a hash of the whole of it as JSON, in which numbers are exact."""
    return hashlib.sha256(msgspec.json.encode(site)).digest()[:16]


class Memory(Generic[Key, Value]):
    """Values by key, the latest `room` of them.

    Parameters
    ----------
    room : int
        How many values are kept.
    """

    def __init__(self, room: int):
        self.room = room
        self._kept: OrderedDict[Key, Value] = OrderedDict()
        self._lock = Lock()

    def recall(self, keys: Iterable[Key]) -> dict[Key, Value]:
        """Return the known ones of some keys with their values."""
        known = {}
        with self._lock:
            for key in keys:
                if key in self._kept:
                    self._kept.move_to_end(key)
                    known[key] = self._kept[key]
        return known

    def remember(self, values: Mapping[Key, Value]) -> None:
        """Keep values by key and forget the oldest beyond `room`."""
        with self._lock:
            self._kept.update(values)
            while len(self._kept) > self.room:
                self._kept.popitem(last=False)
