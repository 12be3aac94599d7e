"""Provenance of recorded results: a hash of the kernels, noted beside each table.

The hash is `rigdda.kernel.kernels_hash`.
"""

from __future__ import annotations

import csv
from pathlib import Path

KERNELS = "kernels.csv"
"""Table in a folder of results that records which kernels made the other tables."""


def made_by(folder: Path) -> dict[str, str]:
    """Return the hash of the kernels that made each table of a folder, where recorded."""
    path = folder / KERNELS
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {row["table"]: row["kernels"] for row in csv.DictReader(file)}
