"""Tasks of the exam: budgets of their own, seeds of any whole numbers, and refused requests."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import rigdda
from rigdda import BadInput, Simulation, lumped_mass
from rigdda.agents.designers import catalogue, value
from rigdda.app.exam import entrant
from rigdda.app.exam.counter import ReleaseCounter, practice, problems_of
from rigdda.app.exam.messages import FlagRequest, RefusedReply, ReleaseRequest, TaskOrder
from rigdda.app.exam.task import CorridorTask, Task
from rigdda.dynamics.single_block import SingleBlock

SITE = "wide-narrow-2000000003"
OTHER = "wide-narrow-2000000012"


@pytest.fixture
def road() -> CorridorTask:
    """Return a corridor of two sections with 20 releases each."""
    order = TaskOrder("road", [SITE, OTHER], [100.0, 100.0], 20_000.0, 2, 20, 0)
    return CorridorTask(order, ReleaseCounter(problems_of(order), 40))


@pytest.fixture(scope="module")
def task() -> Iterator[Task]:
    before = catalogue.ensemble
    yield practice(SITE, budget=10_000)
    catalogue.ensemble = before


def test_tasks_of_a_corridor_have_budgets_of_their_own(road: CorridorTask) -> None:
    one, two = (section.within(100.0, 20) for section in road.sections)
    one.evaluate((), 20)
    assert [(t.used, t.left) for t in (one, two)] == [(20, 0), (0, 20)]
    assert [(t.used, t.left) for t in road.sections] == [(20, 20), (0, 20)]
    assert (road.used, road.left) == (20, 20)
    assert two.evaluate((), 5).releases == 5
    assert (two.used, two.left, road.left) == (5, 15, 15)
    with pytest.raises(BadInput, match="at most the 0 that are left of 20"):
        one.evaluate((), 1)


def test_a_part_of_a_budget_ends_with_the_whole(road: CorridorTask) -> None:
    part = road.sections[0].within(100.0, 30)
    road.sections[1].evaluate((), 25)
    assert (part.budget, part.used, part.left) == (30, 0, 15)
    with pytest.raises(BadInput, match="at most the 15 that are left of 30"):
        part.evaluate((), 16)
    assert road.sections[0].within(100.0, 30).budget == 15
    assert part.within(50.0, 10).within(20.0, 4).evaluate((), 4).releases == 4
    assert (part.used, road.used) == (4, 29)


def test_releases_without_barriers_count_for_the_task_of_the_store(road: CorridorTask) -> None:
    one, two = (section.within(1e4, 20) for section in road.sections)
    for own in (two, one):
        found = value.design(own.problem, 20, 0, None, own.store())
        assert own.used == found.simulations == 20
    assert road.left == 0


@pytest.mark.parametrize("releases", [-1, 10.5, True, "10"])
def test_a_budget_that_is_no_number_of_releases_is_refused(task: Task, releases: object) -> None:
    with pytest.raises(BadInput, match=r"releases = .*give a whole number of at least 0"):
        task.within(100.0, releases)  # type: ignore[arg-type]


def test_seeds_may_be_numbers_of_numpy(task: Task) -> None:
    name = task.site.event_names[0]
    drawn, stations = [3, 5], np.array([task.problem.zone.start, task.problem.zone.end])
    for own in (np.array(drawn), tuple(np.array(drawn, dtype=np.uint64))):
        found = task.on_seeds((), own)  # type: ignore[arg-type]
        assert found == task.on_seeds((), drawn) and found.seeds == (3, 5)
        sampled = task.sample((), {name: own})  # type: ignore[dict-item]
        assert sampled == task.sample((), {name: drawn})
        crossed = task.crossings({name: own}, stations)  # type: ignore[dict-item]
        assert (crossed.crossings == task.crossings({name: drawn}, stations).crossings).all()


def test_seeds_that_are_no_distinct_whole_numbers_are_refused(task: Task) -> None:
    used, name = task.used, task.site.event_names[0]
    stations = np.array([task.problem.zone.end])
    for seeds, hint in (
        ([1, 1], "give each once"), ([-1], "whole number of at least 0"), ([0.5], "whole number")
    ):  # fmt: skip
        for ask in (
            lambda seeds=seeds: task.on_seeds((), seeds),
            lambda seeds=seeds: task.sample((), {name: seeds}),
            lambda seeds=seeds: task.crossings({name: seeds}, stations),
        ):
            with pytest.raises(BadInput, match=rf"seeds.*{hint}"):
                ask()
    for none in ({}, {name: []}):
        with pytest.raises(BadInput, match=r"seeds = .*give at least one seed of an event"):
            task.crossings(none, stations)
    with pytest.raises(BadInput, match="event = 'flood'"):
        task.crossings({"flood": []}, stations)
    assert task.used == used


@pytest.mark.parametrize("seeds", [{}, {"small, top": []}, {"small, top": [1, 1]}, {"flood": []}])
def test_the_scorer_refuses_crossings_without_distinct_releases(seeds: dict) -> None:
    order = TaskOrder(SITE, [SITE], [1.0], None, 2, 20, 0)
    counter = ReleaseCounter(problems_of(order), 0 if not any(seeds.values()) else 20)
    reply = counter.answer(ReleaseRequest(0, [], seeds, [5.0]))
    assert isinstance(reply, RefusedReply)
    assert (counter.used, counter.refused, counter.flags) == (0, 0, [])


class Told:
    """A connection that keeps what it is told."""

    def __init__(self) -> None:
        self.reasons: list[str] = []

    def tell(self, message: FlagRequest) -> None:
        self.reasons.append(message.reason)


def test_every_model_of_the_package_is_refused(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    for owner, name in (
        (Simulation, "__init__"), (SingleBlock, "run"), (lumped_mass, "trajectories")
    ):  # fmt: skip
        monkeypatch.setattr(owner, name, getattr(owner, name))  # restores it after the test
    line, site = Told(), task.site
    entrant.refuse_simulations(line)  # type: ignore[arg-type]
    for simulate in (
        lambda: rigdda.lumped(site, (), range(3)),
        lambda: rigdda.release(site, (), 1),
        lambda: rigdda.trajectories(site, (), None, range(3)),
    ):
        line.reasons = []
        with pytest.raises(BadInput, match=r"simulate with Task\.evaluate, which counts releases"):
            simulate()
        assert line.reasons and "instead of asking Task.evaluate" in line.reasons[0]
    assert rigdda.Site.load(site.name).event_names  # nothing else is refused
