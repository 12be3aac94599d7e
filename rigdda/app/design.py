"""Design of a layout for `rigdda design`: search, verification and conclusions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from rigdda import Layout
from rigdda.agents import designers
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import (
    CHOICE_STREAM,
    DesignResult,
    Entry,
    Progress,
    final_score,
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
)
from rigdda.app.interim_answer import InterimAnswer, Tell
from rigdda.app.remaining_risk import remaining_risk
from rigdda.app.reports.tables import EvaluationsFile
from rigdda.app.simulate import Tick
from rigdda.app.value_origins import Mark
from rigdda.app.verification import Verification
from rigdda.app.verified_frontier import with_frontier
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.comparison import same_structures
from rigdda.envs.problem import MISSED, UNDECIDED


def design(
    problem: DesignProblem,
    name: str,
    simulations: int,
    seed: int,
    releases: int,
    out: Path,
    tick: Tick,
    precision: float = 0.0,
    tell: Tell = lambda _: None,
    placeholders: Sequence[Mark] = (),
) -> tuple[DesignStudy, Store]:
    """Design a layout, then verify it and the layouts for comparison on new releases.

    If the layout misses a target, the layouts of the frontier are verified as well, see
    `with_verified_frontier`, and the best of all verified layouts is chosen. If it is undecided
    whether the layout meets the targets and a layout for comparison meets them, the best of these
    is chosen. The chosen layout is then verified on other releases than those of this choice.

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
        Called with the layouts that are known so far, the best one last. The first call comes
        within seconds.
    placeholders : sequence of Mark
        Values of the site file that are marked as placeholders, for the archive.

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
                evaluation = verify(free, layout, releases, seed, store, CHOICE_STREAM)
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
        cases = _verified(problem, verification, layouts, precision, begun, tick, tell)
        for case in cases:
            file.add(Entry(result.simulations, "verification", case.evaluation))
        front: tuple[TriedLayout, ...] = ()
        replaced = False
        done = begun + releases * len(cases)
        if cases[-1].evaluation.targets in (MISSED, UNDECIDED):
            tick(done, "verifying other layouts for the targets")
            searched = name not in SEARCHLESS
            result, front, replaced = with_frontier(problem, result, cases, check, searched)
    tick(done, "analysing the remaining risk, checking barriers")
    named = [(case.name, case.evaluation.layout) for case in cases]
    kept = archive.archive(problem, seed, named, store, placeholders)
    archive.write(out / archive.ARCHIVE_FILE, kept)
    found = _concluded(problem, cases, result, rule, verification, seed)
    return replace(found, frontier=front, replaced=replaced), store


SEARCHLESS = ("rule", "constant")
"""Designers whose layout is not replaced by a better one, because it is asked for itself."""


SEARCH = 0.5
"""Precision of the search over that of the verification [-]. The search without required checks, of
which nothing is built, has that of the verification."""


UNCHECKED = 0.5
"""Budget of the search without required checks over that of the search with them [-]."""


def search_budget(problem: DesignProblem, name: str, simulations: int) -> int:
    """Return the number of releases of all searches; the first search has `simulations`."""
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
    """Return the results of a designer and, if checks are required, those without required checks.

    The second result is None if its layout is not better than that of the first, which would be
    allowed without the condition, too. If it is better and meets its checks, it is the first
    result: a barrier may meet them below another one although it would not on its own. The first
    result has the releases of both searches.
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
    if final_score(free, unchecked.evaluation) >= final_score(free, result.evaluation):
        unchecked = None
    elif check_layout(free, unchecked.layout).satisfied:
        result, unchecked = replace(unchecked, tried=result.tried), None
    return replace(result, simulations=both), unchecked


def _verified(
    problem: DesignProblem,
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
        last = layouts[-1][1]  # layouts that may not be built are no alternatives to it
        choices = [
            case.evaluation
            for case, (_, layout) in zip(cases, layouts, strict=True)
            if layout == last or problem.fits(layout)
        ]
        if precision > 0.0 and verification.decided(choices, precision):
            break
    return cases


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
        left=remaining_risk(free, [case.evaluation for case in cases], result.tried, seed),
        rule=rule,
        checks=check_layout(free, chosen),
        other_checks={case.name: check_layout(free, case.evaluation.layout) for case in others},
    )
    other = done.unchecked
    if other is None or other.evaluation.releases < 2 * len(problem.site.events):
        return done
    return replace(done, compliance=verification.difference(chosen, other.evaluation.layout))


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
    if unchecked is not None and not same_structures(result.site, unchecked.layout, result.layout):
        found.insert(0, (WITHOUT_CHECKS, unchecked.layout))
    return found
