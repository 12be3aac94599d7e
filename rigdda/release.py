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
    site: Site,
    layout: Sequence[Barrier] = (),
    seed: int = 0,
    event: str | None = None,
    progress: bool = False,
) -> tuple[Run, Outcome]:
    """Simulate one release of an event, or of one that the seed draws by rate, with a layout.

    Returns
    -------
    run : Run
        Frames every 0.05 s.
    outcome : Outcome
        What it means for the road.

    Raises
    ------
    BadInput
        If the layout does not stand on the slope, there is no such event or the seed is unsound.
    Diverged
        If the simulation diverges.
    """
    drawn = site.draw(seed, event)
    scene = site.scene(drawn, site.built(layout, drawn.width))
    lines = stations(site, scene.barriers)  # not of `layout`, which may be walked through once only
    simulation = Simulation(scene, site.settings(), lines, watch(site))
    run = simulation.run(site.motion.duration, EVERY, progress)
    return run, measure(site, run, drawn.event, drawn.width)


def release_outcome(
    site: Site, layout: Sequence[Barrier] = (), seed: int = 0, event: str | None = None
) -> Outcome:
    """Return the outcome that `release` gives."""
    return release(site, layout, seed, event)[1]


def release_many(
    jobs: Sequence[tuple[Site, Sequence[Barrier], int, str | None]],
) -> list[Outcome]:
    """Return the outcomes of many releases (site, layout, seed, event), over all cores in threads.

    Each outcome is the one that `release` gives. Raises as `release` does.
    """
    with ThreadPoolExecutor() as pool:
        return list(pool.map(lambda job: release_outcome(*job), jobs))
