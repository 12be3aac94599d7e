"""A store gives back exactly what was evaluated, and only that."""

from __future__ import annotations

import json
import math
from pathlib import Path

import msgspec
import pytest

import agents
from agents.store import Store
from envs import DesignProblem
from rigdda import Ditch, Fence, GravityWall, Layout, Site, Wall

WALLS = (Wall(20.0, 2.0, 0.7),)
MIXED = (Fence(12.0, 2.0, 2e5), GravityWall(15.0, 1.0), Ditch(18.0, 0.5, 2.5))


@pytest.mark.parametrize("seeds", [(4,), (4, 5, 6)])
@pytest.mark.parametrize("layout", [WALLS, MIXED])
def test_an_evaluation_survives_the_file_to_the_bit(
    layout: Layout, seeds: tuple[int, ...], problem: DesignProblem, tmp_path: Path
) -> None:
    file = tmp_path / "store.jsonl"
    written = Store(file).evaluate(problem, layout, seeds)
    store = Store(file)
    assert store.evaluate(problem, layout, seeds) == written == problem.evaluate(layout, seeds)
    assert (store.simulated, store.resumed) == (0, len(seeds))


def test_a_line_that_is_no_evaluation_costs_no_other(
    problem: DesignProblem, tmp_path: Path
) -> None:
    file = tmp_path / "store.jsonl"
    first = Store(file)
    for seed in (1, 2):
        first.evaluate(problem, WALLS, (seed,))
    first.evaluate(problem, WALLS, (2,))
    assert (first.simulated, first.resumed) == (2, 0)  # nothing comes from a former run
    noise = b"what is this\n" + 100_000 * b"[" + b"\n\xff\xfe\n"
    file.write_bytes(noise + file.read_bytes())
    second = Store(file)
    for seed in (1, 2):
        second.evaluate(problem, WALLS, (seed,))
    assert (second.simulated, second.resumed) == (0, 2)


@pytest.mark.parametrize(
    "name, value",
    [
        ("objective", math.nan),
        ("objective", 0.5),
        ("debris", math.inf),
        ("seeds", [1, 3]),
        ("layout", []),
        ("outcomes", []),
        ("outcomes", [{}, {}]),
    ],
)
def test_an_evaluation_that_is_not_what_its_outcomes_are_worth_is_simulated_again(
    name: str, value: object, problem: DesignProblem, tmp_path: Path
) -> None:
    file = tmp_path / "store.jsonl"
    written = Store(file).evaluate(problem, WALLS, (1, 2))
    line = json.loads(file.read_text())
    if value == [{}, {}]:  # of the right number, but one is damaged
        value = line["evaluation"]["outcomes"]
        value[1]["max_energy_on_road"] = math.nan
    line["evaluation"][name] = value
    file.write_text(json.dumps(line) + "\n")
    store = Store(file)
    assert store.evaluate(problem, WALLS, (1, 2)) == written
    assert (store.simulated, store.resumed) == (2, 0)
    again = Store(file)
    again.evaluate(problem, WALLS, (1, 2))
    assert (again.simulated, again.resumed) == (0, 2)


def test_another_question_is_simulated(problem: DesignProblem, site: Site, tmp_path: Path) -> None:
    file = tmp_path / "store.jsonl"
    Store(file).evaluate(problem, WALLS, (1, 2))
    store = Store(file)
    store.evaluate(problem, WALLS, (1, 3))
    store.evaluate(problem, (Wall(20.0, 2.1, 0.7),), (1, 2))
    store.evaluate(DesignProblem(site, cost_weight=0.3), WALLS, (1, 2))
    store.evaluate(DesignProblem(site, cost_limit=10.0), WALLS, (1, 2))
    wetter = msgspec.structs.replace(site, scatter=msgspec.structs.replace(site.scatter))
    store.evaluate(DesignProblem(wetter), WALLS, (1, 2))
    assert (store.simulated, store.resumed) == (8, 2)
    looser = msgspec.structs.replace(site, motion=msgspec.structs.replace(site.motion, damping=0.3))
    store.evaluate(DesignProblem(looser), WALLS, (1, 2))
    assert store.simulated == 10


@pytest.mark.parametrize(
    "name, tail",
    [(name, b'{"key": "12') for name in ("cma", "pareto", "ppo", "random", "tpe")]
    + [("random", b""), ("random", b"\x00\x00\n")],
)
def test_a_killed_search_goes_on_where_it_stopped(
    name: str, tail: bytes, problem: DesignProblem, tmp_path: Path
) -> None:
    design = getattr(agents, name).design
    file = tmp_path / "store.jsonl"
    whole = design(problem, 48, store=Store(file))
    lines = file.read_bytes().splitlines(keepends=True)
    half = len(lines) // 2
    file.write_bytes(b"".join(lines[:half]) + tail)
    store = Store(file)
    assert design(problem, 48, store=store) == whole
    assert store.resumed > 0 and store.simulated > 0
    assert file.read_bytes().replace(b"\x00\x00\n", b"") == b"".join(lines)
    again = Store(file)
    assert design(problem, 48, store=again) == whole
    assert again.simulated == 0
