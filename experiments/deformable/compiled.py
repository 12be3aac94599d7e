"""Compilation and caching of an entry kernel with parts here and in the core."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba import config

from rigdda.kernel import ENTRY, cache_directory


def entry(function: Callable[..., Any]) -> Any:
    """Compile a kernel for calls from Python, cached under the hash of both sets of sources."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    folder = cache_directory() / f"deformable-{digest.hexdigest()[:16]}"
    folder.mkdir(exist_ok=True)
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        return numba.njit(**{**ENTRY, "nogil": True, "cache": True})(function)
    finally:
        config.CACHE_DIR = before
