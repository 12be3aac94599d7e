"""What every designer is and returns, and how its releases are counted."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout, check
from rigdda.agents import limits
from rigdda.agents.bounds import on_bound
from rigdda.agents.seeds import release_seeds
from rigdda.agents.store import Batch, Store
from rigdda.envs import DesignProblem, Evaluation

Origin = Literal["start", "search"]


@dataclass(frozen=True, slots=True)
class Entry:
    """One evaluated layout.

    Parameters
    ----------
    simulations : int
        Releases that the designer has used so far, those of this layout included.
    stage : {"search", "semifinal", "final", "report", "verification", "front"}
        "semifinal", "final": one of the best, evaluated again on other releases; "report": the
        chosen one, on releases that chose nothing; "verification", "front": on releases that no
        search has seen.
    evaluation : Evaluation
        What the layout was worth on these releases, without their outcomes.
    """

    simulations: int
    stage: str
    evaluation: Evaluation


@dataclass(frozen=True, slots=True)
class History:
    """Every layout that a designer evaluated, in order; n of them in the search."""

    entries: tuple[Entry, ...]

    def stage(self, name: str) -> tuple[Entry, ...]:
        """Return the entries of one stage."""
        return tuple(entry for entry in self.entries if entry.stage == name)

    def best_so_far(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return simulations (n,) and the least objective up to then (n,) during the search."""
        searched = self.stage("search")
        objective = [entry.evaluation.objective for entry in searched]
        best = np.minimum.accumulate(np.array(objective, dtype=np.float64))
        return np.array([entry.simulations for entry in searched], dtype=np.int64), best


@dataclass(frozen=True, slots=True)
class DesignResult:
    """What a designer found.

    Parameters
    ----------
    layout : Layout
        The chosen layout.
    evaluation : Evaluation
        Its evaluation on releases that chose nothing, so it does not flatter; with a budget of less
        than about ten releases on those that chose it.
    history : History
        All evaluated layouts.
    simulations : int
        Releases that the designer used, its barrier-free ensemble included.
    origin : {"start", "search"}
        Whether the layout is one that the designer began with, or one that its search came to.
    on_bound : tuple of str
        What of the layout lies on a bound of the zone, of its kind or of the list of classes.
    seconds : float
        Processor time, all cores together; not compared.
    """

    layout: Layout
    evaluation: Evaluation
    history: History
    simulations: int
    origin: Origin
    on_bound: tuple[str, ...]
    seconds: float = field(compare=False)


Progress = Callable[[Entry], None]
"""Called after each evaluated layout."""

Proposals = Generator[Layout, Evaluation, None]
"""Yields layouts and is sent the evaluation of each."""


class Designer(Protocol):
    """A function that designs a layout within a budget of releases."""

    def __call__(
        self,
        problem: DesignProblem,
        simulations: int,
        seed: int = 0,
        progress: Progress | None = None,
        store: Store | None = None,
    ) -> DesignResult:
        """Return the best layout found with at most `simulations` releases."""
        ...


class Ledger:
    """Counts a designer's releases against its budget and keeps every evaluation.

    Attributes
    ----------
    starts : set of Layout
        Layouts that the designer begins with.
    known : tuple of Layout
        Layouts that need no search: whatever it finds must beat them in the final.
    """

    def __init__(
        self,
        problem: DesignProblem,
        simulations: int,
        seed: int,
        progress: Progress | None,
        store: Store | None,
    ):
        if not isinstance(problem, DesignProblem):
            raise BadInput("problem", problem, "give an envs.DesignProblem of the site")
        self.problem = problem
        self.budget = check.integer("simulations", simulations, 2, limits.RELEASES)
        self.seed = check.integer("seed", seed, 0, limits.SEED)
        self.used = 0
        self.starts: set[Layout] = {()}
        self.known: tuple[Layout, ...] = ()
        self.entries: list[Entry] = []
        self._progress = progress
        self._store = store or Store()
        self._begun = time.process_time()

    @property
    def left(self) -> int:
        """Releases that may still be used."""
        return self.budget - self.used

    def evaluate(self, layout: Layout, stage: str, releases: int) -> Evaluation:
        """Evaluate a layout on the first releases of the stream of a stage and enter it."""
        seeds = release_seeds(stage, self.seed, releases)
        evaluation = self._store.evaluate(self.problem, layout, seeds)
        self.used += releases
        self._enter(stage, evaluation)
        return evaluation

    def sample(
        self, layout: Layout, stage: str, start: Mapping[str, int], counts: Mapping[str, int]
    ) -> Batch:
        """Sample some releases of each event with a layout and enter what they say together.

        Parameters
        ----------
        stage : str
            Stream of the releases.
        start, counts : mapping of str to int
            By name of event: how many releases of the stream are passed over, how many are drawn.
        """
        drawn = {name: n for name, n in counts.items() if n > 0}
        seeds = {
            name: release_seeds(stage, self.seed, n, start.get(name, 0))
            for name, n in drawn.items()
        }
        batch = self._store.sample(self.problem, layout, seeds)
        self.used += sum(drawn.values())
        self._enter(stage, batch.evaluation)
        return batch

    def _enter(self, stage: str, evaluation: Evaluation) -> None:
        self.entries.append(Entry(self.used, stage, evaluation))
        if self._progress is not None:
            self._progress(self.entries[-1])

    def result(self, evaluation: Evaluation, origin: Origin | None = None) -> DesignResult:
        """Return the result whose layout has this evaluation, by default from where it is known."""
        layout = evaluation.layout
        return DesignResult(
            layout=layout,
            evaluation=evaluation,
            history=History(tuple(self.entries)),
            simulations=self.used,
            origin=origin or ("start" if layout in self.starts else "search"),
            on_bound=on_bound(self.problem, layout),
            seconds=time.process_time() - self._begun,
        )
