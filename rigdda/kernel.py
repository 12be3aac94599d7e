"""Compilation of kernels, cached under the hash of all kernel sources.

numba's own cache looks only at the file of the function that is called: edit a constant or a
callee in another module and the cached caller keeps the old value. So the cache directory carries
a hash of every source that kernels are made of.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config


def sources() -> list[bytes]:
    """Return the sources that hold kernels or their constants."""
    found, data = [], ("constants.py", "records.py", "arrays.py")
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        source = path.read_bytes()
        if b"rigdda.kernel import" in source or path.name in data:
            found.append(source)
    return found


def source_hash() -> str:
    """Return a hash of numba's version and of all that kernels are made of."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sources():
        digest.update(source)
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Return the folder of compiled kernels, in the user's cache or else the temporary folder."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = home / "rigdda" / f"kernels-{source_hash()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"rigdda-{os.getuid()}" / folder.name
        folder.mkdir(parents=True, exist_ok=True)
    return folder


INSIDE = {
    "nogil": True,
    "error_model": "numpy",
    "_nrt": False,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""How kernels are compiled that only kernels call.

They allocate nothing, so `_nrt=False` leaves reference counting out: its atomic operations on every
array that a kernel passes on cost four fifths of a step. Without wrappers for calls from Python and
C compilation takes two thirds of the time; Python that calls such a kernel crashes, see
`from_python`."""


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel that other kernels call; without fast-math, so that NaN checks hold."""
    return numba.njit(**INSIDE)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a kernel into all that call it: for what is called for every block or contact.

    A call hands over every array of a named tuple in seven words to eleven, 63 for `Matrix`, but a
    record in one. A step of one block took twice as long when calls were handed all of `Work`.
    """
    return numba.njit(forceinline=True, **INSIDE)(function)


def arithmetic_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel in which a product and a sum may be one operation, rounded once.

    The only liberty: NaN and order stay as they are. The same results on one kind of machine.
    """
    return numba.njit(fastmath={"contract"}, **INSIDE)(function)


def stage(function: Callable[..., Any]) -> Any:
    """Compile a kernel as a part of the only one that calls it.

    numba optimises every kernel together with all that it calls; one level less saves seconds.
    """
    return numba.njit(inline="always", **INSIDE)(function)


def entry_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel that Python calls, and keep the machine code on disk."""
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())
    try:
        options = {**INSIDE, "no_cpython_wrapper": False, "cache": True}
        return numba.njit(**options)(function)
    finally:
        config.CACHE_DIR = before


class Direct:
    """An entry kernel that is called with arguments of always the same types.

    numba looks at the type of every array in every call, to choose among what it has compiled; for
    `step.advance` that takes ten times as long as the call itself. Here the first call chooses.

    Attributes
    ----------
    call : callable
        The kernel.
    """

    def __init__(self, entry: Any):
        self._entry = entry
        self.call: Callable[..., Any] = self._choose

    def _choose(self, *arguments: Any) -> Any:
        """Call the kernel for the first time, which compiles it."""
        result = self._entry(*arguments)
        for compiled in getattr(self._entry, "overloads", {}).values():  # none where JIT is off
            self.call = compiled.entry_point
        return result


def from_python(inner: Any) -> Any:
    """Compile a kernel once more, for Python to call: for tests."""
    return numba.njit(error_model="numpy", _nrt=False)(inner.py_func)
