"""The jobs of the command line, without a terminal: simulate a layout, design and verify one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import rigdda
from rigdda import Layout, Outcome, Run, Site
from rigdda.agents import extra, findings
from rigdda.agents.largest import HOLDS, unheld
from rigdda.agents.protocol import DesignResult, Entry
from rigdda.agents.store import Store
from rigdda.agents.tables import EvaluationsFile
from rigdda.agents.verify import verify
from rigdda.envs import DesignProblem, Evaluation

Tick = Callable[[int, str], None]
"""Called as a job goes on: releases done so far, and what is being done."""

NOTHING, RULE, CONSTANT, SHED = "nothing", "rule", "constant", "rock shed"

CHUNK = 256
"""Releases that are simulated between two words about progress."""


@dataclass(frozen=True, slots=True)
class Case:
    """A layout that was verified on releases that no search has seen.

    Parameters
    ----------
    name : str
        What it is.
    evaluation : Evaluation
        What it is worth.
    """

    name: str
    evaluation: Evaluation


@dataclass(frozen=True, slots=True)
class Study:
    """A designed layout beside what it is compared with.

    Parameters
    ----------
    problem : DesignProblem
        What was to be designed.
    result : DesignResult
        What the designer found.
    cases : tuple of Case
        Nothing, the rule, the constant, what was found: the last.
    left : str
        What is left of the risk with what was found, in words.
    """

    problem: DesignProblem
    result: DesignResult
    cases: tuple[Case, ...]
    left: str

    @property
    def nothing(self) -> Case:
        """No barrier."""
        return self.cases[0]

    @property
    def chosen(self) -> Case:
        """What was found."""
        return self.cases[-1]


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
) -> tuple[Study, Store]:
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

        result = extra.module(name).design(problem, simulations, seed, progress, store)
        cases: list[Case] = []
        for case, layout in _compared(problem, name, result, simulations, seed, store):
            tick(simulations + releases * len(cases), f"verifying: {case}")
            evaluation = verify(problem, layout, releases, seed, store)
            file.add(Entry(result.simulations, "verification", evaluation))
            cases.append(Case(case, evaluation))
    tick(simulations + releases * len(cases), "what is left")
    left = _left(problem, [case.evaluation for case in cases], seed)
    return Study(problem, result, tuple(cases), left), store


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
            found = extra.module(module).design(problem, simulations, seed, None, store)
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
