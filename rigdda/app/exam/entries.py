"""Entries of the exam for the methods of this package.

With fewer releases than a search needs, a search submits the best constant, except `random_search`,
which submits a random layout.
"""

from __future__ import annotations

from types import ModuleType

from rigdda import Layout
from rigdda.agents import designers
from rigdda.agents.designers import rule
from rigdda.agents.designers.constant import constant as best_constant
from rigdda.agents.designers.menu import Menu
from rigdda.app.exam.task import Task

LEAST = 60
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


def random_search(task: Task) -> Layout:
    """Build the best of random layouts."""
    return _search(task, "random") if task.left >= LEAST else random_layout(task)


def race(task: Task) -> Layout:
    """Build what the default designer finds."""
    return _search(task, "race")


def cma(task: Task) -> Layout:
    """Build what CMA-ES finds."""
    return _search(task, "cma")


def tpe(task: Task) -> Layout:
    """Build what the tree-structured Parzen estimator finds."""
    return _search(task, "tpe")


def convex(task: Task) -> Layout:
    """Build what mixed-integer programming on estimated effects finds."""
    return _search(task, "convex")


def value(task: Task) -> Layout:
    """Build the layout with the least forecast Z, from releases without barriers."""
    return _search(task, "value")


def _search(task: Task, name: str) -> Layout:
    """Return the layout of a designer."""
    if task.left < LEAST:
        return constant(task)
    designer: ModuleType = designers.module(name)
    result = designer.design(task.problem, task.left, task.seed, None, task.store())
    layout: Layout = result.layout
    return layout
