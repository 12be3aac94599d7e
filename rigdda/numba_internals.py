"""Replacements of internal parts of numba that shorten compilation, and make its cache robust.

numba may change these parts in any version. `rigdda.kernel` therefore imports this module only if
`unexpected` finds nothing, and compiles with numba as it is otherwise.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import inspect
import pickle
import warnings
from collections.abc import Callable, Iterator
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.options import DefaultOptions
from numba.core.targetconfig import TargetConfig

METHODS: dict[type, dict[str, tuple[str, ...]]] = {
    TargetConfig: {"__eq__": ("other",), "__hash__": (), "values": ()},
    Compiler: {"define_pipelines": (), "compile_extra": ("func",)},
    JITCodeLibrary: {
        "__init__": ("codegen", "name"),
        "_ensure_finalized": (),
        "_finalize_dynamic_globals": (),
        "_finalize_final_module": (),
        "_optimize_final_module": (),
        "_verify_declare_only_symbols": (),
        "get_pointer_to_function": ("name",),
    },
    IndexDataCacheFile: {
        "__init__": ("cache_path", "filename_base", "source_stamp"),
        "_dump": ("obj",),
        "_load_data": ("name",),
        "_save_data": ("name", "data"),
    },
    FunctionCache: {
        "__init__": ("py_func",),
        "flush": (),
        "load_overload": ("sig", "target_context"),
        "save_overload": ("sig", "data"),
    },
}
"""Methods that are replaced or called here, with the names of their parameters after `self`."""

ATTRIBUTES: dict[type, tuple[str, ...]] = {
    DefaultOptions: ("_nrt", "no_cfunc_wrapper", "no_cpython_wrapper"),
    Flags: ("options",),
    JITCodeLibrary: ("_finalized", "codegen"),
}
"""Attributes of classes that are used here."""

ASSIGNED: dict[type, tuple[str, ...]] = {
    FunctionCache: ("_cache_file", "_cache_path", "_impl"),
    TargetConfig: ("_values",),
}
"""Attributes that the constructors of classes assign and that are used here."""


def unexpected() -> list[str]:
    """Return the names of the parts of numba that are missing or have another signature."""
    found = []
    for owner, methods in METHODS.items():
        for name, expected in methods.items():
            method = getattr(owner, name, None)
            if method is None or tuple(inspect.signature(method).parameters)[1:] != expected:
                found.append(f"{owner.__name__}.{name}")
    for owner, names in ATTRIBUTES.items():
        found += [f"{owner.__name__}.{name}" for name in names if not hasattr(owner, name)]
    for owner, names in ASSIGNED.items():
        # the code names what it assigns; an instance would need a function and a folder
        known = owner.__init__.__code__.co_names  # type: ignore[misc]
        found += [f"{owner.__name__}.{name}" for name in names if name not in known]
    return found


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


def compare_quickly() -> None:
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


WITHOUT_COUNTS: dict[str, Any] = {"_nrt": False}
"""Compiler option that disables reference counting.

Kernels allocate nothing. The atomic operations on every array argument would take four fifths of a
step.
"""

INSIDE: dict[str, Any] = {
    **WITHOUT_COUNTS,
    "pipeline_class": LinkedCompiler,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""Compiler options of kernels that are called by kernels only.

Compilation without wrappers for calls from Python and C takes two thirds of the time.
"""

ENTRY: dict[str, Any] = {
    **WITHOUT_COUNTS,
    "pipeline_class": EntryCompiler,
    "no_cfunc_wrapper": True,
}
"""Compiler options of kernels that are called by Python."""
