"""Planning of a corridor: fronts of the sections, and one choice of layouts for each budget.

The plan is made in four stages.

1. Every section is searched for a front of layouts (`rigdda.agents.designers.front`).
2. The layouts of all fronts are evaluated on a few new releases each. What happens without barriers
   is known from the stored releases of the site.
3. Further releases go to the layouts of which a wrong choice is likely and expensive, see
   `rigdda.agents.corridor.allocation`.
4. For every budget, an integer programme and the simple methods choose from the fronts. All chosen
   layouts are evaluated on releases that did not affect any choice, so that gains are unbiased.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rigdda import (
    MECHANICS,
    BadInput,
    Corridor,
    Layout,
    Outcome,
    __version__,
    check,
    distribution,
)
from rigdda.agents.corridor import allocation, programme
from rigdda.agents.corridor.programme import SIMPLE_METHODS, Choice, Increment, Options
from rigdda.agents.designers import front
from rigdda.agents.designers.front import SearchedFront
from rigdda.agents.designers.protocol import Entry
from rigdda.agents.designers.store import Store, identity
from rigdda.agents.limits import SEED
from rigdda.barriers import from_table, to_tables
from rigdda.envs import CorridorEvaluation, CorridorProblem, DesignProblem, Evaluation
from rigdda.envs.cost import Account, account
from rigdda.envs.intervals import Mean
from rigdda.files import atomic
from rigdda.seeds import derive, release_seeds

Floats = np.ndarray

SEARCH_SHARE, CHOICE_SHARE = 0.5, 0.3
"""Shares of the releases for the search of the fronts and for the choice [-]. The rest is for the
report."""

LEAST_PER_LAYOUT, USUAL_PER_LAYOUT = 10, 30
"""Least and usual number of releases of each layout before releases go to those at the margin. The
least number is used even if the releases for the choice do not suffice for it."""

ROUNDS = 12
"""Number of rounds after which the shadow prices are computed again."""

LEAST_REPORTED, MOST_REPORTED = 100, 5_000
"""Least and largest number of releases for the report of a layout. The least number is used even if
the releases for the report do not suffice for it."""

SCENARIOS = 400
"""Number of scenarios of the robust choice."""

DEVIATIONS = 1.96
"""Distance between a mean and a limit of its 95 % interval, in standard errors."""

CHOICES = "final"
"""Stream of the releases that affect choices."""

OPTIMUM = "integer programme"
"""Name of the choice by the integer programme."""

Tick = Callable[[int, str], None]
"""Called with the number of releases so far and a description of the activity."""


@dataclass(slots=True)
class Option:
    """A layout of a section with its evaluations.

    Attributes
    ----------
    layout : Layout
        The layout.
    cost, annual : float
        Construction cost [EUR/m] and annual cost [EUR/m and year].
    known : Evaluation or None
        Evaluation on the releases that affect choices, None before the first.
    account : Account or None
        Costs of these releases; None for the layout without barriers, which is known from the
        stored releases of the site.
    report, overall : Evaluation or None
        Evaluation on releases that do not affect any choice, and on all releases.
    """

    layout: Layout
    cost: float
    annual: float
    known: Evaluation | None = None
    account: Account | None = None
    report: Evaluation | None = None
    overall: Evaluation | None = None

    def add(self, problem: DesignProblem, outcomes: Sequence[Outcome]) -> None:
        """Add releases that affect choices."""
        new = account(problem.site, self.layout, outcomes)
        self.account = new if self.account is None else Account.join([self.account, new])
        self.known = problem.judge_account(self.layout, self.account)

    def add_report(self, problem: DesignProblem, evaluation: Evaluation) -> None:
        """Add an evaluation on releases that do not affect any choice, with its outcomes."""
        assert self.account is not None
        new = account(problem.site, self.layout, evaluation.outcomes)
        self.report = replace(evaluation, outcomes=())
        self.overall = problem.judge_account(self.layout, Account.join([self.account, new]))

    @property
    def releases(self) -> int:
        """Number of releases that affect choices."""
        return self.known.releases if self.known is not None else 0

    def value(self) -> Mean:
        """Return Z from the releases that affect choices [EUR/m and year]."""
        assert self.known is not None
        return Mean(self.known.objective, *self.known.ci)

    @property
    def error(self) -> float:
        """Standard error of Z [EUR/m and year]."""
        mean = self.value()
        return (mean.high - mean.low) / (2.0 * DEVIATIONS)

    def missed(self, problem: DesignProblem) -> float:
        """Return the largest excess of an upper bound over its target, see `Targets.excess` [-].

        All releases of the layout count, including those that do not affect any choice.
        """
        found = self.overall or self.known
        assert found is not None
        return problem.excess(found)


@dataclass(frozen=True, slots=True)
class BudgetPlan:
    """The choice for one budget and those of the simple methods.

    Parameters
    ----------
    budget : float
        Budget for construction [EUR].
    evaluation : CorridorEvaluation
        Evaluation of the chosen layouts on releases that did not affect any choice.
    methods : dict of str to CorridorEvaluation
        Evaluations of the choices of the simple methods, on the same releases.
    shadow_price : float or None
        Saving per year of one more euro of the budget [1/year], None if there is a yearly budget.
    following : tuple of Increment
        Next steps of the sections that would pay if there were more money, the best first. The
        yearly budget allows each of them alone.
    missed : dict of str to tuple of float
        Amount by which each section misses its targets with the choice of each method [-], see
        `Option.missed`.
    """

    budget: float
    evaluation: CorridorEvaluation
    methods: dict[str, CorridorEvaluation]
    shadow_price: float | None
    following: tuple[Increment, ...]
    missed: dict[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class CorridorPlan:
    """Plans of a corridor for several budgets.

    Parameters
    ----------
    problem : CorridorProblem
        The problem.
    fronts : tuple of tuples of Option
        Options of each section, the cheapest first.
    plans : tuple of BudgetPlan
        A plan for each budget; the last one is for unlimited money.
    releases : int
        Number of releases that were used, with those that an interrupted plan had stored.
    """

    problem: CorridorProblem
    fronts: tuple[tuple[Option, ...], ...]
    plans: tuple[BudgetPlan, ...]
    releases: int

    @property
    def unlimited(self) -> BudgetPlan:
        """The plan without a limit on the budget."""
        return self.plans[-1]


class Planner:
    """Plans a corridor.

    Parameters
    ----------
    problem : CorridorProblem
        The problem.
    releases : int
        Number of releases per section, of which those at the margin may go to other sections. With
        few of them, more are used: every layout of a front has at least `LEAST_PER_LAYOUT`, and at
        least two of each event, for the choice, and every chosen layout has at least
        `LEAST_REPORTED` for the report.
    seed : int
        Seed of the searches and of all releases.
    robust : bool
        Whether choices minimise the conditional value at risk instead of the expected cost.
    folder : path, optional
        Folder in which evaluations are stored, so that an interrupted plan can continue.
    tick : callable, optional
        Called with the number of releases and a description.
    margin : bool
        Whether the releases for the choice go to the layouts at the margin, instead of evenly to
        all.

    Raises
    ------
    BadInput
        If a number is outside its range.
    """

    def __init__(
        self,
        problem: CorridorProblem,
        releases: int = 4_000,
        seed: int = 0,
        robust: bool = False,
        folder: Path | None = None,
        tick: Tick | None = None,
        margin: bool = True,
    ):
        self.problem = problem
        self.releases = check.integer("releases", releases, 200, 10**7)
        self.seed = check.integer("seed", seed, 0, SEED)
        self.robust, self.margin = robust, margin
        self.used = 0
        self._tick = tick or (lambda done, words: None)
        self._folder = folder
        file = None if folder is None else folder / "evaluations.jsonl"
        self._store = Store(file, outcomes=True)
        self.fronts: list[list[Option]] = []

    def plan(self) -> CorridorPlan:
        """Return the plans for all budgets of the corridor.

        Raises
        ------
        Diverged
            If a simulation diverges.
        """
        self._search()
        self.compare()
        return self._choose()

    def _file(self, kind: str, *asked: object) -> Path | None:
        """Return the file of stored results that depend on some values, None without a folder."""
        if self._folder is None:
            return None
        key = msgspec.json.encode([__version__, MECHANICS, *asked])
        return self._folder / f"{kind}-{hashlib.sha256(key).hexdigest()[:16]}.json"

    def _seed(self, s: int) -> int:
        """Return the seed of the releases of a section."""
        return derive(self.seed, s)

    def _least(self, s: int) -> int:
        """Return the number of releases with which every event of a section has at least two."""
        return 2 * len(self.problem.problems[s].site.events)

    def _name(self, s: int) -> str:
        return self.problem.corridor.sections[s].name

    def _search(self) -> None:
        """Search the front of every section."""
        budget = int(SEARCH_SHARE * self.releases)
        asks = [(problem, budget, self._seed(s)) for s, problem in enumerate(self.problem.problems)]
        files = [self._file("front", identity(p), *ask) for p, *ask in asks]
        found = [_read(file) for file in files]
        new = distribution.mapped(
            self._searched if distribution.current() is None else _searched,
            [(s, *ask) for s, ask in enumerate(asks) if found[s] is None],
        )
        for s, problem in enumerate(self.problem.problems):
            self._tick(self.used, f"searching {self._name(s)}")
            searched = found[s]
            if searched is None:
                searched = next(new)
                _write(files[s], searched)
            site = problem.site
            options = [Option(own, site.capital(own), site.annual(own)) for own in searched.layouts]
            self.fronts.append(options)
            self.used += searched.releases

    def _searched(self, ask: tuple[int, DesignProblem, int, int]) -> SearchedFront:
        """Return the front of a section; report progress and store evaluations."""
        s, problem, budget, seed = ask
        begun, words = self.used, f"searching {self._name(s)}"

        def told(entry: Entry) -> None:
            self._tick(begun + entry.simulations, words)

        path = None if self._folder is None else self._folder / f"search-{s + 1:04d}.jsonl"
        return front.search(problem, budget, seed, told, Store(path))

    def evaluate(self, stream: str, wanted: Sequence[tuple[int, int, int]]) -> list[Evaluation]:
        """Evaluate options on releases of a stream; the evaluations contain the outcomes.

        `wanted` gives the section, the option and the number of releases. In the stream of choices,
        releases follow those of earlier batches.
        """
        asks = []
        for s, k, count in wanted:
            option = self.fronts[s][k]
            start = option.releases if stream == CHOICES else 0
            seeds = release_seeds(stream, self._seed(s), count, start)
            asks.append((self.problem.problems[s], option.layout, seeds))
        found = []
        for (s, _, count), evaluation in zip(wanted, self._store.evaluate_many(asks), strict=True):
            found.append(evaluation)
            self.used += count
            self._tick(self.used, f"evaluating {self._name(s)}")
        return found

    def _add(self, wanted: Sequence[tuple[int, int, int]]) -> None:
        """Evaluate options on further releases that affect choices."""
        found = self.evaluate(CHOICES, wanted)
        for (s, k, _), evaluation in zip(wanted, found, strict=True):
            self.fronts[s][k].add(self.problem.problems[s], evaluation.outcomes)

    def compare(self) -> None:
        """Evaluate the options for the choice: evenly, or where it changes the choice."""
        whole = int(CHOICE_SHARE * self.releases * len(self.fronts))
        built = [(s, k) for s, own in enumerate(self.fronts) for k, o in enumerate(own) if o.layout]
        for s, options in enumerate(self.fronts):
            options[0].known = self.problem.problems[s].nothing
        each = max(LEAST_PER_LAYOUT, whole // max(1, len(built)))
        first = max(LEAST_PER_LAYOUT, min(USUAL_PER_LAYOUT, each // 2)) if self.margin else each
        wanted = [(s, k, max(first, self._least(s))) for s, k in built]
        self._add(wanted)
        spent = sum(count for _, _, count in wanted)
        for done in range(ROUNDS if self.margin else 0):
            counts = allocation.batches(
                self.estimates(), self._prices(), whole * (done + 1) // ROUNDS - spent
            )
            wanted = [(s, k, n * allocation.BATCH_RELEASES) for (s, k), n in counts.items()]
            self._add(wanted)
            spent += sum(count for _, _, count in wanted)

    def estimates(self) -> list[allocation.Estimates]:
        """Return the estimates of the options of all sections as they are known so far."""
        found = []
        for length, options in zip(self.problem.lengths.tolist(), self.fronts, strict=True):
            releases = np.array([float(option.releases) for option in options])
            error = np.array([option.error for option in options])
            cost = np.array([option.cost for option in options])
            value = np.array([option.value().value for option in options])
            variance = error**2 * releases
            found.append(allocation.Estimates(length, cost, value, variance, releases))
        return found

    def _prices(self) -> list[float]:
        """Return the different shadow prices of all budgets [1/year]."""
        options = self.options()
        found = [programme.shadow_price(options, b) for b in self.problem.corridor.budgets]
        return sorted({*found, 0.0})

    def options(self) -> Options:
        """Return the options of all sections as they are known from the batches."""
        lengths = self.problem.lengths
        rows = list(zip(lengths.tolist(), self.fronts, self.problem.problems, strict=True))
        return Options(
            lengths,
            [length * np.array([o.cost for o in own]) for length, own, _ in rows],
            [length * np.array([o.annual for o in own]) for length, own, _ in rows],
            [length * np.array([o.value().value for o in own]) for length, own, _ in rows],
            [length * np.array([o.missed(p) for o in own]) for length, own, p in rows],
        )

    def _choose(self) -> CorridorPlan:
        """Choose for every budget, and evaluate what was chosen on new releases."""
        corridor, options = self.problem.corridor, self.options()
        yearly = corridor.yearly_budget
        unlimited = math.fsum(float(own.max()) for own in options.costs)
        budgets = [*corridor.budgets, unlimited]
        scenarios = self._scenarios() if self.robust else None
        choices: list[dict[str, Choice]] = []
        for budget in budgets:
            self._tick(self.used, "choosing")
            best = programme.optimum(options, budget, yearly, scenarios)
            others = {
                name: method(options, budget, yearly) for name, method in SIMPLE_METHODS.items()
            }
            choices.append({OPTIMUM: best, **others})
        self._report({(s, k) for own in choices for c in own.values() for s, k in enumerate(c)})
        known = self.options()
        plans = []
        for budget, own in zip(budgets, choices, strict=True):
            price = programme.shadow_price(options, budget) if yearly is None else None
            plans.append(
                BudgetPlan(
                    budget=budget,
                    evaluation=self._judged(own[OPTIMUM]),
                    methods={name: self._judged(own[name]) for name in SIMPLE_METHODS},
                    shadow_price=price,
                    following=_following(options, own[OPTIMUM], yearly),
                    missed={name: _missed(known, choice) for name, choice in own.items()},
                )
            )
        fronts = tuple(map(tuple, self.fronts))
        return CorridorPlan(self.problem, fronts, tuple(plans), self.used)

    def _report(self, chosen: set[tuple[int, int]]) -> None:
        """Evaluate chosen options on releases that did not affect any choice."""
        built = sorted((s, k) for s, k in chosen if k > 0)
        share = 1.0 - SEARCH_SHARE - CHOICE_SHARE
        each = int(share * self.releases * len(self.fronts) / max(1, len(built)))
        count = min(MOST_REPORTED, max(LEAST_REPORTED, each))
        found = self.evaluate("report", [(s, k, count) for s, k in built])
        for (s, k), evaluation in zip(built, found, strict=True):
            self.fronts[s][k].add_report(self.problem.problems[s], evaluation)

    def _judged(self, choice: Choice) -> CorridorEvaluation:
        """Return the evaluation of a choice from the reports of its options."""
        found = []
        for s, k in enumerate(choice):
            report = self.fronts[s][k].report
            found.append(report if report is not None else self.problem.problems[s].nothing)
        return self.problem.judge(found)

    def _scenarios(self) -> list[Floats]:
        """Return possible total costs of each option, drawn from their uncertainty."""
        rng = np.random.default_rng(self.seed)
        out = []
        for length, own in zip(self.problem.lengths.tolist(), self.fronts, strict=True):
            value = np.array([o.value().value for o in own])
            error = np.array([o.error for o in own])
            drawn = value + error * rng.standard_normal((SCENARIOS, len(own)))
            out.append(length * np.maximum(drawn, 0.0))
        return out


def _searched(ask: tuple[int, DesignProblem, int, int]) -> SearchedFront:
    """Return the front of a section that was sent to this worker."""
    _, problem, budget, seed = ask
    return front.search(problem, budget, seed)


class StoredFront(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of the file of a front: its layouts as tables, and the releases of its search."""

    layouts: list[list[dict[str, Any]]]
    releases: int


