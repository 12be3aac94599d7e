"""The jobs of the command line, without a terminal: simulate a layout, design and verify one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import rigdda
from rigdda import Barrier, Layout, Outcome, Run, Site
from rigdda.agents import designers
from rigdda.agents.design_study import CONSTANT, NOTHING, RULE, DesignStudy, VerifiedLayout
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Entry, release_seeds, verify
from rigdda.agents.designers.store import Store
from rigdda.agents.reports import findings
from rigdda.agents.reports.tables import EvaluationsFile
from rigdda.envs import DesignProblem, Evaluation
from rigdda.geometry import polygon_properties

Tick = Callable[[int, str], None]
"""Called as a job goes on: releases done so far, and what is being done."""


CHUNK = 256
"""Releases that are simulated between two words about progress."""


def simulate(
    site: Site, layout: Layout, seeds: range, event: str | None, tick: Tick
) -> tuple[Run, list[Outcome]]:
    """Return the first run and all outcomes of releases, simulated over all cores.

    Raises
    ------
    BadInput
        If the layout does not stand on the slope, or there is no such event.
    Diverged
        If a simulation diverges.
    """
    run, _ = rigdda.release(site, layout, seeds[0], event)
    outcomes: list[Outcome] = []
    for start in range(0, len(seeds), CHUNK):
        part = seeds[start : start + CHUNK]
        outcomes += rigdda.release_many([(site, layout, seed, event) for seed in part])
        tick(len(outcomes), "simulating")
    return run, outcomes


def study(
    problem: DesignProblem,
    name: str,
    simulations: int,
    seed: int,
    releases: int,
    out: Path,
    tick: Tick,
) -> tuple[DesignStudy, Store]:
    """Design a layout, then verify it and what it is compared with on `releases` fresh releases.

    Writes `evaluations.csv` and the store `evaluations.jsonl` into `out` as it goes; a study that
    was killed takes up from the store what it asks for again.

    Raises
    ------
    BadInput, Diverged
        As the designer does.
    """
    store = Store(out / "evaluations.jsonl")
    tick(0, "looking at releases without barriers")
    with EvaluationsFile(out / "evaluations.csv") as file:

        def progress(entry: Entry) -> None:
            file.add(entry)
            tick(entry.simulations, f"{name}: {entry.stage}")

        result = designers.module(name).design(problem, simulations, seed, progress, store)
        cases: list[VerifiedLayout] = []
        for case, layout in _compared(problem, name, result, simulations, seed, store):
            tick(simulations + releases * len(cases), f"verifying: {case}")
            evaluation = verify(problem, layout, releases, seed, store)
            file.add(Entry(result.simulations, "verification", evaluation))
            cases.append(VerifiedLayout(case, evaluation))
    tick(simulations + releases * len(cases), "what is left")
    left = _left(problem, [case.evaluation for case in cases], seed)
    return DesignStudy(problem, result, tuple(cases), left), store


def _compared(
    problem: DesignProblem,
    name: str,
    result: DesignResult,
    simulations: int,
    seed: int,
    store: Store,
) -> list[tuple[str, Layout]]:
    """Return what is verified: nothing, the rule, the constant, and the designer's layout."""
    out: list[tuple[str, Layout]] = [(NOTHING, ())]
    for words, module in ((RULE, "rule"), (CONSTANT, "constant")):
        if module != name:
            found = designers.module(module).design(problem, simulations, seed, None, store)
            out.append((words, found.layout))
    words = {"rule": RULE, "constant": CONSTANT}.get(name, f"optimised ({name})")
    return [*out, (words, result.layout)]


def _left(problem: DesignProblem, verified: Sequence[Evaluation], seed: int) -> str:
    """Return what is left of the risk with the last of what was verified.

    And whether anything holds the event that makes most of it.
    """
    words, most = findings.left_over(verified[-1]), findings.worst(verified[-1])
    if most is None or any(e.reach[most].probability <= HOLDS for e in verified):
        return words
    held = unheld(problem, most, seed)
    return f"{held}: {words}" if held else words


STATIONS = 3
"""Places across the zone where each kind is tried, the last one near the road."""


LARGE = 0.9
"""Least size of what is tried over the largest that may be built of its kind [-]."""


RELEASES = 4
"""Releases of the event with each."""


HOLDS = 0.5
"""An event is held if at most this share of its releases reaches the road."""


def tried(problem: DesignProblem) -> tuple[Layout, ...]:
    """Return layouts of one barrier, of each kind the largest that may be built, at most places.

    Mesh is none of them: it makes an event rarer, and holds no part of it.
    """
    menu, found = Menu(problem), list[Barrier]()
    for kind in problem.kinds:
        barriers = (
            [menu.put(b.thickest(menu.zone), b.x) or b for b in menu.lone(kind)]
            if kind != "mesh"
            else []
        )
        least = LARGE * max((b.size for b in barriers), default=0.0)
        large = sorted((b for b in barriers if b.size >= least), key=lambda b: b.x)
        places = np.linspace(0, len(large) - 1, min(STATIONS, len(large))).round().astype(int)
        found += [large[i] for i in places.tolist()]
    return tuple((barrier,) for barrier in found)


def unheld(problem: DesignProblem, event: str, seed: int) -> str:
    """Return in words that no barrier holds an event, if none of the largest does; else nothing.

    Nothing, too, where none may be built.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    layouts = tried(problem)
    seeds = {event: release_seeds("ensemble", seed, RELEASES)}
    for layout in layouts:
        outcomes = problem.sample(layout, seeds)
        if sum(outcome.reached for outcome in outcomes) <= HOLDS * len(outcomes):
            return ""
    if not layouts:
        return ""
    volume = _volume(problem, event, seeds[event][0])
    return (
        f"no single barrier that may be built here stops the event {event!r} "
        f"({volume:.2g} m3 per metre), however large it is"
    )


def _volume(problem: DesignProblem, event: str, seed: int) -> float:
    """Return the rock that comes down in a release of an event [m3 per metre]."""
    blocks = problem.site.draw(seed, event).blocks
    return float(sum(polygon_properties(block.vertices)[0] for block in blocks))
