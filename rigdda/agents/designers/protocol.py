"""Interface and results of designers, the budget of releases, and the search that most of them use.

Seeds of releases are taken from disjoint streams of `rigdda.seeds` for the search, the choice, the
report and the verification. Layouts are ranked by Z. Layouts that miss a target rank behind all
others.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from rigdda import (
    BadInput,
    Layout,
    Site,
    check,
    display,
)
from rigdda.agents.designers.catalogue import CrossingEnsemble, ensemble_seeds
from rigdda.agents.designers.frontier import Tally, TriedLayout, frontier
from rigdda.agents.designers.menu import on_bound
from rigdda.agents.designers.store import Store, StoredEvaluation
from rigdda.agents.limits import JOB_RELEASES, SEED
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.problem import MISSED
from rigdda.seeds import release_seeds

CHOICE_STREAM = "report"
"""Stream of the releases by which one of several verified layouts is chosen if a target is missed.
No search is guided by it."""


MISSED_TARGET_PENALTY = 1e6
"""Penalty of layouts that miss a target, which ranks them behind all others [EUR per m and
year]."""


def score(problem: DesignProblem, evaluation: Evaluation) -> tuple[float, float]:
    """Return the sort key of a layout: the amount by which it misses a target, then its objective.

    The amount is the excess of the upper bound over the target. It is 0 if the targets are met or
    undecided.
    """
    if evaluation.targets != MISSED:
        return 0.0, evaluation.objective
    return problem.excess(evaluation), evaluation.objective


def final_score(problem: DesignProblem, evaluation: Evaluation) -> tuple[float, float]:
    """Return the sort key of a layout in finals, where an undecided target counts as missed."""
    return problem.excess(evaluation), evaluation.objective


def best_of_finals(problem: DesignProblem, evaluations: Sequence[Evaluation]) -> Evaluation:
    """Return the best of some evaluations with many releases each.

    Layouts that are shown to miss a target are left out, unless all are. If the estimates of any
    remaining layout are within the targets, the best is the first by `final_score`. If none are,
    differences in the excess may be due to chance, and a layout that costs a multiple should not be
    preferred because of them. The best is then the layout with the lowest Z among those that are
    not shown to miss the targets by more than the first: the lower bounds of their excesses are not
    above the upper bound of the excess of the first.
    """
    evaluations = [e for e in evaluations if e.targets != MISSED] or evaluations
    first = min(evaluations, key=lambda e: final_score(problem, e))
    if any(problem.excess(e, "value") <= 0.0 for e in evaluations):
        return first
    most = problem.excess(first)
    alike = [e for e in evaluations if problem.excess(e, "lower") <= most]
    return min(alike, key=lambda e: e.objective)


def value(problem: DesignProblem, evaluation: Evaluation) -> float:
    """Return a single number to minimise; layouts that miss a target have the largest values."""
    missed, objective = score(problem, evaluation)
    if missed <= 0.0:
        return objective
    return max(objective, abs(problem.nothing.objective)) + MISSED_TARGET_PENALTY * (1.0 + missed)


def ranked(problem: DesignProblem, evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the evaluations of different layouts, the best first."""
    order = sorted(evaluations, key=lambda e: score(problem, e))
    return list({e.layout: e for e in reversed(order)}.values())[::-1]


Origin = Literal["start", "search"]


@dataclass(frozen=True, slots=True)
class Entry:
    """One evaluated layout.

    Parameters
    ----------
    simulations : int
        Number of releases that the designer has used so far, including those of this layout.
    stage : {"search", "semifinal", "final", "report", "verification", "front"}
        Stage of the evaluation. "semifinal", "final": one of the best layouts, evaluated again on
        other releases; "report": the chosen layout, on releases that did not affect the choice;
        "verification", "front": on releases that no search used.
    evaluation : Evaluation
        Evaluation of the layout on these releases, without their outcomes.
    """

    simulations: int
    stage: str
    evaluation: Evaluation


@dataclass(frozen=True, slots=True)
class History:
    """All evaluations of a designer in order, of which n are in the search."""

    entries: tuple[Entry, ...]

    def stage(self, name: str) -> tuple[Entry, ...]:
        """Return the entries of one stage."""
        return tuple(entry for entry in self.entries if entry.stage == name)