def _read(file: Path | None) -> SearchedFront | None:
    """Return the stored front of a section, None if there is none or it is damaged."""
    if file is None or not file.is_file():
        return None
    try:
        kept = msgspec.json.decode(file.read_bytes(), type=StoredFront)
        layouts = [tuple(from_table("front", row) for row in layout) for layout in kept.layouts]
    except (msgspec.MsgspecError, BadInput, TypeError):
        return None
    return SearchedFront(tuple(layouts), kept.releases)


def _write(file: Path | None, found: SearchedFront) -> None:
    """Store the front of a section."""
    if file is not None:
        kept = StoredFront([to_tables(layout) for layout in found.layouts], found.releases)
        with atomic(file) as part:
            part.write_bytes(msgspec.json.encode(kept))


def _missed(options: Options, choice: Choice) -> tuple[float, ...]:
    """Return the amount by which each section misses its targets with a choice [-]."""
    rows = zip(options.missed, choice, options.lengths.tolist(), strict=True)
    return tuple(float(own[k] / length) for own, k, length in rows)


def _following(options: Options, choice: Choice, yearly: float | None) -> tuple[Increment, ...]:
    """Return the next step of each section from its choice that would pay, the best first.

    The next step is that with the greatest saving per additional construction cost, of those that
    do not miss the targets more and that the yearly budget allows.
    """
    found, left = [], programme.spare(options, choice, yearly)
    for s, k in enumerate(choice):
        allowed = (options.missed[s] <= options.missed[s][k]) & (
            options.annual[s] - options.annual[s][k] <= left
        )
        cost, value = (
            options.costs[s] - options.costs[s][k],
            options.values[s][k] - options.values[s],
        )
        better = [j for j in range(len(cost)) if allowed[j] and cost[j] > 0.0 and value[j] > 0.0]
        if better:
            j = max(better, key=lambda i: value[i] / cost[i])
            found.append(Increment(s, k, j, float(cost[j]), float(value[j])))
    return tuple(sorted(found, key=lambda step: -step.saving / step.cost))


def plan(
    corridor: Corridor | CorridorProblem,
    releases: int = 4_000,
    seed: int = 0,
    robust: bool = False,
) -> CorridorPlan:
    """Return the plan of a corridor for all its budgets.

    Parameters
    ----------
    corridor : Corridor or CorridorProblem
        The corridor.
    releases : int
        Number of releases per section; with few of them, more are used, see `Planner`.
    seed : int
        Seed of the searches and of all releases.
    robust : bool
        Whether choices minimise the conditional value at risk instead of the expected cost.

    Raises
    ------
    BadInput, Diverged
        If an argument is outside its range; if a simulation diverges.
    """
    problem = corridor if isinstance(corridor, CorridorProblem) else CorridorProblem(corridor)
    return Planner(problem, releases, seed, robust).plan()
