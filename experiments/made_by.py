"""Provenance of recorded results: the version of the mechanics, noted beside each table."""

from __future__ import annotations

import csv
from pathlib import Path

MADE_BY = "mechanics.csv"
"""Table in a folder of results that records which mechanics made the other tables."""


def made_by(folder: Path) -> dict[str, str]:
    """Return `rigdda.MECHANICS` of each table of a folder when it was made, where recorded."""
    path = folder / MADE_BY
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {row["table"]: row["mechanics"] for row in csv.DictReader(file)}
