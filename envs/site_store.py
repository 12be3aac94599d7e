"""Persistent store of barrier-free statistics of sites.

Values are written to the cache of the user and also read from a file that ships with the package.
Both are used only if they were computed by the current sources.
"""

from __future__ import annotations

import lzma
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from rigdda.envs.outcome_cache import mechanics
from rigdda.files import atomic
from rigdda.kernel import cache_directory

T = TypeVar("T")

SHIPPED = Path(__file__).parent / "site_store.msgpack.xz"
"""File that ships with the package, made by `python -m experiments.known_sites`."""


class Content(msgspec.Struct, frozen=True):
    """Content of the file that ships with the package.

    Parameters
    ----------
    sources : str
        Hash of the sources that computed the values.
    values : mapping of str to bytes
        Encoded values by name and key.
    """

    sources: str
    values: dict[str, msgspec.Raw]


def path_of(name: str, key: bytes) -> Path:
    """Return the file of a value in the cache of the user, next to the compiled kernels."""
    return cache_directory().parent / f"sites-{mechanics()}" / f"{name}-{key.hex()}.msgpack"


def read(name: str, key: bytes, kind: type[T]) -> T | None:
    """Return a stored value, or None if there is none or it cannot be decoded."""
    found: bytes | msgspec.Raw | None = None
    path = path_of(name, key)
    with suppress(OSError):
        found = path.read_bytes()
    for kept in (found, _shipped().get(f"{name}-{key.hex()}")):
        if kept is not None:
            with suppress(msgspec.MsgspecError):
                return msgspec.msgpack.decode(kept, type=kind)
    return None


def write(name: str, key: bytes, value: Any) -> None:
    """Store a value in the cache of the user; errors such as a full disk are ignored."""
    path = path_of(name, key)
    with suppress(OSError), atomic(path) as part:
        part.write_bytes(msgspec.msgpack.encode(value))


def pack(values: Mapping[str, Any]) -> bytes:
    """Return the content of the file that ships with the package, from values by name and key."""
    raw = {key: msgspec.Raw(msgspec.msgpack.encode(value)) for key, value in values.items()}
    return lzma.compress(msgspec.msgpack.encode(Content(mechanics(), raw)), preset=9)


@lru_cache(maxsize=1)
def _shipped() -> dict[str, msgspec.Raw]:
    """Return the values that ship with the package; empty if other sources computed them."""
    now = mechanics()
    with suppress(OSError, lzma.LZMAError, msgspec.MsgspecError):
        content = msgspec.msgpack.decode(lzma.decompress(SHIPPED.read_bytes()), type=Content)
        if content.sources == now:
            return content.values
    return {}
