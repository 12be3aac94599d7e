"""The jobs of the command line, without a terminal: simulate a layout, design and verify one."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import rigdda
from agents import extra
from agents.crossings import ensemble, ensemble_seeds
from agents.pareto import ParetoResult, front
from agents.protocol import DesignResult, Entry
from agents.rule import kind_for, rule
from agents.store import Store
from agents.tables import EvaluationsFile
from agents.verify import verify
from envs import DesignProblem, Evaluation
from rigdda import Layout, Outcome, Run, Site
from rigdda.barriers import describe

Tick = Callable[[int, str], None]
"""Called as a job goes on: releases done so far, and what is being done."""

NOTHING, RULE = "no barrier", "engineering rule"


@dataclass(frozen=True, slots=True)
class Study:
    """A designed layout beside what it is compared with.

    Parameters
    ----------
    problem : DesignProblem
        What was to be designed.
    result : DesignResult
        What the designer found; a front of cost against debris is verified like the cases.
    cases : tuple of (str, Evaluation)
        No barrier, the engineering rule, the found layout: verified on the same releases, that
        no search has seen.
    """

    problem: DesignProblem
    result: DesignResult
    cases: tuple[tuple[str, Evaluation], ...]


def simulate(
    site: Site, layout: Layout, seeds: range, tick: Tick
) -> tuple[Run, tuple[Outcome, ...]]:
    """Return the first run and all outcomes of releases, simulated over all cores in threads.

    Raises
    ------
    BadInput
        If the layout does not stand on the slope.
    Diverged
        If a simulation diverges.
    """

    def one(seed: int) -> tuple[Run | None, Outcome]:
        run, outcome = rigdda.release(site, layout, seed)
        return (run if seed == seeds[0] else None), outcome

    found = []
    with ThreadPoolExecutor() as pool:
        for item in pool.map(one, seeds):
            found.append(item)
            tick(len(found), "simulating")
    first = found[0][0]
    assert first is not None
    return first, tuple(outcome for _, outcome in found)


def study(
    problem: DesignProblem,
    name: str,
    simulations: int,
    seed: int,
    releases: int,
    out: Path,
    tick: Tick,
) -> tuple[Study, Store]:
    """Design a layout, then verify it, the rule's and none at all on `releases` fresh releases.

    Writes `evaluations.csv` and the store `evaluations.jsonl` into `out` as it goes; a study that
    was killed takes up from the store what it asks for again.

    Raises
    ------
    BadInput, Diverged
        As the designer does.
    """
    design = extra.module(name).design
    store = Store(out / "evaluations.jsonl")
    tick(0, "looking at releases without barriers")
    ensemble(problem.site, ensemble_seeds(seed, simulations))
    with EvaluationsFile(out / "evaluations.csv") as file:

        def progress(entry: Entry) -> None:
            file.add(entry)
            tick(entry.simulations, f"{name}: {entry.stage}")

        result = design(problem, simulations, seed, progress, store)
        cases: list[tuple[str, Evaluation]] = []
        for case, layout in _cases(problem, name, result, simulations, seed):
            tick(simulations + releases * len(cases), f"verifying: {case}")
            evaluation = verify(problem, layout, releases, seed, store)
            file.add(Entry(result.simulations, "verification", evaluation))
            cases.append((case, evaluation))
        if isinstance(result, ParetoResult):
            tick(simulations + releases * len(cases), "verifying: the front")
            seen = [verify(problem, e.layout, releases, seed, store) for e in result.front]
            result = replace(result, front=front(seen))
    return Study(problem, result, tuple(cases)), store


def files(name: str) -> tuple[str, ...]:
    """Return the names of what `study` and `write` leave for a designer."""
    found = ("evaluations.csv", "evaluations.jsonl", "layout.toml", "profile.png", "search.png")
    front = ("front.csv", "front.png") if name == "pareto" else ()
    return (*found, "episode.rrd", *front)


def _cases(
    problem: DesignProblem, name: str, result: DesignResult, simulations: int, seed: int
) -> list[tuple[str, Layout]]:
    """Return what is verified: no barrier, the rule, and the designer's layout if it is another."""
    if name == "rule":
        return [(NOTHING, ()), (RULE, result.layout)]
    looked = ensemble(problem.site, ensemble_seeds(seed, simulations))
    return [
        (NOTHING, ()),
        (RULE, rule(problem.site, looked, kind_for(problem))),
        (f"optimised ({name})", result.layout),
    ]


def write(done: Study, out: Path) -> None:
    """Write `layout.toml`, `profile.png`, `search.png` and `episode.rrd` of a study into `out`.

    Of a front of cost against debris, `front.csv` and `front.png` as well.
    The release shown is the one whose debris is nearest the mean of the verified layout.
    """
    from agents import pictures
    from rigdda.replay import Marks

    site, (name, verified) = done.problem.site, done.cases[-1]
    _, nothing = done.cases[0]
    rigdda.save_layout(verified.layout, out / "layout.toml")
    before, _ = rigdda.release(site, (), verified.typical)
    after, outcome = rigdda.release(site, verified.layout, verified.typical)
    panels = [
        pictures.Panel(f"{NOTHING}: {_share(nothing)}", before),
        pictures.Panel(f"{name}: {_share(verified)}", after),
    ]
    pictures.profile(out / "profile.png", site, panels)
    pictures.search(out / "search.png", done.result.history, done.cases)
    if isinstance(done.result, ParetoResult):
        entries = [Entry(done.result.simulations, "front", e) for e in done.result.front]
        with EvaluationsFile(out / "front.csv") as file:
            for entry in entries:
                file.add(entry)
        pictures.front(out / "front.png", done.result.history, done.result.front, done.cases)
    notes = {
        "layout": "; ".join(map(describe, verified.layout)) or "no barrier",
        "release": f"seed {verified.typical}, {outcome.debris_fraction:.1%} past the road's edge",
        f"mean of {len(verified.seeds)}": _share(verified),
        "without barriers": _share(nothing),
        "objective": f"{verified.objective:.3f}, without barriers {nothing.objective:.3f}",
        "cost": f"{verified.cost:.1f} of {done.problem.cost_limit:g}",
    }
    title = f"{site.name}: {name}"
    after.to_rerun(out / "episode.rrd", Marks((site.road.start, site.road.end), notes, title))


def _share(evaluation: Evaluation) -> str:
    """Return the debris fraction of an evaluation in words."""
    low, high = evaluation.debris_ci
    words = f"{100 * evaluation.debris:.1f} % of the mass past the road's edge"
    return f"{words} (95 %: {100 * low:.1f} to {100 * high:.1f} %)"
