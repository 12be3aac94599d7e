"""Barrier-free envelope of a site: passage rates, energies, bounce heights and the deposit."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import Run, Simulation, Site, distribution
from rigdda.envs import site_store
from rigdda.envs.outcome_cache import Memory, fingerprint
from rigdda.geometry import polygon_properties
from rigdda.seeds import OBSERVATIONS

Floats = NDArray[np.float64]

ZONE_STATIONS = 16
"""Number of stations across the barrier zone."""

DEPOSIT_BINS = 8
"""Number of equal bins from the start of the zone to the downhill edge of the road in which the
deposit is counted. There is one more bin uphill of the zone and one beyond the road."""

QUANTILE = 0.95
"""Quantile of the energies and bounce heights of passing blocks that the envelope gives; the usual
basis for the design of barriers."""

EVENT_CLASSES = ("single blocks", "groups")
"""Classes of events: blocks that fall alone, and blocks that interact with each other."""

BLOCKS_PER_EVENT, LEAST_RELEASES = 16, 2
"""Number of blocks simulated for each event, and minimum number of its releases."""

Job = tuple[Site, tuple[()], int, str]
"""A release without barriers: site, layout, seed, event."""


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """Passage statistics and deposit over releases of every event of a site.

    Parameters
    ----------
    often : (2, ZONE_STATIONS) array
        Rate at which releases pass each station [1/year per 100 m], for each of `EVENT_CLASSES`.
    energy : (2, ZONE_STATIONS) array
        95 % quantile of the kinetic energy of the blocks that pass a station [J]; 0 if none does.
    bounce : (2, ZONE_STATIONS) array
        95 % quantile of the height of their centroids above the ground [m].
    deposit : (DEPOSIT_BINS + 2,) array
        Share of the cross-sectional area of the rock released per year that comes to rest uphill of
        the zone, in each bin from the start of the zone to the downhill edge of the road, and
        beyond; adds up to 1.
    """

    often: Floats
    energy: Floats
    bounce: Floats
    deposit: Floats


class Transit(NamedTuple):
    """Passages and deposit of one release.

    `energy` [J] and `bounce` [m] hold one array per station, with one entry per block at its first
    passage; `deposit` is (DEPOSIT_BINS + 2,) [m2].
    """

    energy: list[Floats]
    bounce: list[Floats]
    deposit: Floats


class StoredEnvelope(NamedTuple):
    """An envelope as stored on disk, with lists instead of arrays."""

    often: list[list[float]]
    energy: list[list[float]]
    bounce: list[list[float]]
    deposit: list[float]

    @classmethod
    def of(cls, found: Envelope) -> StoredEnvelope:
        """Return the stored form of an envelope."""
        parts = (found.often, found.energy, found.bounce, found.deposit)
        return cls(*(part.tolist() for part in parts))

    @property
    def envelope(self) -> Envelope:
        """The envelope, restored exactly."""
        arrays = [np.array(values) for values in self]
        for array in arrays:
            array.setflags(write=False)
        return Envelope(*arrays)


STORED_AS = "envelope"
"""Name under which envelopes are stored on disk; see `rigdda.envs.site_store`."""

memory: Memory[bytes, Envelope] = Memory(8192)
"""Envelopes by site, about 3 kB each."""


def stations(site: Site) -> Floats:
    """Return the chainages of the stations, (ZONE_STATIONS,) [m]."""
    return np.linspace(site.barrier_zone.start, site.barrier_zone.end, ZONE_STATIONS)


def largest(site: Site, event: str) -> int:
    """Return the maximum number of blocks of an event; for a jointed mass, the nominal number."""
    found = site.event(event)
    source = site.source(found.source)
    if source.band is not None:
        return found.number[1]
    return max(1, round(source.area / source.mean_block_area))


def envelope(site: Site) -> Envelope:
    """Return the barrier-free envelope of a site, simulating it if it is not stored.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    return barrier_free([site])[0]


