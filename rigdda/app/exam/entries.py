"""Entries of the exam for the methods of this package.

With fewer releases than a search needs, a search submits the best constant, except `random_search`,
which submits a random layout.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

from rigdda import Layout
from rigdda.agents import designers
from rigdda.agents.designers import rule
from rigdda.agents.designers.constant import constant as best_constant
from rigdda.agents.designers.menu import Menu
from rigdda.app.exam.task import Task

LEAST_RELEASES = 60
"""Least number of releases of a search."""


def nothing(task: Task) -> Layout:
    """Build nothing."""
    return ()


def constant(task: Task) -> Layout:
    """Build the constant that is best on average."""
    return best_constant(task.problem, Menu(task.problem))


def engineering_rule(task: Task) -> Layout:
    """Build what the engineering rule requires, if it fits into the money."""
    layout = rule.answer(task.problem).layout
    return layout if task.problem.fits(layout) else ()


def random_layout(task: Task) -> Layout:
    """Build a random layout."""
    return task.problem.decode(task.rng.uniform(*task.problem.bounds))


def searching(name: str) -> Callable[[Task], Layout]:
    """Return the entry that submits what a designer of the package finds."""

    def entry(task: Task) -> Layout:
        if task.left < LEAST_RELEASES:
            return random_layout(task) if name == "random" else constant(task)
        designer: ModuleType = designers.module(name)
        result = designer.design(task.problem, task.left, task.seed, None, task.store())
        layout: Layout = result.layout
        return layout

    return entry


random_search = searching("random")
race = searching("race")
cma = searching("cma")
tpe = searching("tpe")
convex = searching("convex")
value = searching("value")
policy = searching("policy")
