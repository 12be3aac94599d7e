"""Compilation of kernels, cached under a hash of all kernel sources.

numba's own cache only checks the file of the compiled function: after an edit of a constant or a
callee in another module, the cached function keeps the old code. The cache directory is therefore
named by a hash of all sources of kernels. If the cache cannot be read or written, kernels are
compiled again.

Compilation is shortened by `rigdda.numba_internals`, which replaces internal parts of numba. If
numba does not have these parts as expected, or if the environment variable `RIGDDA_PLAIN_NUMBA` is
set, kernels are compiled by numba as it is. The results are the same, but compilation takes 2.5
times and simulations nine times as long, as arrays are counted.
"""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
from numba import config

from rigdda.errors import Error

PLAIN = "RIGDDA_PLAIN_NUMBA"
"""Environment variable with which kernels are compiled by numba as it is, if it is not empty."""


def _internals() -> ModuleType | None:
    """Return `rigdda.numba_internals`, None if numba has to be used as it is."""
    if os.environ.get(PLAIN):
        return None
    try:
        from rigdda import numba_internals

        other = numba_internals.unexpected()
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        other = [str(error)]
    if other:
        message = f"numba {numba.__version__} differs from the versions that rigdda was tested "
        message += f"with ({', '.join(other)}): compilation and simulations take longer"
        warnings.warn(message, RuntimeWarning, stacklevel=2)
        return None
    numba_internals.compare_quickly()
    return numba_internals


INTERNALS = _internals()
"""Replacements of internal parts of numba, None if numba is used as it is."""


def sources() -> list[bytes]:
    """Return the sources that contain kernels or their constants, or determine the cache."""
    found, data = [], ("constants.py", "records.py", "arrays.py", "numba_internals.py")
    here = Path(__file__).parent
    folders = (here / "dynamics", here / "model")
    for path in sorted([*here.glob("*.py"), *(p for f in folders for p in f.rglob("*.py"))]):
        source = path.read_bytes()
        if b"rigdda.kernel import" in source or path.name in data:
            found.append(source)
    return found


def source_hash() -> str:
    """Return a hash of numba's version and of all kernel sources, which names the cache.

    Stored results are not named by it but by `rigdda.MECHANICS`.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sources():
        digest.update(source)
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Return the folder of compiled kernels, in the user's cache or a temporary folder.

    Raises
    ------
    Error
        If none of these folders is writable.
    """
    name = f"{'plain' if INTERNALS is None else 'kernels'}-{source_hash()}"
    for find in (_cache_home, _temporary_home, _process_home):
        home = find()
        if home is not None and _is_writable(home / name):
            return home / name
    hint = "set XDG_CACHE_HOME or TMPDIR to a folder that can be written"
    raise Error(f"there is no place for compiled kernels: {hint}")


def _cache_home() -> Path | None:
    """Return the folder of this package in the user's cache, None without a home folder."""
    named = os.environ.get("XDG_CACHE_HOME")
    try:
        caches = Path(named) if named else Path.home() / ".cache"
    except RuntimeError:  # the user has no entry in the password database
        return None
    return caches / "rigdda"


def _temporary_home() -> Path | None:
    """Return a folder of this user in the temporary folder, None if it is not available."""
    user = os.getuid() if hasattr(os, "getuid") else None  # none on Windows
    try:
        own = Path(tempfile.gettempdir()) / ("rigdda" if user is None else f"rigdda-{user}")
        own.mkdir(mode=0o700, exist_ok=True)
        owner = own.lstat().st_uid
    except OSError:
        return None
    # numba executes the files that it reads, so a folder owned by another user must not be used
    return own if user is None or owner == user else None


@functools.cache
def _process_home() -> Path | None:
    """Return a temporary folder, the same throughout the process; None if it cannot be made."""
    try:
        return Path(tempfile.mkdtemp(prefix="rigdda-"))
    except OSError:
        return None


def _is_writable(folder: Path) -> bool:
    """Create a folder if necessary; return whether it and its subfolders are writable.

    Checking permissions is not sufficient: file systems may be read-only, and root ignores
    permissions.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for place in (folder, *(path for path in folder.iterdir() if path.is_dir())):
            tempfile.TemporaryFile(dir=place).close()
    except OSError:
        return False
    return True


INSIDE: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    **(INTERNALS.INSIDE if INTERNALS else {}),
}
"""Compiler options of kernels that are called by kernels only.

Calling such a kernel from Python crashes, see `from_python`.
"""

ENTRY: dict[str, Any] = {
    "error_model": "numpy",
    **(INTERNALS.ENTRY if INTERNALS else {"cache": True}),
}
"""Compiler options of kernels that are called by Python."""


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel for calls from other kernels, without fast-math so that NaN checks work."""
    return numba.njit(**INSIDE)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a kernel into all its callers; for kernels that run for every block or contact.

    A call passes every array of a named tuple in seven to eleven words, 63 for `Matrix`, but a
    record in one. A step of one block took twice as long when calls received all of `Work`.
    """
    return numba.njit(forceinline=True, **INSIDE)(function)


def arithmetic_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel in which a product and a sum may be fused, with a single rounding.

    No other fast-math transformation is enabled, so NaN checks and the order of operations are
    preserved. Results are reproducible on one type of machine.
    """
    return numba.njit(fastmath={"contract"}, forceinline=True, **INSIDE)(function)


def stage(function: Callable[..., Any]) -> Any:
    """Compile a kernel as part of its only caller.

    numba optimises every kernel together with all its callees; one level fewer saves seconds.
    """
    return numba.njit(inline="always", **INSIDE)(function)


def entry_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel for calls from Python, and store the machine code on disk."""
    return _kept(function, nogil=True)


def short_kernel(function: Callable[..., Any]) -> Any:
    """Compile an entry kernel that takes microseconds, too short to release the GIL."""
    return _kept(function, nogil=False)


def _kept(function: Callable[..., Any], nogil: bool) -> Any:
    if config.DISABLE_JIT:
        return function
    before, config.CACHE_DIR = config.CACHE_DIR, str(cache_directory())
    try:
        compiled = numba.njit(nogil=nogil, **ENTRY)(function)
        if INTERNALS is not None:
            compiled._cache = INTERNALS.KernelCache(function)  # there is no public way
    finally:
        config.CACHE_DIR = before
    return compiled


class Direct:
    """An entry kernel that is always called with arguments of the same types.

    numba inspects the types of all arrays in every call to select a compiled version; for
    `step.advance`, this takes ten times as long as the call itself. Here only the first call
    selects a version.

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
        self.call = self._entry
        for compiled in getattr(self._entry, "overloads", {}).values():  # none if JIT is disabled
            self.call = getattr(compiled, "entry_point", self._entry)
        return result


@numba.njit(inline="always", **INSIDE)
def variable(value: int) -> int:
    """Return an integer literal as the initial value of a variable.

    With a plain literal, numba would compile every callee that receives the variable twice: for the
    literal type and for integers.
    """
    return int(np.int64(value))


def from_python(inner: Any) -> Any:
    """Compile a kernel again for calls from Python, for tests."""
    counts = INTERNALS.WITHOUT_COUNTS if INTERNALS else {}
    return numba.njit(error_model="numpy", **counts)(inner.py_func)
