"""Storage of evaluations on disk, so that an interrupted search can continue.

A folder of results belongs to one problem, which is recorded in the folder.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import (
    MECHANICS,
    BadInput,
    DoubtfulInput,
    Layout,
    Outcome,
    Site,
    __version__,
    distribution,
)
from rigdda.agents.designers import catalogue
from rigdda.agents.designers.catalogue import CrossingEnsemble, seeds_by_event
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.intervals import estimate
from rigdda.envs.outcome_cache import pack, unpack
from rigdda.envs.problem import checked_seeds
from rigdda.files import atomic

PROBLEM_FILE = "problem.json"


def record_problem(folder: Path, problem: DesignProblem, *files: str) -> None:
    """Write `problem.json` into a folder to record the problem of its results.

    Parameters
    ----------
    folder : path
        The folder for the results.
    problem : DesignProblem
        The problem.
    files : str
        Names of the files with results that would be overwritten.

    Raises
    ------
    BadInput
        If the folder contains results of another problem or of an unknown problem.
    """
    file, asked = folder / PROBLEM_FILE, identity(problem)
    if file.exists():
        known = _read(file)
        other = _differ(known, asked) if known else f"{PROBLEM_FILE}, which is damaged"
    else:
        found = [name for name in files if (folder / name).exists()]
        other = f"{found[0]} of an unknown problem" if found else ""
    if other:
        raise BadInput("--out", str(folder), f"it contains {other}: name another folder")
    with atomic(file) as part:
        part.write_text(json.dumps(asked, indent=2) + "\n", encoding="utf-8")


def identity(problem: DesignProblem) -> dict[str, Any]:
    """Return the values that identify a problem.

    `content` is a hash of the site including its prices and rates, but not its texts.
    """
    return {
        "site": problem.site.name,
        "kinds": list(problem.kinds),
        "zone": [problem.zone.start, problem.zone.end],
        "targets": msgspec.to_builtins(problem.targets),
        "max_barriers": problem.max_barriers,
        "max_cost": problem.max_cost,
        "fidelity": problem.fidelity,
        "checks": problem.checks,
        "content": problem.key.hex()[:16],
    }


def _read(file: Path) -> dict[str, Any]:
    """Return the problem that is recorded in a file, or an empty mapping if it is unreadable."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, OSError):
        return {}
    return found if isinstance(found, dict) else {}


def _differ(known: dict[str, Any], asked: dict[str, Any]) -> str:
    """Return a text on how a recorded problem differs from the requested one; empty if equal."""
    if known == asked:
        return ""
    for name, value in asked.items():
        if known.get(name) != value:
            if name == "content":
                return f"a design of site {asked['site']!r} with other contents"
            return f"a design of {name} {known.get(name)!r}, not {value!r}"
    return "a design of another problem"


CONSTANTS = {"Infinity": math.inf, "-Infinity": -math.inf, "NaN": math.nan}
"""Non-finite constants in JSON lines, which occur for intervals without an end and events without
releases. The same NaN object is used everywhere, so that the values read equal those written."""


SUBSTITUTES = (0, 1)
"""Seeds of releases without barriers that are used for an event without releases."""


Ask = tuple[DesignProblem, Layout, Sequence[int]]
"""A layout to evaluate on release seeds."""


class Release(NamedTuple):
    """Stored values of a release.

    These are its bill [EUR per occurrence], the volume on the road [m3], whether a block reached
    the road, whether a barrier failed, and the expected fatalities (0 without `[traffic]`).
    """

    bill: float
    volume: float
    reached: bool
    failed: bool
    fatalities: float = 0.0


@dataclass(frozen=True, slots=True)
class StoredEvaluation:
    """Releases of a layout by event, and their joint evaluation.

    `outcomes` holds the packed outcomes of the releases, see `pack`; it is empty in a store that
    does not keep them.
    """

    evaluation: Evaluation
    releases: dict[str, tuple[Release, ...]]
    outcomes: bytes = b""


class StoredReleases(NamedTuple):
    """Releases of a layout, in the order of their packed outcomes."""

    layout: Layout
    seeds: tuple[int, ...]
    outcomes: bytes


