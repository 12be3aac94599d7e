"""Archive of a design: the outcomes of all releases that it simulated, for other prices.

The motion of rock does not depend on prices, consequences and rates of events. From the stored
outcomes, layouts can therefore be evaluated with other prices, consequences and rates without
simulation, see `rigdda.app.reprice`.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from rigdda import MECHANICS, BadInput, Layout, Outcome, Site, __version__
from rigdda.agents.designers.store import Store
from rigdda.app.value_origins import Mark
from rigdda.barriers import from_table, to_tables
from rigdda.envs import DesignProblem, ensemble
from rigdda.envs.ensemble import Ensemble
from rigdda.envs.outcome_cache import unpack
from rigdda.envs.problem import Targets
from rigdda.files import atomic, is_file

ARCHIVE_FILE = "outcomes.msgpack.gz"
"""Name of the archive in the folder of a design."""


class ArchivedReleases(msgspec.Struct, frozen=True):
    """Releases with one layout.

    Parameters
    ----------
    barriers : list of dict
        The layout, as tables of a layout file.
    seeds : list of int
        Seed of each release.
    outcomes : list of Outcome
        Outcome of each release.
    """

    barriers: list[dict[str, Any]]
    seeds: list[int]
    outcomes: list[Outcome]


class Archive(msgspec.Struct, frozen=True):
    """Everything that a design simulated.

    Parameters
    ----------
    version, mechanics : str
        Versions of the program and of the mechanics.
    site : Site
        The site as it was simulated.
    max_barriers, kinds, targets, zone, max_cost, checks
        Arguments of the `DesignProblem`; `zone` has two chainages.
    seed : int
        Seed of the search.
    names : list of str
        Names of the verified layouts, no barrier first and the layout found last.
    layouts : list of list of dict
        These layouts, as tables of a layout file.
    shares : dict of str to float
        Share of the releases for each event, from which the events were drawn.
    blocks : dict of str to float
        Mean number of blocks in a release of each event.
    bare : list of Outcome
        Outcomes of the releases without barriers from which the statistics of the site follow.
    releases : list of ArchivedReleases
        All other releases, each layout once.
    placeholders : list of Mark
        Values of the site file that were marked as placeholders.
    """

    version: str
    mechanics: str
    site: Site
    max_barriers: int
    kinds: list[str]
    targets: Targets
    zone: tuple[float, float]
    max_cost: float | None
    checks: str
    seed: int
    names: list[str]
    layouts: list[list[dict[str, Any]]]
    shares: dict[str, float]
    blocks: dict[str, float]
    bare: list[Outcome]
    releases: list[ArchivedReleases]
    placeholders: list[Mark] = []


class LayoutReleases(NamedTuple):
    """Seeds and outcomes of the releases with a layout."""

    layout: Layout
    seeds: tuple[int, ...]
    outcomes: tuple[Outcome, ...]


def archive(
    problem: DesignProblem,
    seed: int,
    cases: Sequence[tuple[str, Layout]],
    store: Store,
    placeholders: Sequence[Mark] = (),
) -> Archive:
    """Return the archive of a design.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    seed : int
        Seed of the search.
    cases : sequence of (str, Layout)
        The verified layouts, no barrier first and the layout found last.
    store : Store
        The store of the design, which keeps the outcomes.
    placeholders : sequence of Mark
        Values of the site file that are marked as placeholders.
    """
    known = ensemble.of(problem.site, problem.key)
    return Archive(
        version=__version__,
        mechanics=MECHANICS,
        site=problem.site,
        max_barriers=problem.max_barriers,
        kinds=list(problem.kinds),
        targets=problem.targets,
        zone=(problem.zone.start, problem.zone.end),
        max_cost=problem.max_cost,
        checks=problem.checks,
        seed=seed,
        names=[name for name, _ in cases],
        layouts=[to_tables(layout) for _, layout in cases],
        shares=problem.shares,
        blocks={name: facts.blocks for name, facts in known.facts.items()},
        bare=_bare(problem.site, known),
        releases=[
            ArchivedReleases(to_tables(own.layout), list(own.seeds), list(own.outcomes))
            for own in gathered(store)
        ],
        placeholders=list(dict.fromkeys(mark.stored for mark in placeholders)),
    )


def gathered(store: Store) -> Iterator[LayoutReleases]:
    """Yield the releases that a store keeps: for each layout, every release once."""
    found: dict[Layout, dict[tuple[str, int], Outcome]] = {}
    for own in store.stored_releases():
        known = found.setdefault(own.layout, {})
        for seed, outcome in zip(own.seeds, unpack(own.outcomes), strict=True):
            known.setdefault((outcome.event, seed), outcome)
    for layout, known in found.items():
        yield LayoutReleases(layout, tuple(seed for _, seed in known), tuple(known.values()))


def _bare(site: Site, known: Ensemble) -> list[Outcome]:
    """Return the outcomes of releases without barriers from which an ensemble is computed."""
    counts = {name: known.nothing.reach[name].releases for name in site.event_names}
    found = ensemble.bare_outcomes(site, counts)
    return [outcome for name in site.event_names for outcome in found[name]]


def write(path: Path, made: Archive) -> None:
    """Write an archive atomically."""
    with atomic(path) as part, part.open("wb") as file:
        with gzip.GzipFile("", "wb", 6, file, mtime=0) as packed:
            packed.write(msgspec.msgpack.encode(made))


def read(folder: Path) -> Archive:
    """Return the archive in the folder of a design.

    Raises
    ------
    BadInput
        If there is none, or it is damaged, or its releases were simulated with other mechanics.
    """
    path = folder / ARCHIVE_FILE
    if not is_file(path):
        hint = f"name the folder of a completed `rigdda design`, which contains {ARCHIVE_FILE}"
        raise BadInput("RESULTS", str(folder), hint)
    try:
        found = msgspec.msgpack.decode(gzip.decompress(path.read_bytes()), type=Archive)
    except (OSError, EOFError, ValueError, zlib.error, msgspec.MsgspecError) as error:
        hint = f"run `rigdda design` again: this file is damaged or of another version ({error})"
        raise BadInput("RESULTS", str(path), " ".join(hint.split())) from None
    if found.mechanics != MECHANICS:
        hint = f"its releases were simulated with mechanics {found.mechanics!r}, those of this "
        hint += f"version are {MECHANICS!r}: run `rigdda design` again"
        raise BadInput("RESULTS", str(path), hint)
    return found


def layout_of(tables: Sequence[dict[str, Any]]) -> Layout:
    """Return the layout that tables of an archive describe."""
    return tuple(from_table(f"barriers[{i}]", table) for i, table in enumerate(tables))
