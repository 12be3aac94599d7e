"""Jobs of the command line that need no terminal: simulate a layout, design and verify a layout."""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

import rigdda
from rigdda import MECHANICS, Barrier, Layout, Outcome, Run, Site
from rigdda.agents import designers
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.frontier import TriedLayout, frontier
from rigdda.agents.designers.menu import Menu, on_bound
from rigdda.agents.designers.protocol import (
    CHOICE,
    DesignResult,
    Entry,
    Progress,
    best_of_finals,
    final_score,
    release_seeds,
    verify,
)
from rigdda.agents.designers.rule import RuleAnswer, answer
from rigdda.agents.designers.store import Store
from rigdda.app import archive
from rigdda.app.barrier_checks import check_layout
from rigdda.app.design_study import (
    AS_IT_STANDS,
    CONSTANT,
    NOTHING,
    WITHOUT_CHECKS,
    DesignStudy,
    VerifiedLayout,
    design_events,
)
from rigdda.app.reports import findings
from rigdda.app.reports.tables import EvaluationsFile
from rigdda.app.verification import InterimAnswer, Tell, Verification
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.envelope import largest
from rigdda.envs.outcome_cache import fingerprint
from rigdda.envs.problem import MISSED
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
    where = fingerprint(site).hex()
    asked = [rigdda.__version__, MECHANICS, where, list(layout), event, list(stations)]
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
    precision: float = 0.0,
    tell: Tell = lambda _: None,
) -> tuple[DesignStudy, Store]:
    """Design a layout, then verify it and the layouts for comparison on new releases.

    If the layout misses a target, the layouts of the frontier are verified as well, see
    `with_verified_frontier`, and the best of all verified layouts is taken. The releases of this
    choice are others than those on which the choice is verified.

    `evaluations.csv` and the store `evaluations.jsonl` are written into `out` during the search,
    and the archive of all outcomes at the end. A study that was interrupted reads the evaluations
    that it needs again from the store.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    name : str
        Name of the designer.
    simulations, releases : int
        Largest number of releases of the search, and of the verification of each layout.
    seed : int
        Seed of the search.
    out : path
        Folder of the results.
    tick : callable
        Called with the number of releases so far and a description.
    precision : float
        Precision of the answer relative to Z [-]. The verification ends when the order of the
        layouts is clear or Z is known to within it, and the search of a designer in
        `designers.STOPPING` when it gains less than `SEARCH` times it. With 0, or if the problem
        has targets, all releases are used.
    tell : callable
        Called with the layouts that are known so far, the best one last, first within seconds.

    Raises
    ------
    BadInput, Diverged
        The same errors as the designer.
    """
    store = Store(out / "evaluations.jsonl", outcomes=True)
    tick(0, "simulating releases without barriers")
    precision = 0.0 if problem.targets.given else precision
    free = problem.with_checks("reported")  # in which all layouts can be compared
    verification, rule = Verification(free, releases, seed, store), answer(free)
    begun, known = search_budget(problem, name, simulations), _unsearched(free, name, rule)
    with EvaluationsFile(out / "evaluations.csv", problem.site) as file:

        def progress(entry: Entry) -> None:
            file.add(entry)
            tick(entry.simulations, f"{name}: {entry.stage}")

        def check(layout: Layout, stage: str) -> Evaluation:
            if stage == "frontier":
                evaluation = verify(free, layout, releases, seed, store, CHOICE)
            else:
                evaluation = verification.evaluate(layout, len(verification.stages) - 1)
            file.add(Entry(result.simulations, stage, evaluation))
            return evaluation

        interim = InterimAnswer(verification, tell)
        interim.begin(known)
        result, unchecked = _searched(
            problem, name, simulations, seed, progress, store, precision, interim
        )
        layouts = [*known, *_found(name, result, rule, unchecked)]
        cases = _verified(verification, layouts, precision, begun, tick, tell)
        for case in cases:
            file.add(Entry(result.simulations, "verification", case.evaluation))
        front: tuple[TriedLayout, ...] = ()
        replaced = False
        done = begun + releases * len(cases)
        if cases[-1].evaluation.targets == MISSED and design_events(problem.site):
            tick(done, "verifying the frontier")
            searched = name not in SEARCHLESS
            result, front, replaced = with_frontier(problem, result, cases, check, searched)
    tick(done, "analysing the remaining risk, checking barriers")
    named = [(case.name, case.evaluation.layout) for case in cases]
    archive.write(out / archive.FILE, archive.archive(problem, seed, named, store))
    found = _concluded(problem, cases, result, rule, verification, seed)
    return replace(found, frontier=front, replaced=replaced), store


