"""Persistent store of barrier-free statistics of sites.

Values are written to the cache of the user and also read from a file that ships with the package.
Both are used only if they were computed by the current sources, see `sources`.
"""

from __future__ import annotations

import hashlib
import lzma
from collections.abc import Mapping
from contextlib import suppress
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, TypeVar

import msgspec

import rigdda
from rigdda.files import atomic
from rigdda.kernel import cache_directory, source_hash

T = TypeVar("T")

SHIPPED = Path(__file__).parent / "site_store.msgpack.xz"
"""File that ships with the package, made by `python -m experiments.known_sites`."""


STATISTICS = ("cost", "design_envelope", "ensemble", "envelope", "intervals", "outcome_cache",
              "quantiles")  # fmt: skip
"""Modules of this package that compute the statistics."""

UNRELATED = ("agents", "envs", "replay", "sites", "validation", "corridor", "display",
             "drawing", "errors", "files", "limit_equilibrium", "lumped_mass",
             "rounding", "site_generator", "site_names", "survey")  # fmt: skip
"""Folders and modules of `rigdda` that do not affect the releases of a given site. Those that make
a site are among them, because values are stored by its content."""


@cache
def sources() -> str:
    """Return a hash of all sources that affect barrier-free statistics, and of numba's version."""
    digest = hashlib.sha256(source_hash().encode())
    here, whole = Path(__file__).parent, Path(rigdda.__file__).parent
    files = [here / f"{name}.py" for name in STATISTICS]
    for path in sorted({*whole.rglob("*.py")} - {whole / "__init__.py"}):
        if not {*path.relative_to(whole).with_suffix("").parts} & {*UNRELATED}:
            files.append(path)
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


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
    return cache_directory().parent / f"sites-{sources()}" / f"{name}-{key.hex()}.msgpack"


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
    return lzma.compress(msgspec.msgpack.encode(Content(sources(), raw)), preset=9)


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


@lru_cache(maxsize=1)
def _shipped() -> dict[str, msgspec.Raw]:
    """Return the values that ship with the package; empty if other sources computed them."""
    with suppress(OSError, ValueError):
        content = unpack(SHIPPED.read_bytes())
        if content.sources == sources():
            return content.values
    return {}
