"""What fidelity "fast" costs and gains on a site: its bias against "full" and its speed-up."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

import rigdda
from agents.seeds import release_seeds
from agents.tables import empty_table, write_rows
from envs import DesignProblem, fidelity
from envs.evaluation import CONFIDENCE, Interval, student_interval
from rigdda import Layout, Site
from rigdda.barriers import describe

if TYPE_CHECKING:
    from rich.table import Table

Floats = NDArray[np.float64]

FENCES = ((0.5, 0.5, 0.6), (-0.3, 0.5, 0.6))
"""Slots of the fences that are compared, none, the first and both: at three quarters and at a third
of the zone, of three quarters of the greatest height and, in the default limits, 2.3 MJ."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """One layout at both fidelities.

    Parameters
    ----------
    layout : tuple of Barrier
        What stood.
    full, fast : (releases,) array
        Debris fraction of every release [-].
    seconds_full, seconds_fast : float
        Processor time of a release, cutting its blocks left out [s].
    """

    layout: Layout
    full: Floats
    fast: Floats
    seconds_full: float
    seconds_fast: float

    @property
    def bias(self) -> float:
        """Mean debris fraction of "fast" less that of "full" [-]."""
        return float(self.fast.mean() - self.full.mean())

    @property
    def bias_ci(self) -> Interval:
        """95 % interval of the bias, by Welch's t."""
        n = len(self.full)
        parts = [float(sample.var(ddof=1)) / n for sample in (self.fast, self.full)]
        total = sum(parts)
        if total == 0.0:
            return self.bias, self.bias
        freedom = total**2 / sum(part**2 / (n - 1) for part in parts)
        half = float(stdtrit(freedom, 0.5 * (1.0 + CONFIDENCE))) * math.sqrt(total)
        return self.bias - half, self.bias + half

    @property
    def gain(self) -> float:
        """How many times less processor time "fast" takes."""
        return self.seconds_full / self.seconds_fast


def layouts(site: Site) -> tuple[Layout, ...]:
    """Return the layouts that are compared: nothing, one fence, two fences."""
    problem = DesignProblem(site, len(FENCES), ("fence",))
    slots = [np.concatenate([*FENCES[:n], *[(0.0, -1.0, 0.0)] * (2 - n)]) for n in range(3)]
    return tuple(problem.decode(vector) for vector in slots)


def calibrate(
    site: Site, releases: int, seed: int, tick: Callable[[int, str], None]
) -> list[Calibration]:
    """Simulate every layout at both fidelities, `releases` times each, over all cores.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    seeds = release_seeds("verification", seed, releases)
    out, done = [], 0
    rigdda.release_outcome(site, (), seeds[0])  # loads the kernels: no release is to pay for that
    for layout in layouts(site):
        found = {}
        for name in fidelity.FIDELITIES:
            tick(done, f"{name}: {_words(layout)}")
            found[name] = _sample(fidelity.at(site, name), layout, seeds)
            done += releases
        (fast, cheap), (full, dear) = found["fast"], found["full"]
        out.append(Calibration(layout, full, fast, dear, cheap))
    return out


def _sample(site: Site, layout: Layout, seeds: Sequence[int]) -> tuple[Floats, float]:
    """Return the debris fraction of every release and the mean processor time of one [s]."""

    def one(seed: int) -> tuple[float, float]:
        site.realise(layout, seed)  # cuts the blocks, as searches do once for many layouts
        before = time.thread_time()
        debris = rigdda.release_outcome(site, layout, seed).debris_fraction
        return debris, time.thread_time() - before

    with ThreadPoolExecutor() as pool:
        debris, seconds = np.array(list(pool.map(one, seeds))).T
    return debris, float(seconds.mean())


def write(path: Path, site: Site, found: Sequence[Calibration]) -> None:
    """Write a CSV file with one row a layout."""
    rows = []
    for c in found:
        row = {"site": site.name, "layout": _words(c.layout), "releases": len(c.full)}
        for name, sample in (("full", c.full), ("fast", c.fast)):
            low, high = student_interval(sample)
            row |= {f"debris_{name}": sample.mean(), f"{name}_low": low, f"{name}_high": high}
        low, high = c.bias_ci
        row |= {"bias": c.bias, "bias_low": low, "bias_high": high}
        row |= {"seconds_full": c.seconds_full, "seconds_fast": c.seconds_fast, "gain": c.gain}
        rows.append(row)
    write_rows(path, rows)


def table(found: Sequence[Calibration]) -> Table:
    """Return the table of a calibration, at most 80 characters wide."""
    out = empty_table(("layout", "full [%]", "fast [%]", "fast - full (95 %)", "CPU [ms]", "gain"))
    for c in found:
        low, high = (100.0 * value for value in c.bias_ci)
        out.add_row(
            ("no barrier", "one fence", "two fences")[len(c.layout)],
            f"{100 * c.full.mean():.1f}",
            f"{100 * c.fast.mean():.1f}",
            f"{100 * c.bias:+.1f} ({low:+.1f} to {high:+.1f})",
            f"{1e3 * c.seconds_full:.0f} / {1e3 * c.seconds_fast:.0f}",
            f"{c.gain:.1f}",
        )
    return out


def _words(layout: Layout) -> str:
    return "; ".join(describe(barrier) for barrier in layout) or "no barrier"
