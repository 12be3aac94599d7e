"""Evaluations on disk, so that a search that was killed goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import msgspec

import envs
import rigdda
from envs import DesignProblem, Evaluation
from rigdda import Barrier, Layout, __version__
from rigdda.kernel import source_hash

INFINITE = {"Infinity": math.inf, "-Infinity": -math.inf}
"""Constants of JSON lines: intervals of one release have no ends. Nothing that is kept is NaN."""


class Store:
    """Evaluates layouts and keeps each evaluation, looked up by all that determines it.

    A search asks for the same layouts on the same seeds when it is run again; what the store has
    is handed back instead of simulated. An entry of another site, objective, seed or version of
    the mechanics is never handed back.

    Parameters
    ----------
    path : path, optional
        A file of JSON lines, one an evaluation, appended to and flushed at once; a last line that
        a kill left unfinished is cut off, other lines that are no evaluation are passed over, and
        so is an evaluation that is not what its outcomes are worth. None: memory only.

    Attributes
    ----------
    simulated, resumed : int
        Releases simulated so far, and releases taken from the file instead.
    """

    def __init__(self, path: str | os.PathLike[str] | None = None):
        self.path = None if path is None else Path(path)
        self.simulated = self.resumed = 0
        self._known: dict[str, Evaluation] = {}
        self._kept: set[str] = set()
        if self.path is not None and self.path.is_file():
            self._read(self.path)

    def _read(self, path: Path) -> None:
        """Read the whole lines of the file and cut off a last one that is not whole."""
        text = path.read_bytes()
        whole = text.rfind(b"\n") + 1
        for line in text[:whole].splitlines():
            try:
                data = json.loads(line, parse_constant=INFINITE.__getitem__)
                self._known[data["key"]] = msgspec.convert(data["evaluation"], Evaluation)
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
        key = _key(problem, layout, seeds)
        if key in self._kept and not _sound(self._known[key], problem, layout, seeds):
            self._kept.remove(key)
            del self._known[key]
        if key in self._known:
            self.resumed += len(seeds) if key in self._kept else 0
            return self._known[key]
        evaluation = problem.evaluate(layout, seeds)
        self.simulated += len(seeds)
        self._known[key] = evaluation
        if self.path is not None:
            line = json.dumps({"key": key, "evaluation": msgspec.to_builtins(evaluation)})
            with self.path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        return evaluation


def _sound(
    kept: Evaluation, problem: DesignProblem, layout: Sequence[Barrier], seeds: Sequence[int]
) -> bool:
    """Return whether a kept evaluation is of these releases and what their outcomes are worth."""
    barriers = [len(outcome.barriers) for outcome in kept.outcomes]
    if barriers != [len(layout)] * len(seeds):
        return False
    return kept == problem.judge(tuple(layout), tuple(seeds), kept.outcomes)


def _key(problem: DesignProblem, layout: Layout, seeds: Sequence[int]) -> str:
    """Return a hash of all that an evaluation depends on."""
    limit = problem.cost_limit
    weights = [problem.objective(1.0, 0.0), problem.objective(0.0, limit), limit]
    asked = [__version__, mechanics(), problem.site, weights, list(layout), list(seeds)]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:32]


@cache
def mechanics() -> str:
    """Return a hash of all sources, and numba's version, that an evaluation depends on."""
    digest = hashlib.sha256(source_hash().encode())
    for name in (rigdda.__file__, envs.__file__):
        assert name is not None
        folder = Path(name).parent
        for path in sorted(folder.rglob("*.py")):
            if "validation" not in path.relative_to(folder).parts:
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