def barrier_free(sites: Sequence[Site]) -> list[Envelope]:
    """Return the barrier-free envelopes of sites, simulating those that are not stored together.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    keys = [fingerprint(site) for site in sites]
    known = memory.recall(keys)
    for key in {*keys} - known.keys():
        stored = site_store.read(STORED_AS, key, StoredEnvelope)
        if stored is not None:
            known[key] = stored.envelope
            memory.remember({key: known[key]})
    new = {key: site for key, site in zip(keys, sites, strict=True) if key not in known}
    jobs = {key: _jobs(site) for key, site in new.items()}
    with ThreadPoolExecutor(distribution.threads()) as pool:
        transits = pool.map(_transit, [job for own in jobs.values() for job in own])
        fresh = {
            key: _summary(new[key], own, list(islice(transits, len(own))))
            for key, own in jobs.items()
        }
    for key, found in fresh.items():
        site_store.write(STORED_AS, key, StoredEnvelope.of(found))
    memory.remember(fresh)
    known |= fresh
    return [known[key] for key in keys]


def _jobs(site: Site) -> list[Job]:
    """Return the releases for the envelope of a site; fewer for events with many blocks."""
    counts = {
        name: max(LEAST_RELEASES, BLOCKS_PER_EVENT // largest(site, name))
        for name in site.event_names
    }
    return [
        (site, (), OBSERVATIONS + i, name) for name, count in counts.items() for i in range(count)
    ]


def _transit(job: Job) -> Transit:
    """Simulate a release and return its passages and deposit."""
    site, layout, seed, event = job
    lines = stations(site).tolist()
    scene = site.realise(layout, seed, event)
    simulation = Simulation(scene, site.settings(scene), lines)
    run = simulation.run(site.motion.duration, site.motion.duration)
    passing = [run.crossings(i) for i in range(ZONE_STATIONS)]
    energy, bounce = ([p[name] for p in passing] for name in ("energy", "height"))
    return Transit(energy, bounce, _deposit(site, run))


def _summary(site: Site, jobs: Sequence[Job], transits: Sequence[Transit]) -> Envelope:
    """Return the envelope from the transits of the releases of a site."""
    names = [event for *_, event in jobs]
    rates = {name: site.rate(name, ()) for name in site.event_names}
    weights = np.array([100.0 * rates[name] / names.count(name) for name in names])
    groups = np.array([largest(site, name) > 1 for name in names])
    often, energy, bounce = np.zeros((3, 2, ZONE_STATIONS))
    out = Envelope(often, energy, bounce, np.zeros(DEPOSIT_BINS + 2))
    for kind, mine in enumerate((~groups, groups)):
        own = [(transits[i], float(weights[i])) for i in np.flatnonzero(mine).tolist()]
        for k in range(ZONE_STATIONS):
            out.often[kind, k] = sum(weight for transit, weight in own if len(transit.energy[k]))
            for name in ("energy", "bounce"):
                values = [getattr(transit, name)[k] for transit, _ in own]
                getattr(out, name)[kind, k] = _quantile(values, [weight for _, weight in own])
    out.deposit[:] = weights @ np.array([transit.deposit for transit in transits])
    out.deposit[:] /= max(out.deposit.sum(), 1e-300)
    for array in (out.often, out.energy, out.bounce, out.deposit):
        array.setflags(write=False)
    return out


def _quantile(parts: Sequence[Floats], weights: Sequence[float]) -> float:
    """Return the weighted `QUANTILE` of all values, each with the weight of its part.

    It is 0 if there are no values.
    """
    if not any(map(len, parts)):
        return 0.0
    values = np.concatenate(parts)
    weight = np.repeat(weights, [len(part) for part in parts])
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, QUANTILE * share[-1])])


def _deposit(site: Site, run: Run) -> Floats:
    """Return the final block area in each bin, (DEPOSIT_BINS + 2,) [m2]; see `Envelope`."""
    edges = np.linspace(site.barrier_zone.start, site.road.end, DEPOSIT_BINS + 1)
    part = np.searchsorted(edges, run.poses[-1, :, 0])
    area = [polygon_properties(block.vertices)[0] for block in run.scene.blocks]
    return np.bincount(part, area, DEPOSIT_BINS + 2).astype(np.float64)
