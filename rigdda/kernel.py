"""Compilation of kernels, cached under the hash of all kernel sources.

numba's own cache looks only at the file of the function that is called: edit a constant or a
callee in another module and the cached caller keeps the old value. So the cache directory carries
a hash of every source that kernels are made of. What cannot be written or read there costs the time
to compile again, and stops nothing.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import pickle
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import config
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.compiler import Flags
from numba.core.targetconfig import TargetConfig

from rigdda.errors import Error


def sources() -> list[bytes]:
    """Return the sources that hold kernels or their constants."""
    found, data = [], ("constants.py", "records.py", "arrays.py")
    here = Path(__file__).parent
    folders = (here / "dynamics", here / "model")
    for path in sorted([*here.glob("*.py"), *(p for f in folders for p in f.rglob("*.py"))]):
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
    """Return the folder of compiled kernels, in the user's cache or else the temporary folder.

    Raises
    ------
    Error
        If nothing can be written in either.
    """
    name = f"kernels-{source_hash()}"
    for find in (_cache_home, _temporary_home, _process_home):
        home = find()
        if home is not None and _is_writable(home / name):
            return home / name
    mend = "set XDG_CACHE_HOME or TMPDIR to a folder that can be written"
    raise Error(f"there is no place for compiled kernels: {mend}")


def _cache_home() -> Path | None:
    """Return the folder of this package in the user's caches, None without a home folder."""
    named = os.environ.get("XDG_CACHE_HOME")
    try:
        caches = Path(named) if named else Path.home() / ".cache"
    except RuntimeError:  # the user has no entry in the password database
        return None
    return caches / "rigdda"


def _temporary_home() -> Path | None:
    """Return a folder of this user in the temporary folder, None if it cannot be had."""
    user = os.getuid() if hasattr(os, "getuid") else None  # none on Windows
    try:
        own = Path(tempfile.gettempdir()) / ("rigdda" if user is None else f"rigdda-{user}")
        own.mkdir(mode=0o700, exist_ok=True)
        owner = own.lstat().st_uid
    except OSError:
        return None
    # numba runs what it reads, so a folder that another user has put there is not taken
    return own if user is None or owner == user else None


@functools.cache
def _process_home() -> Path | None:
    """Return a new temporary folder, the same throughout the process, None if none can be made."""
    try:
        return Path(tempfile.mkdtemp(prefix="rigdda-"))
    except OSError:
        return None


def _is_writable(folder: Path) -> bool:
    """Make a folder if it is not there; return whether files can be made in it and its folders.

    Permissions do not tell: file systems may be read-only, and root may write all the same.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for place in (folder, *(path for path in folder.iterdir() if path.is_dir())):
            tempfile.TemporaryFile(dir=place).close()
    except OSError:
        return False
    return True


class CheckedFile(IndexDataCacheFile):
    """Files of a cache whose machine code carries its hash.

    After a crash of the machine a file may be whole in length and partly zeros. Code from such a
    file would end the process, or compute nonsense.
    """

    def _save_data(self, name: str, data: Any) -> None:
        code = self._dump(data)
        super()._save_data(name, (hashlib.sha256(code).digest(), code))

    def _load_data(self, name: str) -> Any:
        digest, code = super()._load_data(name)
        if hashlib.sha256(code).digest() != digest:
            raise ValueError("the machine code is not what was written")
        return pickle.loads(code)


class KernelCache(FunctionCache):
    """numba's cache of a function, but for files that cannot be read or written.

    numba raises whatever unpickling them does. Here they are dropped and compiled again.
    """

    def __init__(self, function: Callable[..., Any]):
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = CheckedFile(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function of a signature, None if it is not there or not sound."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # of any kind: the bytes may be anything
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function; warn if that fails, as on a full disk."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            warnings.warn(f"compiled kernels are not kept: {error}", RuntimeWarning, stacklevel=2)


class _OptionValues:
    """Values of all options of compilations, those left at their defaults too, kept by what is set.

    For every operator and call in a kernel numba looks templates up in dictionaries whose keys hold
    the options of the compilation. Each comparison of two keys reads all three dozen options of
    both through properties, which adds up to a third of the time of compiling the kernels. Objects
    are kept with their values, so that an identity names one object for good.
    """

    def __init__(self) -> None:
        self._known: dict[Any, tuple[dict[str, Any], dict[str, Any]]] = {}

    def of(self, options: TargetConfig) -> dict[str, Any]:
        """Return the value of every option."""
        given = options._values
        key = (type(options), *sorted((name, id(value)) for name, value in given.items()))
        known = self._known.get(key)
        if known is None:
            known = self._known[key] = options.values(), dict(given)
        return known[0]


def _compare_quickly() -> None:
    """Compare options of compilations as numba does, in a tenth of the time."""
    values = _OptionValues()

    def equal(self: TargetConfig, other: object) -> bool:
        if not isinstance(other, TargetConfig):
            return NotImplemented
        one, two = values.of(self), values.of(other)
        return one is two or one == two

    def number(self: TargetConfig) -> int:
        return len(self.options)  # numba hashes the names of the options alone

    Flags.__eq__, Flags.__hash__ = equal, number


_compare_quickly()


INSIDE: dict[str, Any] = {
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
    return numba.njit(fastmath={"contract"}, forceinline=True, **INSIDE)(function)


def stage(function: Callable[..., Any]) -> Any:
    """Compile a kernel as a part of the only one that calls it.

    numba optimises every kernel together with all that it calls; one level less saves seconds.
    """
    return numba.njit(inline="always", **INSIDE)(function)


def entry_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel that Python calls, and keep the machine code on disk."""
    return _kept(function, nogil=True)


def short_kernel(function: Callable[..., Any]) -> Any:
    """Compile an entry kernel of microseconds: to let other threads run meanwhile takes longer."""
    return _kept(function, nogil=False)


def _kept(function: Callable[..., Any], nogil: bool) -> Any:
    compiled = numba.njit(**{**INSIDE, "no_cpython_wrapper": False, "nogil": nogil})(function)
    if config.DISABLE_JIT:
        return compiled
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())
    try:
        compiled._cache = KernelCache(function)  # numba has no other way to give it one
    finally:
        config.CACHE_DIR = before
    return compiled


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


@numba.njit(inline="always", **INSIDE)
def variable(value: int) -> int:
    """Return a number that is given as a literal, as the first value of a variable.

    With a literal numba compiles all that the variable is handed to twice: for the literal and for
    an integer.
    """
    return int(np.int64(value))


def from_python(inner: Any) -> Any:
    """Compile a kernel once more, for Python to call: for tests."""
    return numba.njit(error_model="numpy", _nrt=False)(inner.py_func)
