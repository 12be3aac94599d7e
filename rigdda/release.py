"""Releases: a site with a layout, simulated for a seed."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from rigdda.barriers import Barrier
from rigdda.outcome import Outcome, measure, stations, watch
from rigdda.run import Run
from rigdda.simulation import Simulation
from rigdda.site import Site


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
    scene = site.realise(layout, seed)
    simulation = Simulation(scene, site.settings(), stations(site, layout), watch(site))
    run = simulation.run(site.motion.duration, progress=progress)
    return run, measure(site, run)


def release_many(jobs: Sequence[tuple[Site, Sequence[Barrier], int]]) -> list[Outcome]:
    """Return the outcomes of many releases (site, layout, seed), over all cores in threads.

    Each outcome is the one that `release` gives. Raises as `release` does.
    """
    with ThreadPoolExecutor() as pool:
        return list(pool.map(lambda job: release(*job)[1], jobs))
