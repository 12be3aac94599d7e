"""The scorer's side of a task: it simulates the requested releases, counts and limits them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from rigdda import BadInput, Error, Layout, check
from rigdda.agents.designers.catalogue import ensemble  # not that of `count_crossings`
from rigdda.agents.designers.store import Store, StoredEvaluation
from rigdda.agents.limits import SEED
from rigdda.app.exam.messages import (
    AnyReply,
    BatchReply,
    CrossingsReply,
    RefusedReply,
    ReleaseRequest,
    Tables,
    TaskOrder,
)
from rigdda.app.exam.task import ReleaseBudget, Task, count_crossings
from rigdda.barriers import from_table
from rigdda.envs import DesignProblem

BEYOND = "asked for more releases than its budget, past the count of its task"
"""Reason for a flag. A task refuses such requests itself, so the scorer receives none from it."""


class ReleaseCounter:
    """Simulates releases of a task for an entry, and counts them.

    Parameters
    ----------
    problems : sequence of DesignProblem
        The problems of the sections.
    budget : int
        Largest number of releases of all sections together.

    Attributes
    ----------
    used, refused : int
        Number of releases simulated so far, and number of requests that were refused because they
        exceeded the budget.
    flags : list of str
        Rules that the entry broke.
    """

    def __init__(self, problems: Sequence[DesignProblem], budget: int):
        self.problems, self.budget = tuple(problems), budget
        self.used = self.refused = 0
        self.flags: list[str] = []
        self._store = Store()

    def flag(self, reason: str) -> None:
        """Record that the entry broke a rule."""
        if reason not in self.flags:
            self.flags.append(reason)

    def answer(self, request: ReleaseRequest) -> AnyReply:
        """Return the reply to a request; a refusal says what is wrong."""
        try:
            return self.ask(request)
        except BadInput as bad:
            return RefusedReply(bad.field, str(bad.value), bad.hint)
        except (Error, msgspec.MsgspecError) as error:
            return RefusedReply("request", type(error).__name__, str(error))

    def ask(self, request: ReleaseRequest) -> BatchReply | CrossingsReply:
        """Return the releases of a request, which are counted.

        Raises
        ------
        BadInput
            If more releases are requested than are left, the layout is not feasible, or there is
            no such section or event.
        """
        count, left = request.releases, self.budget - self.used
        if count > left:
            self.refused += 1
            self.flag(BEYOND)
            hint = f"ask for at most the {left:,} that are left of {self.budget:,}"
            raise BadInput("releases", count, hint)
        place = check.integer("section", request.section, 0, len(self.problems) - 1)
        reply = self._simulate(self.problems[place], request)
        self.used += count
        return reply

    def _simulate(
        self, problem: DesignProblem, request: ReleaseRequest
    ) -> BatchReply | CrossingsReply:
        seeds = request.seeds
        if request.stations is not None and isinstance(seeds, dict):
            stations = np.array(request.stations)
            return CrossingsReply.of(ensemble(problem.site, seeds, stations))
        layout = problem.check(from_tables(request.layout))
        if isinstance(seeds, dict):
            found = self._store.sample(problem, layout, seeds)
        else:
            found = StoredEvaluation(self._store.evaluate(problem, layout, seeds), {})
        bare = replace(found.evaluation, layout=(), seeds=(), outcomes=())
        return BatchReply(StoredEvaluation(bare, found.releases))


def from_tables(tables: Tables) -> Layout:
    """Return the layout of the tables of a layout file.

    Raises
    ------
    BadInput
        If a table is invalid.
    """
    return tuple(from_table(f"layout[{i}]", table) for i, table in enumerate(tables))


def problems_of(order: TaskOrder) -> tuple[DesignProblem, ...]:
    """Return the problems of the sections of a task."""
    return tuple(DesignProblem(site, order.max_barriers) for site in order.sites)


def practice(site: str, budget: int = 500, seed: int = 0, max_barriers: int = 3) -> Task:
    """Return a task on any site for the development of an entry, as the exam would pose it.

    The releases are simulated in this process. Releases without barriers that designers of the
    package simulate on the site are counted, as in the exam, until another task is made.

    Parameters
    ----------
    site : str
        Name of a site, for example of the split "validation", or a TOML file.
    budget : int
        Number of releases.
    seed : int
        Seed of the task.
    max_barriers : int
        Largest number of barriers.

    Raises
    ------
    BadInput
        If there is no such site, or a number is outside its range.
    """
    problem = DesignProblem(site, max_barriers)
    releases = check.integer("budget", budget, 0)
    counter = ReleaseCounter([problem], releases)
    number = check.integer("seed", seed, 0, SEED)
    task = Task(problem, str(site), ReleaseBudget(releases), number, counter)
    count_crossings([task])
    return task
