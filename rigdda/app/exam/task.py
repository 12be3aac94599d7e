"""Tasks of the exam on which an entry works: a site, or a corridor of several sections.

The objects only send requests. The scorer simulates and counts the releases in another process.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Site, check
from rigdda.agents.designers import catalogue
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
from rigdda.envs.problem import is_vector
from rigdda.seeds import release_seeds


class Line(Protocol):
    """Connection to the scorer; `used` is the number of releases simulated so far."""

    used: int

    def ask(self, request: ReleaseRequest) -> BatchReply | CrossingsReply:
        """Return the reply to a request; `BadInput` if it is refused."""
        ...


class Task:
    """A site on which an entry of the exam designs a layout.

    Parameters
    ----------
    problem : DesignProblem
        The design problem.
    name : str
        Name of the site.
    budget : int
        Number of releases that may be simulated.
    seed : int
        Seed of the task.
    line : Line
        Connection to the scorer.
    section : int
        Index of the section of a corridor; 0 for a single site.

    Attributes
    ----------
    rng : numpy.random.Generator
        Generator of random numbers, which depends on the seed and the task.
    """

    def __init__(
        self,
        problem: DesignProblem,
        name: str,
        budget: int,
        seed: int,
        line: Line,
        section: int = 0,
    ):
        self.problem, self.name, self.budget, self.seed = problem, name, budget, seed
        self.rng = np.random.default_rng([seed, section, budget, *name.encode()])
        self._line, self._section = line, section
        self._begun = line.used

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
        """Number of releases used so far."""
        return self._line.used - self._begun

    @property
    def left(self) -> int:
        """Number of releases that may still be used."""
        return self.budget - self.used

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
            As `evaluate` does.
        """
        found = self._ask(to_tables(layout), list(seeds))
        assert isinstance(found, BatchReply)
        return replace(found.batch.evaluation, layout=layout, seeds=tuple(seeds))

    def sample(self, layout: Layout, seeds: Mapping[str, Sequence[int]]) -> StoredEvaluation:
        """Return releases of chosen events with a layout, which are counted.

        Raises
        ------
        BadInput
            As `evaluate` does, and if there is no such event.
        """
        found = self._ask(to_tables(layout), {name: list(own) for name, own in seeds.items()})
        assert isinstance(found, BatchReply)
        return replace(found.batch, evaluation=replace(found.batch.evaluation, layout=layout))

    def crossings(
        self, seeds: Mapping[str, Sequence[int]], stations: NDArray[np.float64]
    ) -> catalogue.CrossingEnsemble:
        """Return the crossings of stations in releases without barriers, which are counted.

        Raises
        ------
        BadInput
            If more releases are requested than are left, or there is no such event.
        """
        drawn, places = {name: list(own) for name, own in seeds.items()}, stations.tolist()
        found = self._ask([], drawn, places)
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
        return self._line.ask(request)

    def store(self) -> Store:
        """Return a store for `rigdda.agents` designers, whose evaluations the scorer computes."""
        return ScorerStore(self)

    def within(self, max_cost: float, releases: int) -> Task:
        """Return the same task with a largest capital cost [EUR/m] and a budget of its own."""
        old = self.problem
        problem = DesignProblem(old.site, old.max_barriers, old.kinds, max_cost=max_cost)
        most = min(releases, self.left)
        return Task(problem, self.name, most, self.seed, self._line, self._section)


class ScorerStore(Store):
    """A store that asks the scorer for every evaluation."""

    def __init__(self, task: Task):
        super().__init__()
        self.task = task

    def evaluate(self, problem: DesignProblem, layout: Layout, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a layout on release seeds."""
        return self.task.on_seeds(layout, tuple(seeds))

    def evaluate_many(self, asks: Sequence[Ask]) -> Iterator[Evaluation]:
        """Yield the evaluations of several layouts."""
        for problem, layout, seeds in asks:
            yield self.evaluate(problem, layout, seeds)

    def sample(
        self, problem: DesignProblem, layout: Layout, seeds: Mapping[str, Sequence[int]]
    ) -> StoredEvaluation:
        """Return releases of some events with a layout."""
        return self.task.sample(layout, seeds)


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
        self._line = line
        problems = [DesignProblem(site, order.max_barriers) for site in order.sites]
        self.sections = tuple(
            Task(problem, site, self.budget, order.seed, line, s)
            for s, (problem, site) in enumerate(zip(problems, order.sites, strict=True))
        )

    @property
    def used(self) -> int:
        """Number of releases used so far in all sections."""
        return self._line.used

    @property
    def left(self) -> int:
        """Number of releases that may still be used."""
        return self.budget - self.used

    def cost(self, layouts: Sequence[Sequence[Barrier]]) -> float:
        """Return the construction cost of one layout for each section [EUR]."""
        pairs = zip(self.lengths.tolist(), self.sections, layouts, strict=True)
        return sum(length * own.site.capital(layout) for length, own, layout in pairs)


def make_task(order: TaskOrder, line: Line) -> Task | CorridorTask:
    """Return the task of an order."""
    if order.money is not None:
        return CorridorTask(order, line)
    problem = DesignProblem(order.sites[0], order.max_barriers)
    return Task(problem, order.name, order.budget, order.seed, line)


SIMULATE = catalogue.ensemble
"""Simulation of releases without barriers that are not counted."""


def count_crossings(tasks: Sequence[Task]) -> None:
    """Count the releases without barriers that the designers of the package simulate for tasks.

    The designers request these releases from the tasks. Releases of other sites, including those
    of earlier tasks, are simulated without being counted.
    """
    known = {own.problem.key: own for own in tasks}

    def ask(
        site: Site, seeds: Mapping[str, Sequence[int]], stations: NDArray[np.float64]
    ) -> catalogue.CrossingEnsemble:
        task = known.get(fingerprint(site))
        return SIMULATE(site, seeds, stations) if task is None else task.crossings(seeds, stations)

    catalogue.ensemble = ask
