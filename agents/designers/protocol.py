"""What every designer is and returns, how its releases are counted, and the search that most share.

Seeds of releases come in disjoint streams for searching, choosing, reporting and verifying. Of two
layouts the better is that of lower Z, behind all others if a target is missed.
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
from rigdda.agents.designers.menu import on_bound
from rigdda.agents.designers.store import Store, StoredEvaluation
from rigdda.agents.limits import RELEASES, SEED
from rigdda.envs import DesignProblem, Evaluation

STREAMS = ("search", "semifinal", "final", "report", "ensemble", "verification")
"""search: all layouts of a search; semifinal, final: the best of them again, to choose; report: the
chosen one, whose value it tells without having chosen anything; ensemble: barrier-free releases
that a designer looks at; verification: seen by no search."""


def release_seeds(stream: str, seed: int, n: int, start: int = 0) -> tuple[int, ...]:
    """Return `n` release seeds of a stream, by default the first.

    A seed's remainder by the number of streams is its stream, so that no two streams share one,
    whatever the seeds of the searches.

    Parameters
    ----------
    stream : str
        One of `STREAMS`.
    seed : int
        Seed of the search, at least 0.
    n : int
        How many.
    start : int
        How many of the stream are passed over.

    Raises
    ------
    BadInput
        If the stream is unknown or a number is not whole or outside its range.
    """
    tag = STREAMS.index(check.one_of("stream", stream, STREAMS))
    entropy = [check.integer("seed", seed, 0), tag]
    count = check.integer("releases", n, 0, RELEASES)
    words = np.random.SeedSequence(entropy).generate_state(start + count)[start:]
    return tuple(int(word) * len(STREAMS) + tag for word in words)


MISSED = 1e6
"""What ranks layouts that miss a target behind all others [EUR per m and year]."""


def score(problem: DesignProblem, evaluation: Evaluation) -> tuple[float, float]:
    """Return what layouts are ranked by: how far a target is missed, then the objective.

    A target is missed by what the upper bound of its probability exceeds it; one that is met, or of
    which the releases do not tell, by nothing.
    """
    if evaluation.targets != "missed":
        return 0.0, evaluation.objective
    return shortfall(problem, evaluation), evaluation.objective


def final_score(problem: DesignProblem, evaluation: Evaluation) -> tuple[float, float]:
    """Return the same for finals, where what is undecided is not taken for met."""
    return shortfall(problem, evaluation), evaluation.objective


def shortfall(problem: DesignProblem, evaluation: Evaluation) -> float:
    """Return the most by which an upper bound of a design event exceeds its target [-]."""
    design = [event.name for event in problem.site.events if event.design]
    over = [0.0]
    for wanted, found in (
        (problem.targets.reach, evaluation.reach),
        (problem.targets.failure, evaluation.failure),
    ):
        if wanted is not None:
            over += [found[name].bound - wanted for name in design]
    return max(over)


def value(problem: DesignProblem, evaluation: Evaluation) -> float:
    """Return one number for searches that rank by one: those that miss a target come last."""
    missed, objective = score(problem, evaluation)
    if missed <= 0.0:
        return objective
    return max(objective, abs(problem.nothing.objective)) + MISSED * (1.0 + missed)


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
    site : Site
        The site that it designed for; not compared.
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

    site: Site = field(compare=False, repr=False)
    layout: Layout
    evaluation: Evaluation
    history: History
    simulations: int
    origin: Origin
    on_bound: tuple[str, ...]
    seconds: float = field(compare=False)

    def _repr_html_(self) -> str:
        """Return a picture of the layout and the table of its evaluation, for notebooks."""
        title = f"{self.site.name}: layout found with {self.simulations:,} releases"
        picture = display.png(self.site.section(self.layout), title)
        return display.image(picture, title) + self.evaluation._repr_html_()


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
        self.budget = check.integer("simulations", simulations, 2, RELEASES)
        self.seed = check.integer("seed", seed, 0, SEED)
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
    ) -> StoredEvaluation:
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
            site=self.problem.site,
            layout=layout,
            evaluation=evaluation,
            history=History(tuple(self.entries)),
            simulations=self.used,
            origin=origin or ("start" if layout in self.starts else "search"),
            on_bound=on_bound(self.problem, layout),
            seconds=time.process_time() - self._begun,
        )


Choose = Callable[[DesignProblem, Sequence[Evaluation], int], list[Evaluation]]
"""Returns at most so many of some evaluations."""

MOST = 100
"""Releases of a layout in a search at most: layouts that differ by 5 % of the gain differ by less
than their spread then, and the semifinals tell them apart."""


@dataclass(frozen=True, slots=True)
class Plan:
    """How a budget is spent: half for the search, half for who was best in it.

    A budget sees 80 layouts in the search, more once each has `MOST` releases. An eighth is for
    semifinals, a quarter for finals; an eighth reports what was chosen. Finals below 16 releases
    each choose nothing: then the best of the search is reported.
    """

    releases: int
    semifinalists: int
    semifinal_releases: int
    finalists: int
    final_releases: int
    report: int

    @classmethod
    def of(cls, simulations: int, most: int = 5) -> Plan:
        """Return the plan for a budget, with at most so many finalists."""
        report = max(1, simulations // 8)
        final = simulations // 4
        finalists = min(most, final // 16) if final >= 32 else 0
        semifinal = simulations // 8
        semifinalists = 3 * most if semifinal // (3 * most) >= 16 else 0
        return cls(
            releases=min(MOST, max(1, simulations // 160)),
            semifinalists=semifinalists,
            semifinal_releases=semifinal // semifinalists if semifinalists else 0,
            finalists=finalists,
            final_releases=final // finalists if finalists else 0,
            report=report,
        )

    @property
    def reserve(self) -> int:
        """Releases that are kept for the semifinals, the finals and the report."""
        semifinal = self.semifinalists * self.semifinal_releases
        return semifinal + self.finalists * self.final_releases + self.report


def best(problem: DesignProblem, evaluations: Sequence[Evaluation], n: int) -> list[Evaluation]:
    """Return those of the best `n` different layouts, the best first."""
    return ranked(problem, evaluations)[:n]


def search(
    ledger: Ledger, proposals: Proposals, choose: Choose = best, most: int = 5
) -> DesignResult:
    """Evaluate what is proposed as far as the budget goes, then the best on other releases.

    Parameters
    ----------
    ledger : Ledger
        Counts the releases.
    proposals : Proposals
        What is evaluated in the search.
    choose : callable
        Chooses who is in the finals, by default the best.
    most : int
        Finalists at most.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    plan = Plan.of(ledger.left, most)
    first = layout = next(proposals)
    while ledger.left >= plan.reserve + plan.releases:
        evaluation = ledger.evaluate(layout, "search", plan.releases)
        try:
            layout = proposals.send(evaluation)
        except StopIteration:
            break
    if not ledger.entries:  # too small a budget to compare anything
        return ledger.result(ledger.evaluate(first, "report", ledger.left))
    return finish(ledger, plan, choose)


def finish(ledger: Ledger, plan: Plan, choose: Choose = best) -> DesignResult:
    """Evaluate the best of a search on other releases, choose one, report it on yet others.

    No barrier at all and what needs no search, `Ledger.known`, are among the finalists, so that the
    choice is not worse: of a few releases in the search the luckiest layouts come out best.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
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
        winner = min(left, key=lambda e: final_score(problem, e))
    else:
        winner = choose(problem, left, 1)[0]
    return ledger.result(ledger.evaluate(winner.layout, "report", min(plan.report, ledger.left)))


def verify(
    problem: DesignProblem,
    layout: Layout,
    releases: int = 64,
    seed: int = 0,
    store: Store | None = None,
) -> Evaluation:
    """Return the evaluation of a layout on `releases` fresh releases.

    The seeds come from a stream of their own, so that the evaluation is unbiased whatever search
    found the layout. Layouts verified with the same `seed` meet the same releases.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    seeds = release_seeds("verification", seed, releases)
    return (store or Store()).evaluate(problem, layout, seeds)
