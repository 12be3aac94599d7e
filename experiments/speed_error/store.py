"""Outcomes on disk, a file for each sample: a study that was stopped goes on where it was."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigdda.envs.outcome_cache import mechanics
from rigdda.files import atomic

Outcomes = tuple[NDArray[np.float64], float]
"""Outcomes of the releases of a sample, (R, 3), and processor time a release [s]."""


def kept(folder: Path, name: str, what: object, compute: Callable[[], Outcomes]) -> Outcomes:
    """Return what is in `folder` under this name, else what `compute` returns, which is put there.

    Found again only by the same sources of the mechanics and by the same `what`, told by its repr.
    """
    digest = hashlib.sha256(repr((mechanics(), what)).encode()).hexdigest()[:12]
    path = folder / f"{name}-{digest}.npz"
    if path.exists():
        with np.load(path) as found:
            return found["outcomes"], float(found["cpu"])
    outcomes, cpu = compute()
    with atomic(path) as part, part.open("wb") as file:
        np.savez(file, outcomes=outcomes, cpu=cpu)
    return outcomes, cpu
