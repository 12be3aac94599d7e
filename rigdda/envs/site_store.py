"""Persistent store of barrier-free statistics of sites.

Values are written to the cache of the user and also read from a file that ships with the package.
Both are used only if they have the version of the mechanics (`rigdda.MECHANICS`) and the form
(`FORMAT`) of this program.
"""

from __future__ import annotations

import lzma
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from rigdda import MECHANICS
from rigdda.files import atomic
from rigdda.kernel import cache_directory

T = TypeVar("T")

SHIPPED = Path(__file__).parent / "site_store.msgpack.xz"
"""File that ships with the package, made by `python -m experiments.known_sites`."""


FORMAT = 3
"""Version of the form of stored values. Change it if a field of a stored class changes."""


class Content(msgspec.Struct, frozen=True):
    """Content of the file that ships with the package.

    Parameters
    ----------
    mechanics : str
        Version of the mechanics that computed the values.
    form : int
        Version of the form of the values.
    values : mapping of str to bytes
        Encoded values by name and key.
    """

    mechanics: str
    form: int
    values: dict[str, msgspec.Raw]

    @property
    def current(self) -> bool:
        """Whether the values are of the mechanics and the form of this program."""
        return (self.mechanics, self.form) == (MECHANICS, FORMAT)


_ignored = False


@contextmanager
def ignored() -> Iterator[None]:
    """Read nothing, so that values are computed again to be compared with the stored ones."""
    global _ignored
    _ignored = True
    try:
        yield
    finally:
        _ignored = False


def path_of(name: str, key: bytes) -> Path:
    """Return the file of a value in the cache of the user, next to the compiled kernels."""
    folder = f"sites-{MECHANICS}-{FORMAT}"
    return cache_directory().parent / folder / f"{name}-{key.hex()}.msgpack"


def read(name: str, key: bytes, kind: type[T]) -> T | None:
    """Return a stored value, or None if there is none or it cannot be decoded."""
    if _ignored:
        return None
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
    return lzma.compress(msgspec.msgpack.encode(Content(MECHANICS, FORMAT, raw)), preset=9)


def unpack(packed: bytes) -> Content:
    """Return the content of a file that ships with the package.

    Raises
    ------
    ValueError
        If the bytes are damaged.
    """
    try:
        return msgspec.msgpack.decode(lzma.decompress(packed), type=Content)
    except (lzma.LZMAError, EOFError, msgspec.MsgspecError) as error:
        raise ValueError(f"damaged statistics of sites ({error})") from None


def shipped() -> Content | None:
    """Return the content of the file that ships with the package, None if it is unreadable."""
    with suppress(OSError, ValueError):
        return unpack(SHIPPED.read_bytes())
    return None


@lru_cache(maxsize=1)
def _shipped() -> dict[str, msgspec.Raw]:
    """Return the values that ship with the package; empty if they are of another version."""
    return content.values if (content := shipped()) and content.current else {}
