"""Outcomes on disk, one file per sample, from which an interrupted study is resumed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigdda import MECHANICS
from rigdda.files import atomic

Outcomes = tuple[NDArray[np.float64], float]
"""Outcomes of the releases of a sample, (R, 3), and processor time per release [s]."""


def kept(folder: Path, name: str, what: object, compute: Callable[[], Outcomes]) -> Outcomes:
    """Return the stored result with this name, or else compute and store it.

    A stored result is valid only for the same version of the mechanics and the same `repr` of
    `what`.
    """
    digest = hashlib.sha256(repr((MECHANICS, what)).encode()).hexdigest()[:12]
    path = folder / f"{name}-{digest}.npz"
    if path.exists():
        with np.load(path) as found:
            return found["outcomes"], float(found["cpu"])
    outcomes, cpu = compute()
    with atomic(path) as part, part.open("wb") as file:
        np.savez(file, outcomes=outcomes, cpu=cpu)
    return outcomes, cpu
