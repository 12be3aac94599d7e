"""Jobs of the command line that need no terminal: simulate a layout, design and verify a layout."""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

import rigdda
from rigdda import Barrier, Layout, Outcome, Run, Site
from rigdda.agents import designers
from rigdda.agents.design_study import (
    AS_IT_STANDS,
    CONSTANT,
    NOTHING,
    RULE,
    DesignStudy,
    VerifiedLayout,
)
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Entry, release_seeds, verify
from rigdda.agents.designers.store import Store
from rigdda.agents.reports import findings
from rigdda.agents.reports.tables import EvaluationsFile
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.envelope import largest
from rigdda.envs.outcome_cache import mechanics
from rigdda.files import atomic
from rigdda.geometry import polygon_properties
from rigdda.passages import Passages, passages

Tick = Callable[[int, str], None]
"""Called during a job with the number of releases so far and a description of the activity."""


PARTS = "parts"
"""Folder of the releases of an unfinished job. It is removed when the tables are written."""

CHUNK, LEAST = 256, 16
"""Blocks that are simulated before they are written to disk, and least number of releases."""


class Simulated(NamedTuple):
    """Results of releases: the run of the first one, all outcomes, passages and stops."""

    run: Run
    outcomes: list[Outcome]
    passages: Passages
    resumed: int
    """Number of releases that an interrupted job with the same task left in the folder."""


def simulate(
    site: Site,
    layout: Layout,
    seeds: range,
    event: str | None,
    stations: Sequence[float],
    out: Path,
    tick: Tick,
) -> Simulated:
    """Simulate releases on all cores.

    Releases are written into `out/parts` as they are done. A job that was killed continues from
    there if it is given the same task, or a larger number of releases.

    Raises
    ------
    BadInput
        If the layout cannot be placed on the slope, a station is not within the profile, or there
        is no such event.
    Diverged
        If a simulation diverges.
    """
    tick(0, "simulating")
    run, _ = rigdda.release(site, layout, seeds[0], event)
    names = site.event_names if event is None else (event,)
    chunk = max(LEAST, CHUNK // max(largest(site, name) for name in names))
    asked = [rigdda.__version__, mechanics(), site, list(layout), event, list(stations)]
    key = hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:16]
    outcomes: list[Outcome] = []
    found: list[Passages] = []
    resumed = 0
    for start in range(0, len(seeds), chunk):
        part = seeds[start : start + chunk]
        file = out / PARTS / f"{key}-{part[0]}-{len(part)}.npz"
        known = _read_part(file, part)
        if known is None:
            own = rigdda.release_many([(site, layout, seed, event) for seed in part])
            passed = passages(site, layout, [(seed, event) for seed in part], stations)
            _write_part(file, own, passed)
        else:
            own, passed = known
            resumed += len(part)
        outcomes += own
        found.append(passed)
        tick(len(outcomes), "simulating")
    return Simulated(run, outcomes, Passages.join(found), resumed)


def _write_part(file: Path, outcomes: list[Outcome], found: Passages) -> None:
    """Write some releases to disk, all or nothing."""
    words = np.frombuffer(msgspec.msgpack.encode(outcomes), dtype=np.uint8)
    arrays = {name: getattr(found, name) for name in ("stations", "event", "table", "stops")}
    with atomic(file) as part, part.open("wb") as opened:
        np.savez(opened, outcomes=words, **arrays)


def _read_part(file: Path, seeds: range) -> tuple[list[Outcome], Passages] | None:
    """Return the releases of some seeds in a file, None if there is none or it is damaged."""
    try:
        with np.load(file) as stored:
            data = {name: stored[name] for name in stored.files}
        words = data.pop("outcomes").tobytes()
        return msgspec.msgpack.decode(words, type=list[Outcome]), Passages(
            seed=tuple(seeds), **data
        )
    except (
        OSError, KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile,
        msgspec.MsgspecError,
    ):  # fmt: skip
        return None


def forget(out: Path) -> None:
    """Remove the parts of a job whose tables are written."""
    shutil.rmtree(out / PARTS, ignore_errors=True)


def study(
    problem: DesignProblem,
    name: str,
    simulations: int,
    seed: int,
    releases: int,
    out: Path,
    tick: Tick,
) -> tuple[DesignStudy, Store]:
    """Design a layout, then verify it and the layouts for comparison on `releases` new releases.

    `evaluations.csv` and the store `evaluations.jsonl` are written into `out` during the search.
    A study that was interrupted reads the evaluations that it needs again from the store.

    Raises
    ------
    BadInput, Diverged
        The same errors as the designer.
    """
    store = Store(out / "evaluations.jsonl")
    tick(0, "simulating releases without barriers")
    with EvaluationsFile(out / "evaluations.csv", problem.site) as file:

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
    tick(simulations + releases * len(cases), "analysing the remaining risk")
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
    """Return the layouts to verify: no barrier, the rule, the constant and the designer's."""
    bare = AS_IT_STANDS if problem.site.existing else NOTHING
    out: list[tuple[str, Layout]] = [(bare, ())]
    for words, module in ((RULE, "rule"), (CONSTANT, "constant")):
        if module != name:
            found = designers.module(module).design(problem, simulations, seed, None, store)
            out.append((words, found.layout))
    words = {"rule": RULE, "constant": CONSTANT}.get(name, f"optimised ({name})")
    return [*out, (words, result.layout)]


def _left(problem: DesignProblem, verified: Sequence[Evaluation], seed: int) -> str:
    """Return a text on the risk that remains with the last of the verified layouts.

    The text also says if no barrier stops the event that causes most of this risk.
    """
    words, most = findings.left_over(verified[-1]), findings.worst(verified[-1])
    if most is None or any(e.reach[most].probability <= HOLDS for e in verified):
        return words
    held = unheld(problem, most, seed)
    return f"{held}: {words}" if held else words


STATIONS = 3
"""Number of places in the zone where each kind is tried; the last one is near the road."""


LARGE = 0.9
"""Least size of a barrier that is tried, divided by the largest size of its kind [-]."""


RELEASES = 4
"""Number of releases of the event with each barrier that is tried."""


HOLDS = 0.5
"""An event counts as stopped if at most this share of its releases reaches the road [-]."""


def tried(problem: DesignProblem) -> tuple[Layout, ...]:
    """Return layouts with one of the largest barriers of each kind, at `STATIONS` places each.

    Mesh and removals are left out because they do not stop an event.
    """
    menu, found = Menu(problem), list[Barrier]()
    for kind in problem.kinds:
        barriers = (
            [menu.put(b.thickest(menu.zone), b.x) or b for b in menu.lone(kind)]
            if kind not in ("mesh", "removal")
            else []
        )
        least = LARGE * max((b.size for b in barriers), default=0.0)
        large = sorted((b for b in barriers if b.size >= least), key=lambda b: b.x)
        places = np.linspace(0, len(large) - 1, min(STATIONS, len(large))).round().astype(int)
        found += [large[i] for i in places.tolist()]
    return tuple((barrier,) for barrier in found)


def unheld(problem: DesignProblem, event: str, seed: int) -> str:
    """Return a text that says that no single barrier stops an event.

    The text is empty if one of the largest barriers stops the event, or if none may be built.

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
    """Return the volume of rock in a release of an event [m3 per metre]."""
    blocks = problem.site.draw(seed, event).blocks
    return float(sum(polygon_properties(block.vertices)[0] for block in blocks))
