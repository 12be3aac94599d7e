"""What comes down a site without barriers: energies, bounce heights and the deposit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import msgspec
import numpy as np
import shapely
from numpy.typing import NDArray

import rigdda
from envs.baseline import fingerprint
from rigdda import Run, Site

Floats = NDArray[np.float64]

STATIONS = 16
"""Stations across the barrier zone; 1 to 5 m apart, near the size of a wall."""

BINS = 16
"""Parts of the profile in which the deposit is counted, and one more beyond the road."""

QUANTILE = 0.95
"""Share of passing blocks below the envelope, the usual basis of a barrier's size."""

SEEDS = range(2**32, 2**32 + 4)
"""Releases behind an envelope. Environments score releases of seeds below 2**31 only."""


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """Barrier-free transit of a site, over the releases of `SEEDS`.

    Parameters
    ----------
    energy : (STATIONS,) array
        95 % kinetic energy of the blocks that pass a station [J], 0 where none does.
    bounce : (STATIONS,) array
        95 % height of their centroids above the ground [m].
    deposit : (BINS + 1,) array
        Share of the released mass at the end in equal parts of the profile from the crest to the
        road's downhill edge, and beyond it; adds up to 1.
    """

    energy: Floats
    bounce: Floats
    deposit: Floats


def stations(site: Site) -> Floats:
    """Return the chainages at which blocks are watched, (STATIONS,) [m]."""
    return np.linspace(site.barrier_zone.start, site.barrier_zone.end, STATIONS)


def envelope(site: Site) -> Envelope:
    """Return the barrier-free envelope of a site; simulated once a process and site.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    return _envelope(fingerprint(site))


@lru_cache(maxsize=64)
def _envelope(text: bytes) -> Envelope:
    site = msgspec.json.decode(text, type=Site)
    lines = stations(site)
    runs = rigdda.simulate_many(
        [site.realise((), seed) for seed in SEEDS],
        site.settings(),
        site.motion.duration,
        stations=lines.tolist(),
    )
    passing = [np.concatenate([run.crossings(i) for run in runs]) for i in range(STATIONS)]
    out = Envelope(
        energy=np.array([_quantile(p["energy"]) for p in passing]),
        bounce=np.array([_quantile(p["height"]) for p in passing]),
        deposit=np.mean([_deposit(site, run) for run in runs], axis=0),
    )
    for array in (out.energy, out.bounce, out.deposit):
        array.setflags(write=False)
    return out


def _quantile(values: Floats) -> float:
    return float(np.quantile(values, QUANTILE)) if values.size else 0.0


def _deposit(site: Site, run: Run) -> Floats:
    """Return the share of a run's mass in each part of the profile and beyond, (BINS + 1,)."""
    edges = np.linspace(site.slope.points[0][0], site.road.end, BINS + 1)
    part = np.searchsorted(edges[1:], run.poses[-1, :, 0])
    mass = [block.density * shapely.Polygon(block.vertices).area for block in run.scene.blocks]
    weight = np.bincount(part, mass, BINS + 1)
    return weight / weight.sum()
