"""Folder in which a long job keeps its results until its tables are written.

A job that was killed continues from this folder.
"""

from __future__ import annotations

import shutil
from pathlib import Path

UNFINISHED = ".unfinished"
"""Name of the folder in the results folder of the job."""


def remove_unfinished(out: Path) -> None:
    """Remove the folder of a job whose tables are written."""
    shutil.rmtree(out / UNFINISHED, ignore_errors=True)
