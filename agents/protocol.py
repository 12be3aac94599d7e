"""What every designer is and returns, and the search that most of them share."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from agents import limits
from agents.seeds import release_seeds
from agents.store import Store
from envs import DesignProblem, Evaluation
from rigdda import Layout, check


@dataclass(frozen=True, slots=True)
class Entry:
    """One evaluated layout.

    Parameters
    ----------
    simulations : int
        Releases that the designer has simulated so far, those of this layout included.
    stage : {"search", "semifinal", "final", "verification", "front"}
        "semifinal", "final": one of the best, evaluated again on other releases; "verification",
        "front": on releases that no search has seen.
    evaluation : Evaluation
        The layout, its objective, debris and cost.
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
        Its evaluation on the releases that chose it among the best; none of them was searched on.
        Being the best of several it flatters a little: see `agents.verify`.
    history : History
        All evaluated layouts.
    simulations : int
        Releases that the designer used, its barrier-free ensemble included.
    """

    layout: Layout
    evaluation: Evaluation
    history: History
    simulations: int


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


@dataclass(frozen=True, slots=True)
class Plan:
    """How a budget is spent: releases a layout in the search and in the finals, and who is in them.

    One release's debris scatters by about 0.05 and common seeds hardly help (chaos decorrelates
    releases after a barrier), so a search averages 8 and the best five are told apart on 32. A
    budget keeps two fifths for the finals: below 400 with fewer releases of each, then fewer
    finalists; below 320 the search averages less, so that it still sees some 20 layouts. Of the
    hundreds of layouts of a long search the best five are the luckiest, so what is left of the two
    fifths is for semifinals.
    """

    releases: int
    semifinalists: int
    finalists: int
    final_releases: int

    @classmethod
    def of(cls, simulations: int, most: int = 5) -> Plan:
        """Return the plan for a budget, with at most so many finalists."""
        final = 2 * simulations // 5
        finalists = min(most, max(2, final // 16))
        final_releases = min(32, final // finalists)
        more = final // max(1, final_releases) - finalists
        semifinalists = more if more >= 2 * finalists else 0
        releases = min(8, max(1, simulations // 40))
        return cls(releases, semifinalists, finalists, final_releases)

    @property
    def reserve(self) -> int:
        """Releases that are kept for the semifinals and finals."""
        return (self.semifinalists + self.finalists) * self.final_releases


class Ledger:
    """Counts a designer's simulations against its budget and keeps every evaluation."""

    def __init__(
        self,
        problem: DesignProblem,
        simulations: int,
        seed: int,
        progress: Progress | None,
        store: Store | None,
    ):
        self.problem = problem
        self.budget = check.integer("simulations", simulations, 2, limits.RELEASES)
        self.seed = check.integer("seed", seed, 0, limits.SEED)
        self.used = 0
        self._progress = progress
        self._store = store or Store()
        self.entries: list[Entry] = []

    @property
    def left(self) -> int:
        """Releases that may still be simulated."""
        return self.budget - self.used

    def evaluate(self, layout: Layout, stage: str, releases: int) -> Evaluation:
        """Evaluate a layout on the first releases of a stream and enter it."""
        seeds = release_seeds(stage, self.seed, releases)
        evaluation = self._store.evaluate(self.problem, layout, seeds)
        self.used += releases
        self.entries.append(Entry(self.used, stage, evaluation))
        if self._progress is not None:
            self._progress(self.entries[-1])
        return evaluation

    def result(self, evaluation: Evaluation) -> DesignResult:
        """Return the result whose layout has this evaluation."""
        history = History(tuple(self.entries))
        return DesignResult(evaluation.layout, evaluation, history, self.used)


Choose = Callable[[Sequence[Evaluation], int], list[Evaluation]]
"""Returns at most so many of some evaluations."""


def best(evaluations: Sequence[Evaluation], n: int) -> list[Evaluation]:
    """Return those of the best `n` different layouts, the best first."""
    ranked = sorted(evaluations, key=lambda e: e.objective)
    return list({e.layout: e for e in reversed(ranked)}.values())[::-1][:n]


def search(
    ledger: Ledger, proposals: Proposals, choose: Choose = best, most: int = 5
) -> DesignResult:
    """Evaluate what is proposed as far as the budget goes, then the finalists on other releases.

    Parameters
    ----------
    ledger : Ledger
        Counts the releases.
    proposals : Proposals
        What is evaluated in the search.
    choose : callable
        Chooses who is in the finals, by default those of least objective.
    most : int
        Finalists at most.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    plan = Plan.of(ledger.left, most)
    layout = next(proposals)
    while ledger.left >= plan.reserve + plan.releases:
        evaluation = ledger.evaluate(layout, "search", plan.releases)
        try:
            layout = proposals.send(evaluation)
        except StopIteration:
            break
    return finish(ledger, plan, choose)


def finish(ledger: Ledger, plan: Plan, choose: Choose = best) -> DesignResult:
    """Evaluate the finalists of a search on other releases; return the best as the result.

    Semifinalists, if the plan has any, are those of least objective in the search, and finalists
    then those of least objective in the semifinals.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    left, releases = [entry.evaluation for entry in ledger.entries], plan.final_releases
    if plan.semifinalists > 0:
        chosen = choose(left, plan.semifinalists)
        left = [ledger.evaluate(e.layout, "semifinal", releases) for e in chosen]
    finalists = choose(left, plan.finalists)
    if releases > 0:
        finalists = [ledger.evaluate(e.layout, "final", releases) for e in finalists]
    return ledger.result(min(finalists, key=lambda e: e.objective))
