"""Which kernels made a recorded result: a hash of what they compute, and the note beside a table.

Unlike the hash under which compiled kernels are kept, that of `kernels_hash` does not change with a
comment or a docstring, nor with the module that a kernel is in.
"""

from __future__ import annotations

import ast
import csv
import hashlib
from functools import cache
from pathlib import Path

import numba

from rigdda.kernel import sources

KERNELS = "kernels.csv"
"""Table of a folder of results that says which kernels made the others."""


def is_text(part: ast.AST) -> bool:
    """Return whether a statement is a docstring."""
    value = part.value if isinstance(part, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)


def statements(source: bytes) -> list[str]:
    """Return the statements of a module as trees, without imports, docstrings and comments."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [part for part in body if not is_text(part)]  # type: ignore[attr-defined]
    imports = ast.Import | ast.ImportFrom
    return [ast.dump(part) for part in tree.body if not isinstance(part, imports)]


@cache
def kernels_hash() -> str:
    """Return a hash of numba's version and of what kernels and their constants compute."""
    parts = [part for source in sources() for part in statements(source)]
    digest = hashlib.sha256(numba.__version__.encode())
    for part in sorted(parts):
        digest.update(part.encode())
    return digest.hexdigest()[:16]


def made_by(folder: Path) -> dict[str, str]:
    """Return the hash of the kernels that made each table of a folder, as far as it is known."""
    path = folder / KERNELS
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        return {row["table"]: row["kernels"] for row in csv.DictReader(file)}
