"""A store gives back exactly what was evaluated, and only that."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from valley import SITE, Valley

import rigdda.agents
from rigdda import BadInput, DoubtfulInput, Fence, Layout
from rigdda.agents.designers.store import Release, Store
from rigdda.envs import DesignProblem
from rigdda.envs.outcome_cache import unpack
from rigdda.envs.problem import Targets

FENCE = (Fence(20.0, 2.0, energy_class=500),)
PAIR = (Fence(16.2, 2.0, energy_class=100), Fence(25.0, 1.5, energy_class=250))
ASKED = {"block": (1, 2, 3), "group": (5, 6)}


@pytest.mark.parametrize("seeds", [(4,), (4, 5, 6)])
@pytest.mark.parametrize("layout", [(), FENCE, PAIR])
def test_an_evaluation_survives_the_file_to_the_bit(
    layout: Layout, seeds: tuple[int, ...], valley: Valley, tmp_path: Path
) -> None:
    file = tmp_path / "store.jsonl"
    written = Store(file).evaluate(valley, layout, seeds)
    store = Store(file)
    assert store.evaluate(valley, layout, seeds) == written
    assert (store.simulated, store.resumed) == (0, len(seeds))
    direct = valley.evaluate(layout, seeds)
    assert (written.objective, written.ci, written.seeds) == (direct.objective, direct.ci, seeds)
    assert written.outcomes == () and written.reach == direct.reach


def test_a_sample_keeps_what_each_release_cost(problem: DesignProblem, tmp_path: Path) -> None:
    file = tmp_path / "store.jsonl"
    written = Store(file).sample(problem, FENCE, ASKED)
    store = Store(file)
    assert store.sample(problem, FENCE, ASKED) == written
    assert (store.simulated, store.resumed) == (0, 5)
    outcomes = problem.sample(FENCE, ASKED)
    bills = [problem.site.bill(FENCE, outcome) for outcome in outcomes]
    kept = [release for name in ASKED for release in written.releases[name]]
    assert [r.bill for r in kept] == [bill.harm + bill.repair for bill in bills]
    assert [r.reached for r in kept] == [outcome.reached for outcome in outcomes]
    assert all(isinstance(release, Release) for release in kept)
    assert written.evaluation.objective == problem.judge(FENCE, outcomes).objective


def test_seeds_of_numpy_are_those_of_python(problem: DesignProblem, tmp_path: Path) -> None:
    file, seeds = tmp_path / "store.jsonl", (4, 5, 6)
    first = Store(file)
    written = first.evaluate(problem, (), seeds)
    (many,) = first.evaluate_many([(problem, FENCE, seeds)])
    batch, store = first.sample(problem, FENCE, ASKED), Store(file)
    for own in (np.array(seeds), [np.int64(4), 5, 6]):
        assert store.evaluate(problem, (), own) == written  # type: ignore[arg-type]
        assert [*store.evaluate_many([(problem, FENCE, own)])] == [many]  # type: ignore[list-item]
    arrays = {name: np.array(own) for name, own in ASKED.items()}
    assert store.sample(problem, FENCE, arrays) == batch  # type: ignore[arg-type]
    assert store.simulated == 0


@pytest.mark.parametrize("seeds", [(), (1, 1), (-1,), (0.5,), 3])
def test_seeds_that_no_release_has_are_refused(problem: DesignProblem, seeds: Any) -> None:
    store = Store()
    with pytest.raises(BadInput, match="seeds"):
        store.evaluate(problem, (), seeds)
    with pytest.raises(BadInput, match="seeds"):
        next(store.evaluate_many([(problem, (), seeds)]))
    if seeds != ():
        with pytest.raises(BadInput, match="seeds"):
            store.sample(problem, (), {"block": seeds})


@pytest.mark.parametrize("damage", ["objective", "volume", "sum", "line"])
def test_a_line_that_was_damaged_is_simulated_again(
    damage: str, valley: Valley, tmp_path: Path
) -> None:
    file = tmp_path / "store.jsonl"
    written = Store(file).sample(valley, FENCE, ASKED)
    line = json.loads(file.read_text())
    if damage == "objective":
        line["batch"]["evaluation"]["objective"] += 1.0
    elif damage == "volume":
        line["batch"]["releases"]["block"][0][1] += 1.0
    elif damage == "sum":
        line["sum"] = "0"
    else:
        line = [line]
    file.write_text("what is this\n" + 100_000 * "[" + "\n" + json.dumps(line) + "\n")
    with pytest.warns(DoubtfulInput, match="3 damaged lines"):
        store = Store(file)
    assert store.sample(valley, FENCE, ASKED) == written
    assert (store.simulated, store.resumed) == (5, 0)
    with pytest.warns(DoubtfulInput, match="3 damaged lines"):
        again = Store(file)
    again.sample(valley, FENCE, ASKED)
    assert (again.simulated, again.resumed) == (0, 5)


def test_another_question_is_simulated(valley: Valley, tmp_path: Path) -> None:
    file = tmp_path / "store.jsonl"
    Store(file).evaluate(valley, FENCE, (1, 2))
    store = Store(file)
    store.evaluate(valley, FENCE, (1, 3))
    store.evaluate(valley, (Fence(20.0, 2.1, energy_class=500),), (1, 2))
    store.evaluate(Valley(SITE, targets=Targets(reach=0.1)), FENCE, (1, 2))
    dearer = msgspec.structs.replace(SITE.prices, fence_base=400.0)
    store.evaluate(Valley(msgspec.structs.replace(SITE, prices=dearer)), FENCE, (1, 2))
    assert (store.simulated, store.resumed) == (8, 0)
    store.evaluate(Valley(SITE, kinds=("fence",)), FENCE, (1, 2))  # the same layout and releases
    assert (store.simulated, store.resumed) == (8, 2)


@pytest.mark.parametrize(
    "name, tail",
    [(name, b'{"key": "12') for name in ("cma", "convex", "pareto", "random", "tpe")]
    + [("random", b""), ("random", b"\x00\x00\n")],
)
def test_a_killed_search_goes_on_where_it_stopped(
    name: str, tail: bytes, valley: Valley, tmp_path: Path
) -> None:
    design = getattr(rigdda.agents, name).design
    file = tmp_path / "store.jsonl"
    whole = design(valley, 80, store=Store(file))
    lines = file.read_bytes().splitlines(keepends=True)
    half = len(lines) // 2
    file.write_bytes(b"".join(lines[:half]) + tail)
    with pytest.warns(DoubtfulInput) if tail.endswith(b"\n") else nullcontext():
        store = Store(file)
    assert design(valley, 80, store=store) == whole
    assert store.resumed > 0 and store.simulated > 0
    assert file.read_bytes().replace(b"\x00\x00\n", b"") == b"".join(lines)
    with pytest.warns(DoubtfulInput) if tail.endswith(b"\n") else nullcontext():
        again = Store(file)
    assert design(valley, 80, store=again) == whole
    assert again.simulated == 0


def test_an_event_that_was_not_released_is_not_known(problem: DesignProblem) -> None:
    """Releases without barriers complement the cost, not the probabilities."""
    targets = DesignProblem(problem.site, targets={"reach": 0.1})
    first, second = problem.site.event_names[:2]
    found = Store().sample(targets, (), {second: range(8)}).evaluation
    assert found.reach[first].releases == 0 and found.reach[second].releases == 8
    assert found.targets == "undecided"
    assert found.objective > 0.0


def test_a_store_keeps_outcomes_exactly(problem: DesignProblem, tmp_path: Path) -> None:
    layout = (Fence(17.0, 3.0, energy_class=1000),)
    store = Store(tmp_path / "kept.jsonl", outcomes=True)
    evaluation = problem.evaluate(layout, range(12))
    store.evaluate(problem, layout, range(12))
    again = Store(tmp_path / "kept.jsonl", outcomes=True)
    again.evaluate(problem, layout, range(12))
    assert (again.simulated, again.resumed) == (0, 12)
    for one in (store, again):
        (kept,) = one.stored_releases()
        assert (kept.layout, kept.seeds) == (layout, tuple(range(12)))
        assert tuple(unpack(kept.outcomes)) == evaluation.outcomes
    without = Store(tmp_path / "bare.jsonl")
    without.evaluate(problem, layout, range(12))
    assert [*without.stored_releases()] == []
    more = Store(tmp_path / "bare.jsonl", outcomes=True)
    more.evaluate(problem, layout, range(12))
    assert (more.simulated, more.resumed) == (12, 0)
    with pytest.raises(ValueError, match="damaged"):
        unpack(b"not packed")


def test_a_layout_asked_for_twice_does_not_shift_the_others(problem: DesignProblem) -> None:
    other = (Fence(FENCE[0].x + 1.0, 2.0, energy_class=250),)
    asks = [(problem, FENCE, range(8)), (problem, FENCE, range(8)), (problem, other, range(8))]
    found = list(Store().evaluate_many(asks))
    assert found[0] == found[1]
    assert found[2].objective == problem.evaluate(other, range(8)).objective
    assert not found[0].outcomes
    kept = list(Store(outcomes=True).evaluate_many(asks))
    assert kept[2].outcomes == problem.evaluate(other, range(8)).outcomes
