"""The helper around any optimiser."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigdda import BadInput
from rigdda.app.exam import entries
from rigdda.app.exam.ask_tell import AskTell
from rigdda.app.exam.counter import practice

SITE = "wide-narrow-2000000003"


def test_search_stays_within_the_budget_and_its_layouts_may_be_built() -> None:
    task = practice(SITE, budget=120)
    search, rng = AskTell(task, releases=9), np.random.default_rng(1)
    values = []
    while search.open:
        values.append(search(rng.uniform(size=search.size)))
    assert len(values) >= 10 and all(math.isfinite(v) for v in values)
    assert task.used == 90  # ten different layouts; a quarter of the budget is left for the best
    assert math.inf in [search(rng.uniform(size=search.size)) for _ in range(5)]
    before = task.used
    layout = search.best()
    assert before < task.used <= 120
    assert task.problem.fits(layout)


def test_same_point_costs_nothing_again() -> None:
    task = practice(SITE, budget=60)
    search = AskTell(task, releases=5)
    point = np.full(search.size, 0.7)
    value = search(point)
    used = task.used
    assert search(point) == value and task.used == used == 5
    direct = practice(SITE, budget=60).evaluate(search.layout(point), 5)
    assert value == direct.objective


def test_a_search_that_repeats_a_layout_ends() -> None:
    task = practice(SITE, budget=40)
    search, points = AskTell(task, releases=5), 0
    while search.open:
        search(np.full(search.size, 0.7))
        points += 1
    assert points == 60 and task.used == 5  # ten times the six layouts of the budget of the search
    assert task.problem.fits(search.best())


def test_kinds_and_ends_of_the_box() -> None:
    search = AskTell(practice(SITE, budget=0))
    assert search.layout(np.zeros(search.size)) == ()
    middle = np.tile([0.9, *[0.5] * (search.size // 3 - 1)], 3)
    assert search.layout(middle)[0].kind == search.task.kinds[0]
    assert not search.open
    assert search.best() == entries.constant(search.task)
    n = search.size
    for point in ([0.5], n * [math.nan], n * ["a"], [[1.0], [1.0, 2.0]], n * [None], n * [1j]):
        with pytest.raises(BadInput, match=f"point = .*: give {n} finite numbers from 0 to 1"):
            search(point)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["random_search", "race", "cma", "tpe", "convex"])
def test_searches_of_the_package_use_the_task_only(name: str) -> None:
    task = practice(SITE, budget=100)
    layout = getattr(entries, name)(task)
    assert task.problem.fits(layout)
    assert 0 <= task.used <= 100


def test_within_limits_money_and_releases() -> None:
    task = practice(SITE, budget=100)
    small = task.within(50.0, 30)
    assert small.left == 30 and small.problem.max_cost == 50.0
    small.evaluate((), 10)
    assert (small.left, task.left) == (20, 90)
    assert small.site.capital(entries.constant(small)) <= 50.0
