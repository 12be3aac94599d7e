"""Tasks of the exam on which an entry works: a site, or a corridor of several sections.

The objects only send requests. The scorer simulates and counts the releases in another process.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from threading import Lock
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Site, check
from rigdda.agents.designers import catalogue
from rigdda.agents.designers.catalogue import CrossingEnsemble, seeds_by_event
from rigdda.agents.designers.store import Ask, Store, StoredEvaluation
from rigdda.app.exam.messages import (
    BatchReply,
    CrossingsReply,
    ReleaseRequest,
    Seeds,
    Tables,
    TaskOrder,
)
from rigdda.barriers import to_tables
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.observation import Arrays, observe
from rigdda.envs.outcome_cache import fingerprint
from rigdda.envs.problem import checked_seeds, is_vector
from rigdda.seeds import release_seeds


class Line(Protocol):
    """Connection to the scorer."""

    def ask(self, request: ReleaseRequest) -> BatchReply | CrossingsReply:
        """Return the reply to a request; `BadInput` if it is refused."""
        ...


class ReleaseBudget:
    """Number of releases that may be simulated, and of those that were.

    Parameters
    ----------
    releases : int
        Number of releases that may be simulated.
    whole : ReleaseBudget, optional
        Budget of which this one is a part: its releases are used as well.

    Attributes
    ----------
    used : int
        Number of releases used so far.
    """

    def __init__(self, releases: int, whole: ReleaseBudget | None = None):
        self.releases, self.used = releases, 0
        self._whole, self._lock = whole, Lock()

    @property
    def left(self) -> int:
        """Number of releases that may still be used, of this budget and of the whole."""
        own = self.releases - self.used
        return own if self._whole is None else min(own, self._whole.left)

    def use(self, releases: int) -> None:
        """Count releases that were simulated."""
        with self._lock:
            self.used += releases
        if self._whole is not None:
            self._whole.use(releases)


class Task:
    """A site on which an entry of the exam designs a layout.

    Parameters
    ----------
    problem : DesignProblem
        The design problem.
    name : str
        Name of the site.
    allowance : ReleaseBudget
        Budget of releases of the task.
    seed : int
        Seed of the task.
    line : Line
        Connection to the scorer.
    section : int
        Index of the section of a corridor; 0 for a single site.

    Attributes
    ----------
    budget : int
        Number of releases that may be simulated.
    rng : numpy.random.Generator
        Generator of random numbers, which depends on the seed and the task.
    """

    def __init__(
        self,
        problem: DesignProblem,
        name: str,
        allowance: ReleaseBudget,
        seed: int,
        line: Line,
        section: int = 0,
    ):
        self.problem, self.name, self.seed = problem, name, seed
        self.budget = allowance.releases
        self.rng = np.random.default_rng([seed, section, self.budget, *name.encode()])
        self._budget, self._line, self._section = allowance, line, section

    @property
    def site(self) -> Site:
        """The site: profile, surfaces, events with rates, prices, road, barrier zone."""
        return self.problem.site

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of barrier that may be built."""
        return self.problem.kinds

    @property
    def nothing(self) -> Evaluation:
        """Evaluation of the site without barriers; it costs no releases."""
        return self.problem.nothing

    @cached_property
    def observation(self) -> Arrays:
        """Observation of the site as in `rigdda/BarrierDesign-v0`; it costs no releases."""
        return observe(self.problem)

    @property
    def used(self) -> int:
        """Number of releases used so far by this task and those that `within` made of it."""
        return self._budget.used

    @property
    def left(self) -> int:
        """Number of releases that may still be used.

        It is limited by what is left of the corridor, or of the task of which `within` made this.
        """
        return self._budget.left

    def evaluate(
        self, layout: Sequence[Barrier] | ArrayLike, releases: int, start: int = 0
    ) -> Evaluation:
        """Evaluate a layout by simulating releases; the scorer counts them.

        All layouts are evaluated on the same releases of the task, counted from `start`. Give a
        `start` beyond the releases used so far for new ones, for example to compare the best
        layouts of a search without the bias of the selection.

        Parameters
        ----------
        layout : sequence of Barrier or (size,) array
            A feasible layout, or a vector for `DesignProblem.decode`.
        releases : int
            Number of releases, at least 1.
        start : int
            Number of the first release.

        Raises
        ------
        BadInput
            If more releases are requested than are left, or the layout is not feasible.
        """
        count = check.integer("releases", releases, 1)
        seeds = release_seeds("search", self.seed, count, check.integer("start", start, 0))
        return self.on_seeds(self.layout(layout), seeds)

    def layout(self, given: Sequence[Barrier] | ArrayLike) -> Layout:
        """Return the layout of a vector, or a checked layout.

        Raises
        ------
        BadInput
            If it is not feasible.
        """
        if isinstance(given, np.ndarray) or is_vector(given):
            return self.problem.decode(given)  # type: ignore[arg-type]
        return self.problem.check(given)  # type: ignore[arg-type]

    def on_seeds(self, layout: Layout, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a layout on release seeds, which are counted.

        Raises
        ------
        BadInput
            As `evaluate` does, and if the seeds are not distinct whole numbers.
        """
        drawn = checked_seeds("seeds", seeds)
        found = self._ask(to_tables(layout), list(drawn))
        assert isinstance(found, BatchReply)
        return replace(found.batch.evaluation, layout=layout, seeds=drawn)

    def sample(self, layout: Layout, seeds: Mapping[str, Sequence[int]]) -> StoredEvaluation:
        """Return releases of chosen events with a layout, which are counted.

        Raises
        ------
        BadInput
            As `evaluate` does, and if there is no such event, or the seeds of one are not distinct
            whole numbers.
        """
        found = self._ask(to_tables(layout), _lists(seeds))
        assert isinstance(found, BatchReply)
        return replace(found.batch, evaluation=replace(found.batch.evaluation, layout=layout))

    def crossings(
        self, seeds: Mapping[str, Sequence[int]], stations: NDArray[np.float64]
    ) -> CrossingEnsemble:
        """Return the crossings of stations in releases without barriers, which are counted.

        Raises
        ------
        BadInput
            If more releases are requested than are left, there are no seeds, there is no such
            event, or the seeds of one are not distinct whole numbers.
        """
        places = stations.tolist()
        found = self._ask([], _lists(seeds), places)
        assert isinstance(found, CrossingsReply)
        return found.ensemble(places)

    def _ask(
        self, layout: Tables, seeds: Seeds, stations: list[float] | None = None
    ) -> BatchReply | CrossingsReply:
        """Return the reply to a request for releases, if so many are left."""
        request = ReleaseRequest(self._section, layout, seeds, stations)
        if request.releases > self.left:
            hint = f"ask for at most the {self.left:,} that are left of {self.budget:,}"
            raise BadInput("releases", request.releases, hint)
        reply = self._line.ask(request)
        self._budget.use(request.releases)
        return reply

    def store(self) -> Store:
        """Return a store for `rigdda.agents` designers, whose evaluations the scorer computes."""
        return ScorerStore(self)

    def within(self, max_cost: float, releases: int) -> Task:
        """Return the same task with a largest capital cost [EUR/m] and a part of its budget.

        The part has at most the releases that are left. The releases of the new task are also
        counted for this one.

        Raises
        ------
        BadInput
            If a number is outside its range.
        """
        old = self.problem
        problem = DesignProblem(old.site, old.max_barriers, old.kinds, max_cost=max_cost)
        own = ReleaseBudget(min(check.integer("releases", releases, 0), self.left), self._budget)
        return Task(problem, self.name, own, self.seed, self._line, self._section)


def _lists(seeds: Mapping[str, Sequence[int]]) -> dict[str, list[int]]:
    """Return the checked seeds of each event as lists, which a message may contain."""
    return {name: list(own) for name, own in seeds_by_event(seeds).items()}


class ScorerStore(Store):
    """A store that asks the scorer for every evaluation."""

    def __init__(self, task: Task):
        super().__init__()
        self.task = task

    def evaluate(self, problem: DesignProblem, layout: Layout, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a layout on release seeds."""
        return self.task.on_seeds(layout, seeds)

    def evaluate_many(self, asks: Sequence[Ask]) -> Iterator[Evaluation]:
        """Yield the evaluations of several layouts."""
        for problem, layout, seeds in asks:
            yield self.evaluate(problem, layout, seeds)

    def sample(
        self, problem: DesignProblem, layout: Layout, seeds: Mapping[str, Sequence[int]]
    ) -> StoredEvaluation:
        """Return releases of some events with a layout."""
        return self.task.sample(layout, seeds)

    def crossings(
        self, site: Site, seeds: Mapping[str, Sequence[int]], stations: NDArray[np.float64]
    ) -> CrossingEnsemble:
        """Return the crossings of stations in releases without barriers."""
        return self.task.crossings(seeds, stations)


class CorridorTask:
    """A corridor on which an entry of the exam designs one layout for each section.

    Parameters
    ----------
    order : TaskOrder
        The corridor.
    line : Line
        Connection to the scorer.

    Attributes
    ----------
    sections : tuple of Task
        The sections. Each may use all releases of the corridor.
    lengths : (S,) array
        Their lengths [m].
    money : float
        Budget for construction [EUR].
    budget, seed : int
        Releases for all sections together, and seed of the task.
    rng : numpy.random.Generator
        Generator of random numbers, which depends on the seed and the task.
    """

    def __init__(self, order: TaskOrder, line: Line):
        self.name, self.seed = order.name, order.seed
        self.lengths = np.array(order.lengths)
        self.money = float(order.money or 0.0)
        self.budget = order.budget * len(order.sites)
        self.rng = np.random.default_rng([order.seed, order.budget, *order.name.encode()])
        self._budget = ReleaseBudget(self.budget)
        problems = [DesignProblem(site, order.max_barriers) for site in order.sites]
        self.sections = tuple(
            Task(problem, site, ReleaseBudget(self.budget, self._budget), order.seed, line, s)
            for s, (problem, site) in enumerate(zip(problems, order.sites, strict=True))
        )

    @property
    def used(self) -> int:
        """Number of releases used so far in all sections."""
        return self._budget.used

    @property
    def left(self) -> int:
        """Number of releases that may still be used."""
        return self._budget.left

    def cost(self, layouts: Sequence[Sequence[Barrier]]) -> float:
        """Return the construction cost of one layout for each section [EUR]."""
        pairs = zip(self.lengths.tolist(), self.sections, layouts, strict=True)
        return sum(length * own.site.capital(layout) for length, own, layout in pairs)


def make_task(order: TaskOrder, line: Line) -> Task | CorridorTask:
    """Return the task of an order."""
    if order.money is not None:
        return CorridorTask(order, line)
    problem = DesignProblem(order.sites[0], order.max_barriers)
    return Task(problem, order.name, ReleaseBudget(order.budget), order.seed, line)


SIMULATE = catalogue.ensemble
"""Simulation of releases without barriers that are not counted."""


def count_crossings(tasks: Sequence[Task]) -> None:
    """Count the releases without barriers that this package simulates on the sites of tasks.

    They are requested from the tasks. Designers request them from the store of a task, see
    `ScorerStore.crossings`; this function is for forecasts that are made without a designer.
    Releases of other sites, including those of earlier tasks, are simulated without being counted.
    """
    known = {own.problem.key: own for own in tasks}

    def ask(
        site: Site, seeds: Mapping[str, Sequence[int]], stations: NDArray[np.float64]
    ) -> CrossingEnsemble:
        task = known.get(fingerprint(site))
        return SIMULATE(site, seeds, stations) if task is None else task.crossings(seeds, stations)

    catalogue.ensemble = ask
