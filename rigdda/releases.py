"""Releases: a site with a layout, simulated for a seed."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from rigdda import check
from rigdda.barriers import Barrier, Layout, as_layout
from rigdda.batch import EVERY, Batch, Job, as_site, outcomes, simulation
from rigdda.dynamics.run import Run
from rigdda.errors import BadInput, DoubtfulInput, Error
from rigdda.model.site import Site
from rigdda.results.outcome import Outcome, measure

MANY = 0.05
"""Share of some releases that may be cut off without a warning: one late block in a hundred."""


TOGETHER = 16
"""Most releases that a thread takes at a time."""


def release(
    site: Site,
    layout: Sequence[Barrier] = (),
    seed: int = 0,
    event: str | None = None,
    progress: bool = False,
) -> tuple[Run, Outcome]:
    """Simulate one release of an event, or of one that the seed draws by rate, with a layout.

    Events are drawn by their rates without mesh, which makes them rarer and changes no release: the
    same seed gives the same rock with every layout.

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

    Warns
    -----
    DoubtfulInput
        If `motion.duration` cuts it off, see `Outcome.cut_off`.
    """
    drawn = as_site(site).draw(seed, event)
    scene = site.scene(drawn, site.built(layout, drawn.width))
    run = simulation(site, scene).run(site.motion.duration, EVERY, progress)
    outcome = measure(site, run, drawn.event, drawn.width)
    if outcome.cut_off:
        _doubt_duration(site)
    return run, outcome


def _doubt_duration(site: Site) -> None:
    warnings.warn(
        f"motion.duration = {site.motion.duration:g} of site {site.name!r}: rock above the road "
        "still moves as releases end, and counts as if it stopped there: give more",
        DoubtfulInput,
        stacklevel=3,
    )


def release_outcome(
    site: Site, layout: Sequence[Barrier] = (), seed: int = 0, event: str | None = None
) -> Outcome:
    """Return the outcome that `release` gives, in less time: frames on the way are not kept."""
    return Batch(site, layout).outcome(seed, event)


def _job(i: int, job: Job) -> tuple[Site, Layout, int, str | None]:
    if not isinstance(job, tuple | list) or len(job) != 4:
        raise BadInput(f"jobs[{i}]", job, "give (site, layout, seed, event)")
    site, layout, seed, event = job
    return site, as_layout(layout), seed, event


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

    Warns
    -----
    DoubtfulInput
        If `motion.duration` cuts more than one in twenty off, see `Outcome.cut_off`.
    """
    if not isinstance(jobs, Sequence):
        raise BadInput("jobs", jobs, "give a sequence of (site, layout, seed, event)")
    each = [_job(i, job) for i, job in enumerate(jobs)]
    threads = os.cpu_count() or 1 if threads is None else check.integer("threads", threads, 1)
    groups: dict[tuple[int, Layout], list[int]] = {}
    for place, (site, layout, _, _) in enumerate(each):
        groups.setdefault((id(site), layout), []).append(place)
    threads = max(1, min(threads, len(each)))
    most = max(1, min(TOGETHER, len(each) // (8 * threads)))
    queue = iter(
        [group[i : i + most] for group in groups.values() for i in range(0, len(group), most)]
    )
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(lambda _: outcomes(each, queue), range(threads)))
    found = sorted((pair for part in parts for pair in part), key=lambda pair: pair[0])
    for _, outcome in found:
        if isinstance(outcome, Error):
            raise outcome
    good = [outcome for _, outcome in found if isinstance(outcome, Outcome)]
    cut = [each[place][0] for place, o in found if isinstance(o, Outcome) and o.cut_off]
    if len(cut) > max(1.0, MANY * len(good)):
        _doubt_duration(cut[0])
    return good
