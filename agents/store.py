"""Evaluations on disk, so that a search that was killed goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import msgspec

from envs import DesignProblem, Evaluation
from rigdda import Layout, __version__
from rigdda.kernel import source_hash


class Store:
    """Evaluates layouts and keeps each evaluation, looked up by all that determines it.

    A search asks for the same layouts on the same seeds when it is run again; what the store has
    is handed back instead of simulated. An entry of another site, objective, seed or version of
    the mechanics is never handed back.

    Parameters
    ----------
    path : path, optional
        A file of JSON lines, one an evaluation, appended to and flushed at once; a last line that
        a kill left unfinished is dropped. None: memory only.

    Attributes
    ----------
    simulated, resumed : int
        Releases simulated so far, and releases taken from the file instead.
    """

    def __init__(self, path: str | os.PathLike[str] | None = None):
        self.path = None if path is None else Path(path)
        self.simulated = self.resumed = 0
        self._known: dict[str, Evaluation] = {}
        if self.path is not None and self.path.is_file():
            self._read(self.path)

    def _read(self, path: Path) -> None:
        """Read the whole lines of the file and cut off the rest."""
        sound = 0
        with path.open("r+b") as file:
            for line in file:
                try:
                    data = json.loads(line)
                    evaluation = msgspec.convert(data["evaluation"], Evaluation)
                except (ValueError, KeyError, TypeError, msgspec.ValidationError):
                    break
                if not line.endswith(b"\n"):
                    break
                self._known[data["key"]] = evaluation
                sound += len(line)
            file.truncate(sound)

    def evaluate(self, problem: DesignProblem, layout: Layout, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a layout on release seeds, simulated or as it was kept.

        Raises
        ------
        BadInput, Diverged
            As `DesignProblem.evaluate` does.
        """
        key = _key(problem, layout, seeds)
        if key in self._known:
            self.resumed += len(seeds)
            return self._known[key]
        evaluation = problem.evaluate(layout, seeds)
        self.simulated += len(seeds)
        self._known[key] = evaluation
        if self.path is not None:
            line = json.dumps({"key": key, "evaluation": msgspec.to_builtins(evaluation)})
            with self.path.open("a") as file:
                file.write(line + "\n")
        return evaluation


def _key(problem: DesignProblem, layout: Layout, seeds: Sequence[int]) -> str:
    """Return a hash of all that an evaluation depends on."""
    limit = problem.cost_limit
    weights = [problem.objective(1.0, 0.0), problem.objective(0.0, limit), limit]
    asked = [__version__, mechanics(), problem.site, weights, list(layout), list(seeds)]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:32]


@cache
def mechanics() -> str:
    """Return the hash of the kernels that this process runs."""
    return source_hash()
