"""Storage of evaluations on disk, so that an interrupted search can continue.

A folder of results belongs to one problem, which is recorded in the folder.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from rigdda import BadInput, Layout, Outcome, __version__, distribution
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.outcome_cache import mechanics
from rigdda.files import atomic

FILE = "problem.json"


def claim(folder: Path, problem: DesignProblem, *files: str) -> None:
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
    file, asked = folder / FILE, posed(problem)
    if file.exists():
        known = _read(file)
        other = _differ(known, asked) if known else f"{FILE}, which is damaged"
    else:
        found = [name for name in files if (folder / name).exists()]
        other = f"{found[0]} of an unknown problem" if found else ""
    if other:
        raise BadInput("--out", str(folder), f"it contains {other}: name another folder")
    with atomic(file) as part:
        part.write_text(json.dumps(asked, indent=2) + "\n", encoding="utf-8")


def posed(problem: DesignProblem) -> dict[str, Any]:
    """Return the values that identify a problem.

    `content` is a hash of the site including its prices and rates.
    """
    return {
        "site": problem.site.name,
        "kinds": list(problem.kinds),
        "zone": [problem.zone.start, problem.zone.end],
        "targets": msgspec.to_builtins(problem.targets),
        "max_barriers": problem.max_barriers,
        "fidelity": problem.fidelity,
        "content": hashlib.sha256(msgspec.json.encode(problem.site)).hexdigest()[:16],
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


LENT = (0, 1)
"""Seeds of releases without barriers that are used for an event without releases."""


Ask = tuple[DesignProblem, Layout, Sequence[int]]
"""A layout to evaluate on release seeds."""


class Release(NamedTuple):
    """Stored values of a release.

    These are its bill [EUR per occurrence], the volume on the road [m3], whether a block reached
    the road and whether a barrier failed.
    """

    bill: float
    volume: float
    reached: bool
    failed: bool


@dataclass(frozen=True, slots=True)
class StoredEvaluation:
    """Releases of a layout by event, and their joint evaluation."""

    evaluation: Evaluation
    releases: dict[str, tuple[Release, ...]]


class Store:
    """Evaluates layouts and stores the evaluations.

    When a search is run again, it requests the same layouts on the same seeds. Evaluations in the
    store are then returned without a simulation. They are identified by everything that determines
    them, so that an entry of another site, problem, seed or version of the mechanics is never
    returned. Evaluations from a store never contain outcomes.

    Parameters
    ----------
    path : path, optional
        A file with one JSON line per evaluation, which is appended at once. An incomplete last
        line, as an interruption leaves it, is cut off. Lines with a wrong checksum are skipped. If
        None, evaluations are kept in memory only.

    Attributes
    ----------
    simulated, resumed : int
        Number of releases simulated so far, and number of releases taken from the file.
    """

    def __init__(self, path: str | os.PathLike[str] | None = None):
        self.path = None if path is None else Path(path)
        self.simulated = self.resumed = 0
        self._known: dict[str, StoredEvaluation] = {}
        self._kept: set[str] = set()
        if self.path is not None and self.path.is_file():
            self._read(self.path)

    def _read(self, path: Path) -> None:
        """Read the complete lines of the file and cut off an incomplete last line."""
        text = path.read_bytes()
        whole = text.rfind(b"\n") + 1
        for line in text[:whole].splitlines():
            try:
                data = json.loads(line, parse_constant=CONSTANTS.__getitem__)
                if data["sum"] == _sum(data["key"], data["batch"]):
                    self._known[data["key"]] = msgspec.convert(data["batch"], StoredEvaluation)
            except (ValueError, KeyError, TypeError, RecursionError, msgspec.ValidationError):
                continue
        self._kept = set(self._known)
        os.truncate(path, whole)

    def evaluate(self, problem: DesignProblem, layout: Layout, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a layout on release seeds from the store or a simulation.

        Raises
        ------
        BadInput, Diverged
            The same errors as `DesignProblem.evaluate`.
        """
        drawn = tuple(seeds)

        def simulate() -> StoredEvaluation:
            return StoredEvaluation(problem.evaluate(layout, drawn), {})

        found = self._recall(_key(problem, layout, drawn), len(drawn), simulate)
        return replace(found.evaluation, layout=layout, seeds=drawn)

    def evaluate_many(self, asks: Sequence[Ask]) -> Iterator[Evaluation]:
        """Yield the evaluations of several layouts, each on release seeds of its own.

        Those that are not in the store are computed by the executor in use, see
        `rigdda.distribution`, each by one worker.

        Raises
        ------
        BadInput, Diverged
            The same errors as `DesignProblem.evaluate`.
        """
        keys = [_key(problem, layout, tuple(seeds)) for problem, layout, seeds in asks]
        new = [ask for key, ask in zip(keys, asks, strict=True) if key not in self._known]
        found = distribution.mapped(_evaluated, new)
        for key, (_, layout, seeds) in zip(keys, asks, strict=True):
            kept = self._recall(key, len(seeds), lambda: StoredEvaluation(next(found), {}))
            yield replace(kept.evaluation, layout=layout, seeds=tuple(seeds))

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
            Release seeds by name of event, any number for each event. The evaluation uses releases
            without barriers for an event that has no seeds.

        Raises
        ------
        BadInput, Diverged
            The same errors as `DesignProblem.sample`.
        """
        asked = {name: tuple(drawn) for name, drawn in seeds.items()}

        def simulate() -> StoredEvaluation:
            outcomes = problem.sample(layout, asked)
            found: dict[str, list[Release]] = {name: [] for name in asked}
            for outcome in outcomes:
                found[outcome.event].append(_release(problem, layout, outcome))
            kept = {name: tuple(releases) for name, releases in found.items()}
            missing = {name: LENT for name in problem.site.event_names if not asked.get(name)}
            lent = problem.sample((), missing) if missing else ()
            return StoredEvaluation(problem.judge(layout, (*outcomes, *lent)), kept)

        count = sum(map(len, asked.values()))
        found = self._recall(_key(problem, layout, sorted(asked.items())), count, simulate)
        return replace(found, evaluation=replace(found.evaluation, layout=layout))

    def _recall(
        self, key: str, count: int, simulate: Callable[[], StoredEvaluation]
    ) -> StoredEvaluation:
        """Return the stored evaluation with a key, or simulate and store it."""
        if key in self._known:
            self.resumed += count if key in self._kept else 0
            return self._known[key]
        batch = simulate()
        bare = replace(batch.evaluation, layout=(), seeds=(), outcomes=(), simulated=0, seconds=0.0)
        self._known[key] = replace(batch, evaluation=bare)
        self.simulated += count
        if self.path is not None:
            data = msgspec.to_builtins(self._known[key])
            line = json.dumps({"key": key, "sum": _sum(key, data), "batch": data})
            with self.path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        return self._known[key]


def _evaluated(ask: Ask) -> Evaluation:
    """Return the evaluation of a layout, without its outcomes."""
    problem, layout, seeds = ask
    return replace(problem.evaluate(layout, seeds), outcomes=())


def _release(problem: DesignProblem, layout: Layout, outcome: Outcome) -> Release:
    """Return the stored values of an outcome."""
    bill = problem.site.bill(layout, outcome)
    failed = any(barrier.failed for barrier in outcome.barriers)
    return Release(bill.harm + bill.repair, outcome.road_volume, outcome.reached, failed)


def _sum(key: str, data: Any) -> str:
    """Return the checksum of a line, which detects damage."""
    return hashlib.sha256((key + json.dumps(data)).encode()).hexdigest()[:16]


def _key(problem: DesignProblem, layout: Layout, seeds: Any) -> str:
    """Return a hash of everything that an evaluation depends on."""
    asked = [__version__, mechanics(), problem.site, problem.targets, list(layout), seeds]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:32]