class Store:
    """Evaluates layouts and stores the evaluations.

    When a search is run again, it requests the same layouts on the same seeds. Evaluations in the
    store are then returned without a simulation. They are identified by everything that determines
    them, so that an entry of another site, problem, seed or version of the mechanics is never
    returned. Their evaluations do not contain outcomes, except those of `evaluate_many`.

    The file contains JSON lines. A database is not needed, because one process writes the file,
    entries are only appended, and all of them are read once at the start. A copy that was made at
    any moment is therefore usable, and any tool can read it.

    Parameters
    ----------
    path : path, optional
        A file with one JSON line per evaluation, which is appended at once. An incomplete last
        line, as an interruption leaves it, is cut off. Lines with a wrong checksum are skipped. If
        None, evaluations are kept in memory only.
    outcomes : bool
        Whether the outcomes of all releases are kept, for `rigdda reprice`.

    Attributes
    ----------
    simulated, resumed : int
        Number of releases simulated so far, and number of releases taken from the file.
    """

    def __init__(self, path: str | os.PathLike[str] | None = None, outcomes: bool = False):
        self.path = None if path is None else Path(path)
        self._keeps = outcomes
        self._asked: dict[str, tuple[Layout, tuple[int, ...]]] = {}
        self.simulated = self.resumed = 0
        self._known: dict[str, StoredEvaluation] = {}
        self._kept: set[str] = set()
        if self.path is not None and self.path.is_file():
            self._read(self.path)

    def _read(self, path: Path) -> None:
        """Read the complete lines of the file and cut off an incomplete last line.

        Warns
        -----
        DoubtfulInput
            If complete lines are damaged.
        """
        text = path.read_bytes()
        whole, damaged = text.rfind(b"\n") + 1, 0
        for line in text[:whole].splitlines():
            try:
                data = json.loads(line, parse_constant=CONSTANTS.__getitem__)
                sound = data["sum"] == _sum(data["key"], data["batch"])
                if sound:
                    self._known[data["key"]] = msgspec.convert(data["batch"], StoredEvaluation)
            except (ValueError, KeyError, TypeError, RecursionError, msgspec.ValidationError):
                sound = False
            damaged += not sound
        if damaged:
            told = (
                f"{path}: {damaged:,} damaged lines are ignored: their releases are simulated again"
            )
            warnings.warn(told, DoubtfulInput, stacklevel=3)
        self._kept = set(self._known)
        if whole < len(text):
            os.truncate(path, whole)

    def evaluate(self, problem: DesignProblem, layout: Layout, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a layout on release seeds from the store or a simulation.

        Raises
        ------
        BadInput, Diverged
            The same errors as `DesignProblem.evaluate`.
        """
        drawn = checked_seeds("seeds", seeds)

        def simulate() -> StoredEvaluation:
            return _evaluated((problem, layout, drawn), self._keeps)

        found = self._recall(_key(problem, layout, drawn), layout, drawn, simulate)
        return replace(found.evaluation, layout=layout, seeds=drawn)

    def evaluate_many(self, asks: Sequence[Ask]) -> Iterator[Evaluation]:
        """Yield the evaluations of several layouts, each on release seeds of its own.

        Those that are not in the store are computed by the executor in use, see
        `rigdda.distribution`, each by one worker. The evaluations contain their outcomes if the
        store keeps them.

        Raises
        ------
        BadInput, Diverged
            The same errors as `DesignProblem.evaluate`.
        """
        whole = [(problem, own, checked_seeds("seeds", seeds)) for problem, own, seeds in asks]
        keys = [_key(*ask) for ask in whole]
        new = {k: ask for k, ask in zip(keys, whole, strict=True) if self._stored(k) is None}
        found = distribution.mapped(partial(_evaluated, keeps=self._keeps), list(new.values()))
        for key, (_, layout, drawn) in zip(keys, whole, strict=True):
            kept = self._recall(key, layout, drawn, lambda: next(found))
            outcomes = tuple(unpack(kept.outcomes)) if self._keeps else ()
            yield replace(kept.evaluation, layout=layout, seeds=drawn, outcomes=outcomes)

    def sample(
        self, problem: DesignProblem, layout: Layout, seeds: Mapping[str, Sequence[int]]
    ) -> StoredEvaluation:
        """Return releases of some events with a layout from the store or a simulation.

        Parameters
        ----------
        problem : DesignProblem
            The problem.
        layout : Layout
            The layout.
        seeds : mapping of str to sequence of int
            Release seeds by name of event, any number for each event. The costs in the evaluation
            use releases without barriers for an event that has no seeds.

        Raises
        ------
        BadInput, Diverged
            The same errors as `DesignProblem.sample`.
        """
        asked = seeds_by_event(seeds)

        def simulate() -> StoredEvaluation:
            outcomes = problem.sample(layout, asked)
            found: dict[str, list[Release]] = {name: [] for name in asked}
            for outcome in outcomes:
                found[outcome.event].append(_release(problem, layout, outcome))
            kept = {name: tuple(releases) for name, releases in found.items()}
            missing = {
                name: SUBSTITUTES for name in problem.site.event_names if not asked.get(name)
            }
            sample = problem.sample((), missing) if missing else ()
            lent = [replace(outcome, barriers=()) for outcome in sample]  # existing barriers
            judged = problem.judge(layout, (*outcomes, *lent))
            unknown = dict.fromkeys(missing, estimate(0, 0))
            judged = replace(judged, reach=judged.reach | unknown, failure=judged.failure | unknown)
            judged = replace(judged, targets=problem.state(judged))
            return StoredEvaluation(judged, kept, pack(outcomes) if self._keeps else b"")

        drawn = tuple(seed for own in asked.values() for seed in own)
        key = _key(problem, layout, sorted(asked.items()))
        found = self._recall(key, layout, drawn, simulate)
        return replace(found, evaluation=replace(found.evaluation, layout=layout))

    def crossings(
        self, site: Site, seeds: Mapping[str, Sequence[int]], stations: NDArray[np.float64]
    ) -> CrossingEnsemble:
        """Return the crossings of stations in releases without barriers, which are not stored.

        The arguments and errors are those of `rigdda.agents.designers.catalogue.ensemble`.
        """
        return catalogue.ensemble(site, seeds, stations)

    def outcomes(
        self, problem: DesignProblem, layout: Layout, seeds: Mapping[str, Sequence[int]]
    ) -> list[Outcome]:
        """Return the outcomes of releases of some events, which the store must keep.

        The arguments and errors are those of `sample`, the order is that of `seeds`.
        """
        return unpack(self.sample(problem, layout, seeds).outcomes)

    def stored_releases(self) -> Iterator[StoredReleases]:
        """Yield the releases of each evaluation in the order in which they were requested.

        Only a store with `outcomes` keeps them. A release can be in several evaluations.
        """
        for key, (layout, drawn) in self._asked.items():
            yield StoredReleases(layout, drawn, self._known[key].outcomes)

    def _stored(self, key: str) -> StoredEvaluation | None:
        """Return the stored evaluation with a key, with its outcomes if the store keeps them."""
        known = self._known.get(key)
        return known if known is None or known.outcomes or not self._keeps else None

    def _recall(
        self,
        key: str,
        layout: Layout,
        drawn: tuple[int, ...],
        simulate: Callable[[], StoredEvaluation],
    ) -> StoredEvaluation:
        """Return the stored evaluation with a key, or simulate and store it."""
        if self._keeps:
            self._asked.setdefault(key, (layout, drawn))
        known = self._stored(key)
        if known is not None:
            self.resumed += len(drawn) if key in self._kept else 0
            return known
        batch = simulate()
        bare = replace(batch.evaluation, layout=(), seeds=(), outcomes=(), simulated=0, seconds=0.0)
        self._known[key] = replace(batch, evaluation=bare)
        self.simulated += len(drawn)
        if self.path is not None:
            data = msgspec.to_builtins(self._known[key])
            line = json.dumps({"key": key, "sum": _sum(key, data), "batch": data})
            with self.path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        return self._known[key]


def _evaluated(ask: Ask, keeps: bool) -> StoredEvaluation:
    """Return the evaluation of a layout, with packed outcomes if they are kept."""
    problem, layout, seeds = ask
    found = problem.evaluate(layout, seeds)
    return StoredEvaluation(replace(found, outcomes=()), {}, pack(found.outcomes) if keeps else b"")


def _release(problem: DesignProblem, layout: Layout, outcome: Outcome) -> Release:
    """Return the stored values of an outcome."""
    bill = problem.site.bill(layout, outcome)
    failed = any(barrier.failed for barrier in outcome.barriers)
    killed = 0.0
    if problem.site.traffic is not None:
        killed = float(problem.site.traffic_consequences(layout, outcome).fatalities)
    return Release(bill.harm + bill.repair, outcome.road_volume, outcome.reached, failed, killed)


def _sum(key: str, data: Any) -> str:
    """Return the checksum of a line, which detects damage."""
    return hashlib.sha256((key + json.dumps(data)).encode()).hexdigest()[:16]


def _key(problem: DesignProblem, layout: Layout, seeds: Any) -> str:
    """Return a hash of everything that an evaluation depends on."""
    asked = [__version__, MECHANICS, problem.key.hex(), problem.targets, list(layout), seeds]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:32]