def _concluded(
    problem: DesignProblem,
    cases: Sequence[VerifiedLayout],
    result: DesignResult,
    rule: RuleAnswer,
    verification: Verification,
    seed: int,
) -> DesignStudy:
    """Return the study of verified layouts with their checks and the risk that remains."""
    free, chosen = verification.problem, cases[-1].evaluation.layout
    others = cases[:-1] if problem.checks == "required" else ()
    done = DesignStudy(
        problem=problem,
        cases=tuple(cases),
        result=result,
        left=_left(free, [case.evaluation for case in cases], result.tried, seed),
        rule=rule,
        checks=check_layout(free, chosen),
        other_checks={case.name: check_layout(free, case.evaluation.layout) for case in others},
    )
    other = done.unchecked
    if other is None or other.evaluation.releases < 2 * len(problem.site.events):
        return done
    return replace(done, compliance=verification.difference(chosen, other.evaluation.layout))


def _verified(
    verification: Verification,
    layouts: Sequence[tuple[str, Layout]],
    precision: float,
    begun: int,
    tick: Tick,
    tell: Tell,
) -> list[VerifiedLayout]:
    """Return layouts that are verified on the same releases, as many as the precision needs.

    `begun` is the number of releases before the verification, for the display of progress.
    """
    cases: list[VerifiedLayout] = []
    for stage, n in enumerate(verification.stages):
        cases = []
        for i, (case, layout) in enumerate(layouts):
            tick(begun + i * n, f"verifying: {case}")
            cases.append(VerifiedLayout(case, verification.evaluate(layout, stage)))
        tell(cases)
        evaluations = [case.evaluation for case in cases]
        if precision > 0.0 and verification.decided(evaluations, precision):
            break
    return cases


SEARCH = 0.5
"""Precision of the search over that of the verification [-]. The search without required checks, of
which nothing is built, has that of the verification."""

UNCHECKED = 0.5
"""Budget of the search without required checks over that of the search with them [-]."""


def search_budget(problem: DesignProblem, name: str, simulations: int) -> int:
    """Return the releases of all searches of a study, of which the first has `simulations`."""
    if problem.checks != "required" or name in SEARCHLESS:
        return simulations
    return simulations + max(2, int(UNCHECKED * simulations))


def _searched(
    problem: DesignProblem,
    name: str,
    simulations: int,
    seed: int,
    progress: Progress,
    store: Store,
    precision: float,
    interim: InterimAnswer,
) -> tuple[DesignResult, DesignResult | None]:
    """Return the results of a designer with and, if checks are required, without this condition.

    A layout of the second search that meets its checks is the first result if it is better: a
    barrier may meet them below another one although it would not on its own. The first result has
    the releases of both searches.
    """
    search = free_search = designers.module(name).design
    if name in designers.STOPPING:
        free_search = partial(search, precision=precision)
        search = partial(search, precision=SEARCH * precision)

    def first(entry: Entry) -> None:
        progress(entry)
        interim.consider(entry)

    result = search(problem, simulations, seed, first, store)
    more = search_budget(problem, name, simulations) - simulations
    if more == 0:
        return result, None

    def go_on(entry: Entry) -> None:
        progress(replace(entry, simulations=entry.simulations + result.simulations))

    free = problem.with_checks("reported")
    unchecked: DesignResult | None = free_search(free, more, seed, go_on, store)
    assert unchecked is not None
    both = result.simulations + unchecked.simulations
    better = final_score(free, unchecked.evaluation) < final_score(free, result.evaluation)
    if better and check_layout(free, unchecked.layout).satisfied:
        result, unchecked = replace(unchecked, tried=result.tried), None
    return replace(result, simulations=both), unchecked


