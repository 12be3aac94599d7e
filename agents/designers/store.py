"""Evaluations on disk, so that a search that was killed goes on where it stopped.

A folder of results belongs to one problem, which is written into it.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from rigdda import BadInput, Layout, Outcome, __version__
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.outcome_cache import mechanics
from rigdda.files import atomic

FILE = "problem.json"


def claim(folder: Path, problem: DesignProblem, *files: str) -> None:
    """Write `problem.json` into a folder, so that it is known again.

    Parameters
    ----------
    folder : path
        Where results are to be written.
    problem : DesignProblem
        What they answer.
    files : str
        Names of results that would be written over.

    Raises
    ------
    BadInput
        If the folder holds results of another problem, or of one that it does not tell.
    """
    file, asked = folder / FILE, posed(problem)
    if file.exists():
        known = _read(file)
        other = _differ(known, asked) if known else f"{FILE}, which is damaged"
    else:
        found = [name for name in files if (folder / name).exists()]
        other = f"{found[0]} of a problem that it does not tell" if found else ""
    if other:
        raise BadInput("--out", str(folder), f"it holds {other}: name another folder")
    with atomic(file) as part:
        part.write_text(json.dumps(asked, indent=2) + "\n", encoding="utf-8")


def posed(problem: DesignProblem) -> dict[str, Any]:
    """Return all that makes a problem another one, as plain values.

    `content` is a hash of the site with its prices and rates.
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
    """Return what a folder says that it is of, nothing if that cannot be read."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, OSError):
        return {}
    return found if isinstance(found, dict) else {}


def _differ(known: dict[str, Any], asked: dict[str, Any]) -> str:
    """Return in words what a folder holds instead of what is asked; nothing if it is the same."""
    if known == asked:
        return ""
    for name, value in asked.items():
        if known.get(name) != value:
            if name == "content":
                return f"a design of site {asked['site']!r} with other contents"
            return f"a design of {name} {known.get(name)!r}, not {value!r}"
    return "a design of another problem"


CONSTANTS = {"Infinity": math.inf, "-Infinity": -math.inf, "NaN": math.nan}
"""Constants of JSON lines: an interval may have no end, an event no release. One NaN for all, so
that what is read equals what was written."""


LENT = (0, 1)
"""Seeds of the releases without barriers that stand for those of an event which has none."""


class Release(NamedTuple):
    """What is kept of a release.

    Its bill [EUR per occurrence], the volume that came onto the road [m3], whether a block reached
    the road, whether a barrier failed.
    """

    bill: float
    volume: float
    reached: bool
    failed: bool


@dataclass(frozen=True, slots=True)
class StoredEvaluation:
    """Releases of a layout, by event, and what they say of it together."""

    evaluation: Evaluation
    releases: dict[str, tuple[Release, ...]]


class Store:
    """Evaluates layouts and keeps what they were worth, looked up by all that determines it.

    A search asks for the same layouts on the same seeds when it is run again; what the store has
    is handed back instead of simulated. An entry of another site, problem, seed or version of the
    mechanics is never handed back. Evaluations of a store have no outcomes, whether they were just
    simulated or not.

    Parameters
    ----------
    path : path, optional
        A file of JSON lines, one an evaluation, appended to and flushed at once; a last line that
        a kill left unfinished is cut off, and lines whose checksum does not fit are passed over.
        None: memory only.

    Attributes
    ----------
    simulated, resumed : int
        Releases evaluated so far, and releases taken from the file instead.
    """

    def __init__(self, path: str | os.PathLike[str] | None = None):
        self.path = None if path is None else Path(path)
        self.simulated = self.resumed = 0
        self._known: dict[str, StoredEvaluation] = {}
        self._kept: set[str] = set()
        if self.path is not None and self.path.is_file():
            self._read(self.path)

    def _read(self, path: Path) -> None:
        """Read the whole lines of the file and cut off a last one that is not whole."""
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
        """Return the evaluation of a layout on release seeds, simulated or as it was kept.

        Raises
        ------
        BadInput, Diverged
            As `DesignProblem.evaluate` does.
        """
        drawn = tuple(seeds)

        def simulate() -> StoredEvaluation:
            return StoredEvaluation(problem.evaluate(layout, drawn), {})

        found = self._recall(_key(problem, layout, drawn), len(drawn), simulate)
        return replace(found.evaluation, layout=layout, seeds=drawn)

    def sample(
        self, problem: DesignProblem, layout: Layout, seeds: Mapping[str, Sequence[int]]
    ) -> StoredEvaluation:
        """Return what releases of some events cost with a layout, simulated or as it was kept.

        Parameters
        ----------
        seeds : mapping of str to sequence of int
            Release seeds by name of event; of every event as many as are wanted. The evaluation
            takes an event that has none as if nothing stood.

        Raises
        ------
        BadInput, Diverged
            As `DesignProblem.sample` does.
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
        """Return what is known by a key, or simulate it and keep it."""
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


def _release(problem: DesignProblem, layout: Layout, outcome: Outcome) -> Release:
    """Return what is kept of an outcome."""
    bill = problem.site.bill(layout, outcome)
    failed = any(barrier.failed for barrier in outcome.barriers)
    return Release(bill.harm + bill.repair, outcome.road_volume, outcome.reached, failed)


def _sum(key: str, data: Any) -> str:
    """Return a checksum of a line, by which damage is noticed."""
    return hashlib.sha256((key + json.dumps(data)).encode()).hexdigest()[:16]


def _key(problem: DesignProblem, layout: Layout, seeds: Any) -> str:
    """Return a hash of all that an evaluation depends on."""
    asked = [__version__, mechanics(), problem.site, problem.targets, list(layout), seeds]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:32]