@dataclass(frozen=True, slots=True)
class DesignResult:
    """Result of a designer.

    Parameters
    ----------
    site : Site
        The site; it is ignored when results are compared.
    layout : Layout
        The chosen layout.
    evaluation : Evaluation
        Its evaluation on releases that did not affect the choice, which is therefore unbiased.
        With a budget of less than about ten releases, the releases of the choice are used.
    history : History
        All evaluations.
    simulations : int
        Number of releases that the designer used, including its ensemble without barriers.
    origin : {"start", "search"}
        Whether the layout is a result of the search. Otherwise it is one of the starting layouts,
        or was chosen without a search.
    on_bound : tuple of str
        Descriptions of the properties of the layout that lie on a bound of the zone, of the kind of
        barrier or of the list of energy classes.
    seconds : float
        Processor time of this process, on all cores [s]. The time of the workers of an executor
        does not count. It is ignored when results are compared.
    tried : tuple of TriedLayout
        What the search found out about every layout that it evaluated; empty if the site has no
        design events.
    """

    site: Site = field(compare=False, repr=False)
    layout: Layout
    evaluation: Evaluation
    history: History
    simulations: int
    origin: Origin
    on_bound: tuple[str, ...]
    seconds: float = field(compare=False)
    tried: tuple[TriedLayout, ...] = field(repr=False)

    @property
    def frontier(self) -> tuple[TriedLayout, ...]:
        """The cheapest layout for each level of P(reach) among all that the search evaluated.

        See `rigdda.agents.designers.frontier`.
        """
        return frontier(self.tried)

    def _repr_html_(self) -> str:
        """Return a picture of the layout and the table of its evaluation for notebooks."""
        title = f"{self.site.name}: layout found with {self.simulations:,} releases"
        picture = display.png(self.site.section(self.layout), title)
        return display.image(picture, title) + self.evaluation._repr_html_()


Progress = Callable[[Entry], None]
"""Called after each evaluated layout."""