SEARCHLESS = ("rule", "constant")
"""Designers whose layout is not replaced by a better one, because it is asked for itself."""

MOST_VERIFIED = 8
"""Largest number of layouts of a frontier that are verified in addition to the others."""


Check = Callable[[Layout, str], Evaluation]
"""Function that evaluates a layout on new releases of a stage: "frontier", by which one of several
layouts is chosen, or "verification"."""


def with_frontier(
    problem: DesignProblem,
    result: DesignResult,
    cases: list[VerifiedLayout],
    check: Check,
    searched: bool,
) -> tuple[DesignResult, tuple[TriedLayout, ...], bool]:
    """Return a result that misses a target with its verified frontier.

    If the layout was `searched` for, the best of all verified layouts takes its place in the result
    and in the last of the cases. Its verification has other releases than this choice.

    Returns
    -------
    result : DesignResult
        The result, with what the verification says of the layouts that were tried.
    frontier : tuple of TriedLayout
        The frontier.
    replaced : bool
        Whether the layout of the result was replaced.
    """
    judged = cache(lambda layout: check(layout, "frontier"))
    known = with_verified_frontier(problem, result.tried, cases, judged)
    result, front = replace(result, tried=known), frontier(known)
    if not searched:
        return result, front, False
    layouts = [c.evaluation.layout for c in cases[:-1] if problem.fits(c.evaluation.layout)]
    layouts += [one.layout for one in front if one.verified is not None]
    layouts.append(cases[-1].evaluation.layout)
    seen = [judged(layout) for layout in dict.fromkeys(layouts)]
    best = best_of_finals(problem, seen).layout
    if best == result.layout:
        return result, front, False
    others = {case.evaluation.layout: case.evaluation for case in cases[:-1]}
    evaluation = others[best] if best in others else check(best, "verification")
    cases[-1] = VerifiedLayout(cases[-1].name, evaluation)
    return _with_layout(problem, result, evaluation, list(others)), front, True


def with_verified_frontier(
    problem: DesignProblem,
    tried: Sequence[TriedLayout],
    cases: Sequence[VerifiedLayout],
    check: Callable[[Layout], Evaluation],
) -> tuple[TriedLayout, ...]:
    """Return all layouts that were tried, with those of their frontier verified if possible.

    The layout of the frontier with the lowest P(reach) that is not verified is verified, and then
    the frontier is determined again with its new probabilities, up to `MOST_VERIFIED` times. What
    the verification says of a layout replaces what the search said.

    Parameters
    ----------
    problem : DesignProblem
        The problem; its site has design events.
    tried : sequence of TriedLayout
        All layouts of the search.
    cases : sequence of VerifiedLayout
        Layouts that are verified already.
    check : callable
        Function that verifies a layout.

    Raises
    ------
    BadInput, Diverged
        The same errors as `check`.
    """
    known = {one.layout: one for one in tried}
    for case in cases:
        if problem.fits(case.evaluation.layout):
            one = TriedLayout.of(problem.site, case.evaluation)
            known[one.layout] = one
    for _ in range(MOST_VERIFIED):
        open_ = [one for one in frontier(known.values()) if one.verified is None]
        if not open_:
            break
        layout = min(open_, key=lambda one: one.level).layout
        known[layout] = TriedLayout.of(problem.site, check(layout))
    return tuple(known.values())


def _with_layout(
    problem: DesignProblem, result: DesignResult, verified: Evaluation, known: Sequence[Layout]
) -> DesignResult:
    """Return a result with another layout and its verified evaluation.

    The layout is one of those that need no search (`known`), or one of the search.
    """
    return replace(
        result,
        layout=verified.layout,
        evaluation=verified,
        origin="start" if verified.layout in known else "search",
        on_bound=on_bound(problem, verified.layout),
    )


