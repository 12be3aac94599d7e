"""Provenance of recorded results: a hash of the kernels, noted beside each table.

Unlike the hash for cached machine code, `kernels_hash` does not change with comments, docstrings or
the module that contains a kernel.
"""

from __future__ import annotations

import ast
import csv
import hashlib
from functools import cache
from pathlib import Path

import numba

from rigdda.kernel import sources

DECORATORS = ("kernel", "inlined", "arithmetic_kernel", "stage", "entry_kernel")
"""Decorators of compiled functions."""

KERNELS = "kernels.csv"
"""Table in a folder of results that records which kernels made the other tables."""


def is_text(part: ast.AST) -> bool:
    """Return whether a statement is a docstring."""
    value = part.value if isinstance(part, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def is_kernel(part: ast.stmt) -> bool:
    """Return whether a statement is a compiled function."""
    if not isinstance(part, ast.FunctionDef):
        return False
    return any(isinstance(d, ast.Name) and d.id in DECORATORS for d in part.decorator_list)


def is_driver(part: ast.stmt) -> bool:
    """Return whether a statement is ordinary code, as in modules that only call kernels."""
    if isinstance(part, ast.FunctionDef):
        return not part.name.startswith("_")
    return isinstance(part, ast.ClassDef) and not part.bases


def statements(source: bytes) -> list[str]:
    """Return the syntax trees of the kernels, constants and array layouts of a module.

    Docstrings and comments are removed. A module that only calls kernels has none.
    """
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [part for part in body if not is_text(part)]  # type: ignore[attr-defined]
    kernels = [part for part in tree.body if is_kernel(part)]
    if not kernels and any(map(is_driver, tree.body)):
        return []
    data = ast.Assign | ast.AnnAssign | ast.ClassDef
    return [ast.dump(part) for part in tree.body if part in kernels or isinstance(part, data)]


@cache
def kernels_hash() -> str:
    """Return a hash of numba's version and of the code of kernels and their constants."""
    parts = [part for source in sources() for part in statements(source)]
    digest = hashlib.sha256(numba.__version__.encode())
    for part in sorted(parts):
        digest.update(part.encode())
    return digest.hexdigest()[:16]


def made_by(folder: Path) -> dict[str, str]:
    """Return the hash of the kernels that made each table of a folder, where recorded."""
    path = folder / KERNELS
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {row["table"]: row["kernels"] for row in csv.DictReader(file)}
