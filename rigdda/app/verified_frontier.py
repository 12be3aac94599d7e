"""Frontier of a missed target, with its layouts verified on new releases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

from rigdda import Layout
from rigdda.agents.designers.frontier import TriedLayout, frontier
from rigdda.agents.designers.menu import on_bound
from rigdda.agents.designers.protocol import (
    DesignResult,
    best_of_finals,
)
from rigdda.app.design_study import VerifiedLayout, design_events
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.problem import MET, MISSED

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
    """Return a result that misses a target, or may miss it, with its verified frontier.

    If the layout was `searched` for, the best of all verified layouts takes its place in the result
    and in the last of the cases. It is verified on other releases than those of this choice. There
    is a frontier only if the layout misses a target and the site has design events. A layout that
    may miss a target is replaced only by one that meets it.

    Returns
    -------
    result : DesignResult
        The result, with the verified values of the layouts that were verified.
    frontier : tuple of TriedLayout
        The frontier.
    replaced : bool
        Whether the layout of the result was replaced.
    """
    judged = cache(lambda layout: check(layout, "frontier"))
    missed = cases[-1].evaluation.targets == MISSED
    front: tuple[TriedLayout, ...] = ()
    if missed and design_events(problem.site):
        known = with_verified_frontier(problem, result.tried, cases, judged)
        result, front = replace(result, tried=known), frontier(known)
    if not searched:
        return result, front, False
    others = [c.evaluation for c in cases[:-1] if problem.fits(c.evaluation.layout)]
    if not missed:
        others = [e for e in others if e.targets != MISSED and judged(e.layout).targets == MET]
        if not others:
            return result, front, False
    layouts = [evaluation.layout for evaluation in others]
    layouts += [one.layout for one in front if one.verified is not None]
    layouts.append(cases[-1].evaluation.layout)
    seen = [judged(layout) for layout in dict.fromkeys(layouts)]
    best = best_of_finals(problem, seen).layout
    if best == result.layout:
        return result, front, False
    verified = {case.evaluation.layout: case.evaluation for case in cases[:-1]}
    evaluation = verified[best] if best in verified else check(best, "verification")
    cases[-1] = VerifiedLayout(cases[-1].name, evaluation)
    return _with_layout(problem, result, evaluation, list(verified)), front, True


def with_verified_frontier(
    problem: DesignProblem,
    tried: Sequence[TriedLayout],
    cases: Sequence[VerifiedLayout],
    check: Callable[[Layout], Evaluation],
) -> tuple[TriedLayout, ...]:
    """Return all layouts that were tried, with those of their frontier verified if possible.

    The layout of the frontier with the lowest P(reach) that is not verified is verified, and then
    the frontier is determined again with its new probabilities, up to `MOST_VERIFIED` times. The
    results of the verification of a layout replace those of the search.

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
