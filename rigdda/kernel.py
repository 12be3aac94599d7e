"""Compilation of kernels, cached under a hash of all kernel sources.

numba's own cache only checks the file of the compiled function: after an edit of a constant or a
callee in another module, the cached function keeps the old code. The cache directory is therefore
named by a hash of all sources of kernels. If the cache cannot be read or written, kernels are
compiled again.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import gc
import hashlib
import os
import pickle
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import config
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.targetconfig import TargetConfig

from rigdda.errors import Error

DECORATORS = ("kernel", "inlined", "arithmetic_kernel", "stage", "entry_kernel")
"""Decorators of compiled functions."""


def sources() -> list[bytes]:
    """Return the sources that contain kernels or their constants."""
    found, data = [], ("constants.py", "records.py", "arrays.py")
    here = Path(__file__).parent
    folders = (here / "dynamics", here / "model")
    for path in sorted([*here.glob("*.py"), *(p for f in folders for p in f.rglob("*.py"))]):
        source = path.read_bytes()
        if b"rigdda.kernel import" in source or path.name in data:
            found.append(source)
    return found


def source_hash() -> str:
    """Return a hash of numba's version and of all kernel sources."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sources():
        digest.update(source)
    return digest.hexdigest()[:16]


def _is_text(part: ast.AST) -> bool:
    """Return whether a statement is a docstring."""
    value = part.value if isinstance(part, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def _is_kernel(part: ast.stmt) -> bool:
    """Return whether a statement is a compiled function."""
    if not isinstance(part, ast.FunctionDef):
        return False
    return any(isinstance(d, ast.Name) and d.id in DECORATORS for d in part.decorator_list)


def _is_driver(part: ast.stmt) -> bool:
    """Return whether a statement is ordinary code, as in modules that only call kernels."""
    if isinstance(part, ast.FunctionDef):
        return not part.name.startswith("_")
    return isinstance(part, ast.ClassDef) and not part.bases


def kernel_statements(source: bytes) -> list[str]:
    """Return the code of the kernels, constants and array layouts of a module.

    Docstrings and comments are removed, and the layout is uniform. A module that only calls kernels
    has none.
    """
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [part for part in body if not _is_text(part)]  # type: ignore[attr-defined]
    kernels = [part for part in tree.body if _is_kernel(part)]
    if not kernels and any(map(_is_driver, tree.body)):
        return []
    data = ast.Assign | ast.AnnAssign | ast.ClassDef
    return [ast.unparse(part) for part in tree.body if part in kernels or isinstance(part, data)]


@functools.cache
def kernels_hash() -> str:
    """Return a hash of numba's version and of the code of kernels and their constants.

    Unlike `source_hash`, it does not change with comments, docstrings or the module that contains a
    kernel. It tells whether results were computed by the same mechanics.
    """
    parts = [part for source in sources() for part in kernel_statements(source)]
    digest = hashlib.sha256(numba.__version__.encode())
    for part in sorted(parts):
        digest.update(part.encode())
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Return the folder of compiled kernels, in the user's cache or a temporary folder.

    Raises
    ------
    Error
        If none of these folders is writable.
    """
    name = f"kernels-{source_hash()}"
    for find in (_cache_home, _temporary_home, _process_home):
        home = find()
        if home is not None and _is_writable(home / name):
            return home / name
    mend = "set XDG_CACHE_HOME or TMPDIR to a folder that can be written"
    raise Error(f"there is no place for compiled kernels: {mend}")


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


class CheckedFile(IndexDataCacheFile):
    """Cache files whose machine code carries its hash.

    After a crash of the machine, a file may have its full length but contain zeros. Machine code
    from such a file would crash the process or compute wrong results.
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
    """numba's function cache, except that unreadable or unwritable files are tolerated.

    numba raises any error from unpickling such files. Here they are deleted and compiled again.
    """

    def __init__(self, function: Callable[..., Any]):
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = CheckedFile(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function of a signature, None if it is missing or damaged."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # damaged files may raise any exception
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a compiled function; warn if that fails, for example on a full disk."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            warnings.warn(f"compiled kernels are not kept: {error}", RuntimeWarning, stacklevel=2)


class _OptionValues:
    """Cache of the values of all compilation options, including defaults.

    For every operator and call in a kernel, numba looks up templates in dictionaries whose keys
    contain the compilation options. Each comparison of two keys reads about 36 options of both
    through properties, which adds up to a third of the compilation time of the kernels. The objects
    are stored with their values, so that their identities remain unique.
    """

    def __init__(self) -> None:
        self._known: dict[Any, tuple[dict[str, Any], dict[str, Any]]] = {}

    def of(self, options: TargetConfig) -> dict[str, Any]:
        """Return the value of every option."""
        given = options._values
        key = (type(options), tuple(given), tuple(map(id, given.values())))
        known = self._known.get(key)
        if known is None:
            known = self._known[key] = options.values(), dict(given)
        return known[0]


def _compare_quickly() -> None:
    """Replace numba's comparison of compilation options by an equivalent one, ten times faster."""
    values = _OptionValues()

    def equal(self: TargetConfig, other: object) -> bool:
        if not isinstance(other, TargetConfig):
            return NotImplemented
        one, two = values.of(self), values.of(other)
        return one is two or one == two

    def number(self: TargetConfig) -> int:
        return len(self.options)  # numba only hashes the names of the options

    Flags.__eq__, Flags.__hash__ = equal, number


_compare_quickly()


class LinkedLibrary(JITCodeLibrary):
    """Library of a kernel that only kernels call: intermediate code, to be linked into callers.

    numba optimises each kernel together with all its callees and generates machine code for it,
    although only the machine code of entry kernels is executed. Here the optimisation of whole
    modules and the machine code are left to the entry kernels, which saves a sixth of the
    compilation time. The results are the same to the last bit.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, the address of a function without machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> LinkedLibrary:
        """Return the object on which numba calls `set_env`, which is this library."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Ignore the environment, which machine code needs to raise exceptions."""


class LinkedCompiler(Compiler):
    """Compiler of kernels that only kernels call."""

    def define_pipelines(self) -> list[Any]:
        """Compile into a `LinkedLibrary`."""
        codegen = self.state.targetctx.codegen()
        self.state.library = LinkedLibrary(codegen, self.state.func_id.func_qualname)
        return super().define_pipelines()


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """Pause the collection of cyclic garbage, which takes a fifteenth of a compilation."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


class EntryCompiler(Compiler):
    """Compiler of kernels that Python calls, together with all kernels that they call."""

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        """Compile a function."""
        with _without_collection():
            return super().compile_extra(function)


INSIDE: dict[str, Any] = {
    "pipeline_class": LinkedCompiler,
    "nogil": True,
    "error_model": "numpy",
    "_nrt": False,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""Compiler options of kernels that are called by kernels only.

Kernels allocate nothing, so reference counting is disabled by `_nrt=False`; its atomic operations
on every array argument would take four fifths of a step. Compilation without wrappers for calls
from Python and C takes two thirds of the time. Calling such a kernel from Python crashes, see
`from_python`.
"""


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
    options = {"pipeline_class": EntryCompiler, "no_cpython_wrapper": False, "nogil": nogil}
    compiled = numba.njit(**{**INSIDE, **options})(function)
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
        for compiled in getattr(self._entry, "overloads", {}).values():  # none if JIT is disabled
            self.call = compiled.entry_point
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
    return numba.njit(error_model="numpy", _nrt=False)(inner.py_func)
