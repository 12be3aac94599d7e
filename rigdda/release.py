"""Releases: a site with a layout, simulated for a seed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from rigdda.barriers import Barrier, Layout, as_layout
from rigdda.batch import EVERY, Batch, Job, as_site, outcomes, simulation
from rigdda.dynamics.run import Run
from rigdda.errors import Error
from rigdda.model.site import Site
from rigdda.results.outcome import Outcome, measure


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
        Frames every 0.05 s; it ends when nothing moves any more but what goes on beyond the road.
    outcome : Outcome
        What it means for the road.

    Raises
    ------
    BadInput
        If the layout does not stand on the slope, there is no such event or the seed is unsound.
    Diverged
        If the simulation diverges.
    """
    drawn = as_site(site).draw(seed, event)
    scene = site.scene(drawn, site.built(layout, drawn.width))
    run = simulation(site, scene).run(site.motion.duration, EVERY, progress)
    return run, measure(site, run, drawn.event, drawn.width)


def release_outcome(
    site: Site, layout: Sequence[Barrier] = (), seed: int = 0, event: str | None = None
) -> Outcome:
    """Return the outcome that `release` gives, in less time: frames on the way are not kept."""
    return Batch(site, layout).outcome(seed, event)


def release_many(jobs: Sequence[Job], threads: int | None = None) -> list[Outcome]:
    """Return the outcomes of many releases (site, layout, seed, event), in threads.

    Each outcome is the one that `release` gives. Releases of a site with a layout share what does
    not depend on the seed.

    Parameters
    ----------
    jobs : sequence of (Site, sequence of Barrier, int, str or None)
        Releases.
    threads : int, optional
        How many; by default one for each core.

    Raises
    ------
    BadInput, Diverged
        As `release` does, for the first job that fails.
    """
    each = [(site, as_layout(layout), seed, event) for site, layout, seed, event in jobs]
    if threads is None:
        threads = os.cpu_count() or 1
    groups: dict[tuple[int, Layout], list[int]] = {}
    for place, (site, layout, _, _) in enumerate(each):
        groups.setdefault((id(site), layout), []).append(place)
    queue = iter([place for group in groups.values() for place in group])
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(lambda _: outcomes(each, queue), range(threads)))
    found = sorted((pair for part in parts for pair in part), key=lambda pair: pair[0])
    for _, outcome in found:
        if isinstance(outcome, Error):
            raise outcome
    return [outcome for _, outcome in found if isinstance(outcome, Outcome)]