Proposals = Generator[Layout, Evaluation, None]
"""Generator that yields layouts and receives the evaluation of each."""


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
    """Counts the releases of a designer against its budget and records all evaluations.

    Attributes
    ----------
    starts : set of Layout
        Starting layouts of the designer.
    known : tuple of Layout
        Layouts that need no search. They take part in the final.
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
        self.budget = check.integer("simulations", simulations, 2, JOB_RELEASES)
        self.seed = check.integer("seed", seed, 0, SEED)
        self.used = 0
        self.starts: set[Layout] = {()}
        self.known: tuple[Layout, ...] = ()
        self.entries: list[Entry] = []
        self._tally = Tally(problem.site)
        self._progress = progress
        self._store = store or Store()
        self._begun = time.process_time()

    @property
    def left(self) -> int:
        """Number of releases that may still be used."""
        return self.budget - self.used

    def evaluate(self, layout: Layout, stage: str, releases: int) -> Evaluation:
        """Evaluate a layout on the first releases of the stream of a stage and record it."""
        seeds = release_seeds(stage, self.seed, releases)
        evaluation = self._store.evaluate(self.problem, layout, seeds)
        self.used += releases
        counts = {
            name: (chance.releases, chance.count, evaluation.failure[name].count)
            for name, chance in evaluation.reach.items()
        }
        self._tally.add(layout, evaluation.cost, stage, counts, more=False)
        self._enter(stage, evaluation)
        return evaluation

    def sample(
        self, layout: Layout, stage: str, start: Mapping[str, int], counts: Mapping[str, int]
    ) -> StoredEvaluation:
        """Simulate some releases of each event with a layout and record their joint evaluation.

        Parameters
        ----------
        layout : Layout
            The layout.
        stage : str
            Stream of the releases.
        start, counts : mapping of str to int
            By name of event, the number of releases of the stream that are skipped and the number
            that is simulated.
        """
        drawn = {name: n for name, n in counts.items() if n > 0}
        seeds = {
            name: release_seeds(stage, self.seed, n, start.get(name, 0))
            for name, n in drawn.items()
        }
        batch = self._store.sample(self.problem, layout, seeds)
        self.used += sum(drawn.values())
        found = {
            name: (len(own), sum(r.reached for r in own), sum(r.failed for r in own))
            for name, own in batch.releases.items()
        }
        self._tally.add(layout, batch.evaluation.cost, stage, found, more=True)
        self._enter(stage, batch.evaluation)
        return batch

    def ensemble(self, stations: NDArray[np.float64]) -> CrossingEnsemble:
        """Return the ensemble without barriers of a search with this budget."""
        site = self.problem.site
        seeds = ensemble_seeds(site, self.seed, self.budget)
        found = self._store.crossings(site, seeds, stations)
        self.used += sum(map(len, seeds.values()))
        return found

    def _enter(self, stage: str, evaluation: Evaluation) -> None:
        self.entries.append(Entry(self.used, stage, evaluation))
        if self._progress is not None:
            self._progress(self.entries[-1])

    def result(self, evaluation: Evaluation, origin: Origin | None = None) -> DesignResult:
        """Return the result for the layout of an evaluation.

        The default of `origin` is "start" for layouts in `starts` and "search" for all others.
        """
        layout = evaluation.layout
        return DesignResult(
            site=self.problem.site,
            layout=layout,
            evaluation=evaluation,
            history=History(tuple(self.entries)),
            simulations=self.used,
            origin=origin or ("start" if layout in self.starts else "search"),
            on_bound=on_bound(self.problem, layout),
            seconds=time.process_time() - self._begun,
            tried=self._tally.tried(),
        )


Choose = Callable[[DesignProblem, Sequence[Evaluation], int], list[Evaluation]]
"""Function that chooses at most a given number of evaluations."""

MOST_SEARCHED = 100
"""Largest number of releases of a layout in a search. With this number, the standard error is
larger than a difference of 5 % of the gain; the semifinals distinguish such layouts."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Division of a budget: half for the search and half for the best layouts of the search.

    The search evaluates 80 layouts, or more if each of them has `MOST_SEARCHED` releases. An eighth
    of the budget is for semifinals, a quarter for finals and an eighth for the report. There are no
    finals if a finalist would have fewer than 16 releases. Then the best layout of the search is
    reported.
    """

    releases: int
    semifinalists: int
    semifinal_releases: int
    finalists: int
    final_releases: int
    report: int

    @classmethod
    def of(cls, simulations: int, most: int = 5) -> Plan:
        """Return the plan for a budget with at most `most` finalists."""
        report = max(1, simulations // 8)
        final = simulations // 4
        finalists = min(most, final // 16) if final >= 32 else 0
        semifinal = simulations // 8
        semifinalists = 3 * most if semifinal // (3 * most) >= 16 else 0
        return cls(
            releases=min(MOST_SEARCHED, max(1, simulations // 160)),
            semifinalists=semifinalists,
            semifinal_releases=semifinal // semifinalists if semifinalists else 0,
            finalists=finalists,
            final_releases=final // finalists if finalists else 0,
            report=report,
        )

    @property
    def reserve(self) -> int:
        """Number of releases that are reserved for the semifinals, the finals and the report."""
        semifinal = self.semifinalists * self.semifinal_releases
        return semifinal + self.finalists * self.final_releases + self.report


def best(problem: DesignProblem, evaluations: Sequence[Evaluation], n: int) -> list[Evaluation]:
    """Return the evaluations of the best `n` different layouts, the best first."""
    return ranked(problem, evaluations)[:n]


def search(
    ledger: Ledger, proposals: Proposals, choose: Choose = best, most: int = 5
) -> DesignResult:
    """Evaluate proposed layouts within the budget, then evaluate the best on other releases.

    Parameters
    ----------
    ledger : Ledger
        The ledger that counts the releases.
    proposals : Proposals
        Generator of the layouts.
    choose : callable
        Function that chooses the finalists, by default the best layouts.
    most : int
        Largest number of finalists.

    Raises
    ------
    BadInput, Diverged
        The same errors as `DesignProblem.evaluate`.
    """
    plan = Plan.of(ledger.left, most)
    first = layout = next(proposals)
    while ledger.left >= plan.reserve + plan.releases:
        evaluation = ledger.evaluate(layout, "search", plan.releases)
        try:
            layout = proposals.send(evaluation)
        except StopIteration:
            break
    if not ledger.entries:  # the budget is too small for a comparison
        return ledger.result(ledger.evaluate(first, "report", ledger.left))
    return finish(ledger, plan, choose)


def finish(ledger: Ledger, plan: Plan, choose: Choose = best) -> DesignResult:
    """Evaluate the best of a search on other releases, choose one, and report it on new releases.

    The finalists include no barrier and the layouts that need no search (`Ledger.known`), so that
    the choice is not worse than these. The evaluations of the best layouts in a search are biased,
    because layouts with favourable releases are selected.

    Raises
    ------
    BadInput, Diverged
        The same errors as `DesignProblem.evaluate`.
    """
    problem = ledger.problem
    left = [entry.evaluation for entry in ledger.entries if entry.stage == "search"]
    if plan.semifinalists > 0:
        chosen = choose(problem, left, plan.semifinalists)
        n = plan.semifinal_releases
        left = [ledger.evaluate(e.layout, "semifinal", n) for e in chosen]
    if plan.finalists > 0:
        known: list[Layout] = [(), *ledger.known]
        searched = [e.layout for e in choose(problem, left, plan.finalists)]
        found = [layout for layout in searched if layout not in known]
        layouts = [*found[: max(1, plan.finalists - len(known))], *known][: plan.finalists]
        left = [ledger.evaluate(layout, "final", plan.final_releases) for layout in layouts]
        winner = best_of_finals(problem, left)
    else:
        winner = choose(problem, left, 1)[0]
    return ledger.result(ledger.evaluate(winner.layout, "report", min(plan.report, ledger.left)))


def verify(
    problem: DesignProblem,
    layout: Layout,
    releases: int = 64,
    seed: int = 0,
    store: Store | None = None,
    stream: str = "verification",
) -> Evaluation:
    """Return the evaluation of a layout on `releases` new releases.

    The seeds are from a separate stream, so that the evaluation is unbiased for the result of any
    search. Layouts that are verified with the same `seed` are evaluated on the same releases. A
    choice among verified layouts must use another `stream` than the verification of the choice.

    Raises
    ------
    BadInput, Diverged
        The same errors as `DesignProblem.evaluate`.
    """
    seeds = release_seeds(stream, seed, releases)
    return (store or Store()).evaluate(problem, layout, seeds)
