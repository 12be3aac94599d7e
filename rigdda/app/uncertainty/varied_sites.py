"""Releases of a site whose numbers vary: simulated once, and priced for any prices and rates.

The outcome of a release depends on the ground and on the blocks, but not on prices, consequences
and rates. Sites that differ only in the latter share their releases. All sites have the same seeds
(common random numbers), so that differences between them are not due to other releases.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

import rigdda
from rigdda import MECHANICS, Layout, Outcome, Site
from rigdda.envs import outcome_cache
from rigdda.envs.cost import account
from rigdda.files import UNFINISHED, atomic

Floats = NDArray[np.float64]

Seeds = Mapping[str, Sequence[int]]
"""Seeds of the releases of each event."""


class SimulatedSite(NamedTuple):
    """Outcomes of the releases of a site with one layout, by event."""

    outcomes: tuple[Outcome, ...]
    strata: NDArray[np.int64]
    """Index of the event of each release in `Site.event_names`."""
    resumed: bool
    """Whether the outcomes come from the folder of an interrupted job."""


def simulate(
    site: Site, layouts: Sequence[Layout], seeds: Seeds, folder: Path | None
) -> list[SimulatedSite]:
    """Simulate the releases of a site with several layouts, on all cores.

    Parameters
    ----------
    site : Site
        The site.
    layouts : sequence of Layout
        The layouts.
    seeds : mapping of str to sequence of int
        Seeds of the releases of each event.
    folder : path, optional
        Where the outcomes are kept; releases that the folder contains are not simulated again.

    Raises
    ------
    BadInput, Diverged
        As `rigdda.release` does.
    """
    jobs = [
        (site, layout, seed, event)
        for layout in layouts
        for event, drawn in seeds.items()
        for seed in drawn
    ]
    file = None if folder is None else folder / UNFINISHED / f"{_key(site, layouts, seeds)}.z"
    found = None if file is None else _read(file, len(jobs))
    resumed = found is not None
    if found is None:
        found = tuple(outcome_cache.outcomes(jobs))
        if file is not None:
            _write(file, found)
    names = site.event_names
    strata = np.array([names.index(event) for event, drawn in seeds.items() for _ in drawn])
    count = len(strata)
    return [
        SimulatedSite(found[i * count : (i + 1) * count], strata, resumed)
        for i in range(len(layouts))
    ]


def _key(site: Site, layouts: Sequence[Layout], seeds: Seeds) -> str:
    """Return a hash of everything that the outcomes depend on."""
    built = [list(layout) for layout in layouts]
    drawn = {name: list(own) for name, own in seeds.items()}
    moves = [outcome_cache.release_key(site).hex(), site.existing]
    asked = [rigdda.__version__, MECHANICS, moves, built, drawn]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:24]


def _write(file: Path, outcomes: Sequence[Outcome]) -> None:
    """Write outcomes, all or nothing."""
    with atomic(file) as part:
        part.write_bytes(zlib.compress(msgspec.msgpack.encode(outcomes), 1))


def _read(file: Path, count: int) -> tuple[Outcome, ...] | None:
    """Return the outcomes in a file, None if there is none or it is damaged."""
    try:
        words = zlib.decompress(file.read_bytes())
        found = msgspec.msgpack.decode(words, type=tuple[Outcome, ...])
    except (OSError, zlib.error, msgspec.MsgspecError):
        return None
    return found if len(found) == count else None


class Priced(NamedTuple):
    """Costs of a layout on a site as sums over its R releases.

    Z = annual + terms.sum(). The mean over the releases of an event, multiplied by its yearly rate,
    is the sum of its terms.
    """

    annual: float
    """Capital and upkeep [EUR per metre of road and year]."""
    terms: Floats
    """Share of each release in the expected harm and repair, (R,) [EUR per metre and year]."""
    reached: NDArray[np.bool_]
    """Whether a block reached the road, (R,)."""
    failed: NDArray[np.bool_]
    """Whether a barrier failed, (R,)."""

    @property
    def objective(self) -> float:
        """Z [EUR per metre of road and year]."""
        return float(self.annual + self.terms.sum())


def price(site: Site, layout: Layout, simulated: SimulatedSite) -> Priced:
    """Return the costs of a layout with the prices, consequences and rates of a site."""
    costs = account(site, layout, simulated.outcomes)
    terms = costs.harm + costs.repair
    for i, name in enumerate(site.event_names):
        here = simulated.strata == i
        terms[here] *= site.rate(name, layout) / max(int(here.sum()), 1)
    return Priced(site.annual(layout), terms, costs.reached, costs.failed)


def noise(terms: Floats, strata: NDArray[np.int64]) -> Floats:
    """Return the variance of sums over releases that is due to their finite number, (m,).

    Parameters
    ----------
    terms : (m, R) array
        Terms of m sums over the same releases, for example of differences between two sites.
    strata : (R,) array
        Event of each release.
    """
    out = np.zeros(len(terms))
    for stratum in np.unique(strata):
        own = terms[:, strata == stratum]
        if own.shape[1] > 1:
            out += own.shape[1] * own.var(axis=1, ddof=1)
    return out
