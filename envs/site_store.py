"""What is known of sites without barriers, kept on disk.

In the user's cache, where it is written, and in a file that ships with the package. Both are read
only if the sources that decide it are those of today.
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
"""The file of the package; `python -m experiments.known_sites` makes it."""


class Content(msgspec.Struct, frozen=True):
    """What the file of the package holds.

    Parameters
    ----------
    sources : str
        Hash of the sources that decided it.
    values : mapping of str to bytes
        By name and key.
    """

    sources: str
    values: dict[str, msgspec.Raw]


def path_of(name: str, key: bytes) -> Path:
    """Return the file of a value in the user's cache, beside the compiled kernels."""
    return cache_directory().parent / f"sites-{mechanics()}" / f"{name}-{key.hex()}.msgpack"


def read(name: str, key: bytes, kind: type[T]) -> T | None:
    """Return a value that is kept, None if there is none or it is no longer sound."""
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
    """Keep a value in the user's cache; a disk that is full costs time later, no result now."""
    path = path_of(name, key)
    with suppress(OSError), atomic(path) as part:
        part.write_bytes(msgspec.msgpack.encode(value))


def pack(values: Mapping[str, Any]) -> bytes:
    """Return the content of the file of the package, of values by name and key."""
    raw = {key: msgspec.Raw(msgspec.msgpack.encode(value)) for key, value in values.items()}
    return lzma.compress(msgspec.msgpack.encode(Content(mechanics(), raw)), preset=9)


@lru_cache(maxsize=1)
def _shipped() -> dict[str, msgspec.Raw]:
    """Return what ships with the package, nothing if other sources made it."""
    now = mechanics()
    with suppress(OSError, lzma.LZMAError, msgspec.MsgspecError):
        content = msgspec.msgpack.decode(lzma.decompress(SHIPPED.read_bytes()), type=Content)
        if content.sources == now:
            return content.values
    return {}
