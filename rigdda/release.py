"""Releases: a site with a layout, simulated for a seed."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from rigdda.barriers import Barrier
from rigdda.outcome import Outcome, measure, stations, watch
from rigdda.run import Run
from rigdda.simulation import Simulation
from rigdda.site import Site

EVERY = 0.05
"""Interval of the frames of a run [s]."""


def release(
    site: Site, layout: Sequence[Barrier] = (), seed: int = 0, progress: bool = False
) -> tuple[Run, Outcome]:
    """Simulate one release of the source with a layout in place.

    Returns
    -------
    run : Run
        Frames every 0.05 s.
    outcome : Outcome
        What it means for the road.

    Raises
    ------
    BadInput
        If the layout does not stand on the slope or the seed is unsound.
    Diverged
        If the simulation diverges.
    """
    run = _simulate(site, layout, seed, EVERY, progress)
    return run, measure(site, run)


def release_outcome(site: Site, layout: Sequence[Barrier] = (), seed: int = 0) -> Outcome:
    """Return the outcome that `release` gives, in less time: frames on the way are not kept."""
    return measure(site, _simulate(site, layout, seed, site.motion.duration))


def release_many(jobs: Sequence[tuple[Site, Sequence[Barrier], int]]) -> list[Outcome]:
    """Return the outcomes of many releases (site, layout, seed), over all cores in threads.

    Each outcome is the one that `release` gives. Raises as `release` does.
    """
    with ThreadPoolExecutor() as pool:
        return list(pool.map(lambda job: release_outcome(*job), jobs))


def _simulate(
    site: Site, layout: Sequence[Barrier], seed: int, every: float, progress: bool = False
) -> Run:
    scene = site.realise(layout, seed)
    lines = stations(site, scene.barriers)  # not of `layout`, which may be walked through once only
    simulation = Simulation(scene, site.settings(), lines, watch(site))
    return simulation.run(site.motion.duration, every, progress)