def _unsearched(
    problem: DesignProblem, name: str, rule: RuleAnswer
) -> tuple[tuple[str, Layout], ...]:
    """Return the layouts for comparison that need no search: no barrier, the rule, the constant.

    The layout of the designer `name` is left out.
    """
    bare = AS_IT_STANDS if problem.site.existing else NOTHING
    out: list[tuple[str, Layout]] = [(bare, ())]
    if name != "rule":
        out.append((rule.name, rule.layout))
    if name != CONSTANT:
        out.append((CONSTANT, constant(problem, Menu(problem))))
    return tuple(out)


def _found(
    name: str, result: DesignResult, rule: RuleAnswer, unchecked: DesignResult | None
) -> list[tuple[str, Layout]]:
    """Return the layout that was found without required checks, if it differs, and the result."""
    words = {"rule": rule.name, CONSTANT: CONSTANT}.get(name, f"optimised ({name})")
    found = [(words, result.layout)]
    if unchecked is not None and unchecked.layout != result.layout:
        found.insert(0, (WITHOUT_CHECKS, unchecked.layout))
    return found


def _left(
    problem: DesignProblem,
    verified: Sequence[Evaluation],
    tried: Sequence[TriedLayout],
    seed: int,
) -> str:
    """Return a text on the risk that remains with the last of the verified layouts.

    The text also says if none of the largest barriers stops the event that causes most of this
    risk.
    """
    words, most = findings.left_over(verified[-1]), findings.worst(verified[-1])
    if most is None or any(e.reach[most].probability <= HOLDS for e in verified):
        return words
    if most in design_events(problem.site) and any(
        len(one.layout) == 1 and one.reach.releases and one.reach.probability <= HOLDS
        for one in tried
    ):
        return words
    trials = failed_trials(problem, most, seed)
    return f"{trials}: {words}" if trials else words


STATIONS = 3
"""Number of places in the zone where each kind is tried; the last one is near the road."""


LARGE = 0.9
"""Least size of a barrier that is tried, divided by the largest size of its kind [-]."""


RELEASES = 4
"""Number of releases of the event with each barrier that is tried."""


HOLDS = 0.5
"""An event counts as stopped if at most this share of its releases reaches the road [-]."""


def trial_layouts(problem: DesignProblem) -> tuple[Layout, ...]:
    """Return layouts with one of the largest barriers of each kind, at `STATIONS` places each.

    Mesh and removals are left out because they do not stop an event.
    """
    menu, found = Menu(problem), list[Barrier]()
    for kind in problem.kinds:
        barriers = (
            [menu.put(b.thickest(menu.zone), b.x) or b for b in menu.singles(kind)]
            if kind not in ("mesh", "removal")
            else []
        )
        least = LARGE * max((b.size for b in barriers), default=0.0)
        large = sorted((b for b in barriers if b.size >= least), key=lambda b: b.x)
        places = np.linspace(0, len(large) - 1, min(STATIONS, len(large))).round().astype(int)
        found += [large[i] for i in places.tolist()]
    return tuple((barrier,) for barrier in found)


def failed_trials(problem: DesignProblem, event: str, seed: int) -> str:
    """Return a text that says that none of the largest single barriers stops an event.

    The text is empty if one of them stops the event in half of the releases or more, or if none may
    be built.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    layouts = trial_layouts(problem)
    seeds = {event: release_seeds("ensemble", seed, RELEASES)}
    for layout in layouts:
        outcomes = problem.sample(layout, seeds)
        if sum(outcome.reached for outcome in outcomes) <= HOLDS * len(outcomes):
            return ""
    if not layouts:
        return ""
    volume = _volume(problem, event, seeds[event][0])
    return (
        f"none of {len(layouts)} large single barriers that were tried stops the event {event!r} "
        f"({volume:.2g} m3 per metre) in at least half of {RELEASES} releases"
    )


def _volume(problem: DesignProblem, event: str, seed: int) -> float:
    """Return the volume of rock in a release of an event [m3 per metre]."""
    blocks = problem.site.draw(seed, event).blocks
    return float(sum(polygon_properties(block.vertices)[0] for block in blocks))
