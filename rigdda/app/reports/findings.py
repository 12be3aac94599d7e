"""The answer of a design in words: its first line, its limits, failures and undecided targets.

The first line says what to build, or why nothing that was found should be built.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

from rigdda import BadInput, Layout, Mesh, Site
from rigdda.agents.designers import DEFAULT
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.agents.designers.protocol import DesignResult
from rigdda.app.barrier_checks import LayoutChecks
from rigdda.app.design_study import (
    CONSTANT,
    ComparedLayouts,
    DesignStudy,
    VerifiedLayout,
    design_events,
)
from rigdda.app.reports.wording import (
    at_most,
    before,
    euros,
    order,
    percent,
    percentage,
    span,
    unchanged,
)
from rigdda.barriers import KINDS, describe
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.barrier_formulas import BarrierCheck
from rigdda.envs.problem import MET, MISSED, UNDECIDED, Targets, can_fail
from rigdda.envs.siting import FeasiblePlaces

Money = tuple[float, float, float]
"""Z with the ends of its 95 % interval [EUR per metre and year]."""


REPORTED_REACH = 0.05
"""Share of the releases of a design event that reach the road from which it is reported [-]."""

EXCESSIVE_USE = 1000.0
"""Utilisation above which its value is not printed; without any capacity, it is infinite [-]."""


class FailedCheck(NamedTuple):
    """A check that is not met: barrier and check in words, and demand over capacity [-]."""

    barrier: str
    check: str
    use: float


class OtherLayout(NamedTuple):
    """A verified layout that a design may propose instead of the one that it found.

    Parameters
    ----------
    name : str
        Its name.
    barriers : str
        Its barriers in words.
    z : Money
        Z with it.
    targets : str or None
        Whether it meets the targets; None without targets.
    """

    name: str
    barriers: str
    z: Money
    targets: str | None


class DesignAnswer(NamedTuple):
    """Result of a design, as far as its first line needs it.

    Parameters
    ----------
    layout : str
        The layout in words, empty if it has no barrier.
    bare : str
        What the case without the layout is called in a sentence.
    z, nothing : Money
        Z with the layout and without it.
    targets : str or None
        Whether the targets are met; None without targets.
    asked : str
        The targets in words, such as "a block reaches the road with at most 5 %".
    required : bool
        Whether all checks had to be met.
    failed : sequence of FailedCheck
        Checks that its new barriers do not meet.
    reaching : (str, float)
        The design event that most often reaches the road with the layout, empty without design
        events, and the share of its releases that do [-].
    verified : bool
        Whether Z was computed from releases that no search used.
    cap : float or None
        Largest capital cost of a layout [EUR per metre of road]; None for no limit.
    others : sequence of OtherLayout
        The other verified layouts that may be proposed. The first is the case without a layout.
    bare_targets : str or None
        Whether the targets are met without the layout; None without targets.
    """

    layout: str
    bare: str
    z: Money
    nothing: Money
    targets: str | None
    asked: str
    required: bool
    failed: Sequence[FailedCheck]
    reaching: tuple[str, float]
    verified: bool = True
    cap: float | None = None
    others: Sequence[OtherLayout] = ()
    bare_targets: str | None = None

    @property
    def needed(self) -> bool:
        """Whether the layout meets the targets and is needed for them."""
        return self.targets == MET and self.bare_targets != MET


HEADLINE_OPENINGS = (
    "Build", "Compare with", "Do not build", "No layout that was found", "Verify with",
)  # fmt: skip
"""First words of `headline`, which begin no other finding."""


def is_headline(line: str) -> bool:
    """Return whether a finding is a first line of `headline`."""
    return line.startswith(HEADLINE_OPENINGS)


def headline(answer: DesignAnswer) -> str:
    """Return the first line of a design.

    A layout is never headed "build" if it fails one of its checks, misses a target, or costs more
    than it saves without being needed for a target. If another verified layout is better, this is
    said instead.
    """
    layout = answer.layout
    fails = f" It fails its checks: {failed_words(answer.failed)}." if answer.failed else ""
    within = "" if answer.cap is None else f" for at most {euros(answer.cap)} EUR per metre"
    better = better_layout(answer)
    if better is not None and (answer.targets == MISSED or not fails):
        fails = fails.replace("It fails", "The layout that was found fails", 1)
        return f"{_comparison(answer, better)}{fails}"
    if answer.targets == MISSED:
        none = f"No layout that was found{within} meets the target that {answer.asked}."
        return f"{none} The best of those that miss it: {layout}.{fails}" if layout else none
    if not layout and answer.targets == UNDECIDED:
        return (
            f"Verify with more releases: no layout{within} was shown to meet the target that "
            f"{answer.asked}, and these releases do not decide whether the slope {answer.bare} "
            "meets it."
        )
    if not layout:
        worth = "meets every check and is worth" if answer.required else "is worth"
        if answer.targets == MET:
            return f"Build nothing: the slope {answer.bare} meets the target."
        return f"Build nothing: no layout was found{within} that {worth} its cost."
    if fails:
        return f"Do not build this as it is: {layout}.{fails}"
    if answer.targets not in (None, MET):
        return (
            f"Verify with more releases before you build: {layout}. These releases do not decide "
            f"whether it meets the target that {answer.asked}."
        )
    more, dearer = answer.z[0] - answer.nothing[0], answer.z[1] > answer.nothing[2]
    if dearer and not answer.needed:
        return (
            f"Build nothing: the layout that was found{within} costs {euros(more)} EUR per metre "
            f"and year more than {answer.bare}: {layout}."
        )
    if not answer.verified:
        return (
            f"Verify with a new design before you build: {layout}. Its Z is that of the releases "
            "by which it was chosen."
        )
    if dearer:
        return (
            f"Build, for the target alone: {layout}. It costs {euros(more)} EUR per metre and "
            f"year more than {answer.bare}.{_left(answer)}"
        )
    if answer.z[2] >= answer.nothing[1] and not answer.needed:
        return (
            f"Verify with more releases before you build: {layout}. It is not shown that it saves "
            "more than it costs."
        )
    return f"Build: {layout}.{_left(answer)}"


TARGET_RANK = {None: 0, MET: 0, UNDECIDED: 1, MISSED: 2}
"""Ranks of the states of targets, the best first."""


def better_layout(answer: DesignAnswer) -> OtherLayout | None:
    """Return the best of the other layouts that are better than the layout found, if any is.

    If the layout found misses a target, or is no barrier and may miss one, a better layout is one
    whose targets are in a better state. Otherwise, it is one whose targets are in no worse state
    and that is shown to cost less. There is none if the best of these is the case without a layout
    and its targets are in the same state.
    """
    rank = TARGET_RANK[answer.targets]
    by_targets = rank == TARGET_RANK[MISSED] or (rank > 0 and not answer.layout)
    if by_targets:
        found = [one for one in answer.others if TARGET_RANK[one.targets] < rank]
    else:
        alike = [one for one in answer.others if TARGET_RANK[one.targets] <= rank]
        found = [one for one in alike if one.z[2] < answer.z[1]]
    best = min(found, key=lambda one: (TARGET_RANK[one.targets], one.z[0]), default=None)
    if best is not None and best is answer.others[0] and TARGET_RANK[best.targets] == rank:
        return None
    return best


def _comparison(answer: DesignAnswer, better: OtherLayout) -> str:
    """Return a first line that names a better layout than the one found."""
    this = f"you build: {answer.layout}" if answer.layout else "you decide to build nothing"
    what = f"{better.name!r} costs {euros(answer.z[0] - better.z[0])} EUR per metre and year less"
    if TARGET_RANK[better.targets] < TARGET_RANK[answer.targets]:
        where = "with this layout" if answer.layout else answer.bare
        what = (
            f"The target that {answer.asked} is {answer.targets} {where} and {better.targets} with "
            f"{better.name!r}"
        )
        if better is answer.others[0]:
            return (
                f"Do not build this: {answer.layout}. The target that {answer.asked} is "
                f"{answer.targets} with it and {better.targets} {answer.bare}."
            )
    return f"Compare with {better.name!r} before {this}. {what}: {better.barriers}."


def _left(answer: DesignAnswer) -> str:
    """Return a sentence on how often rock still reaches the road; empty if it hardly does."""
    event, share = answer.reaching
    if share < REPORTED_REACH:
        return ""
    return f" Rock of {event!r} still reaches the road in {percent(share)} of the releases."


def failed_words(failed: Sequence[FailedCheck]) -> str:
    """Return the barriers with checks that are not met in words, with their utilisation."""
    words = []
    for barrier, group in groupby(failed, key=lambda one: one.barrier):
        uses = " and ".join(f"{one.check} {_times(one.use)}" for one in group)
        words.append(f"{barrier}: {uses} times the limit")
    return "; ".join(words)


def _times(use: float) -> str:
    """Return a utilisation with two decimals below 10, and as a whole number above."""
    if use > EXCESSIVE_USE:
        return f"more than {EXCESSIVE_USE:,.0f}"
    return f"{use:.2f}" if use < 9.995 else f"{use:,.0f}"


def unbuildable(site: Site, layout: Layout) -> str:
    """Return a text with all reasons why a layout may not be built; empty if it may."""
    found = violations(site, layout)
    if not found:
        return ""
    return f"is simulated as given but may not be built: {'; '.join(map(str, found))}"


def violations(site: Site, layout: Layout) -> list[BadInput]:
    """Return an error for each siting rule that a layout violates."""
    return list(
        FeasiblePlaces(site, site.barrier_zone).violations(layout, list(KINDS), len(layout))
    )


def removed(site: Site, layout: Layout) -> str:
    """Return a text that names the existing barriers that a layout removes or replaces."""
    stand = site.standing(layout)
    gone = [b.label_and_place for b in site.existing_barriers if b not in stand]
    return f"removed with this layout: existing {' and '.join(gone)}" if gone else ""


def of_layout(site: Site, layout: Layout, event: str | None) -> str:
    """Return notes on the simulation of a layout; `event` is None if events are drawn by rate."""
    found = unbuildable(site, layout)
    words = [f"the layout {found}"] if found else []
    words += filter(None, [removed(site, layout)])
    if event is None and any(isinstance(barrier, Mesh) for barrier in layout):
        words.append(
            "mesh makes events rarer but does not change a release: this command draws events by "
            "their rates without mesh; the commands design and study take mesh into account"
        )
    return "; ".join(words)


def existing_barriers(site: Site, layout: Layout) -> list[str]:
    """Return lines on what happens to the existing barriers of a site with a layout."""
    stand = site.standing(layout)
    return [
        f"existing {barrier.label}, at x = {barrier.x:.1f} m: "
        + ("kept" if barrier in stand else "removed")
        for barrier in site.existing_barriers
    ]


def unfitted(site: Site) -> str:
    """Return a text that names the surfaces with default coefficients of the lumped-mass model."""
    names = sorted({*site.slope.chain()[1]} - set(site.lumped))
    if not names:
        return ""
    return (
        f"the rebound from {', '.join(names)} uses default coefficients that were not fitted to "
        "observations (see [lumped.NAME]); the actual run-outs may be much shorter or longer"
    )


REPORTED_FAILURE = 0.05
"""Upper bound of the probability of failure in a design event above which it is reported [-]."""

CAUSE_SHARE = 1 / 3
"""Least share of the remaining risk for which an event is named as its cause [-]."""


def worst(evaluation: Evaluation) -> str | None:
    """Return the event with the largest remaining harm and repair, or None if there is none."""
    left = evaluation.by_event
    most = max(left, key=lambda name: left[name], default=None)
    return most if most is not None and left[most] > 0.0 else None


def limits(
    result: DesignResult,
    cases: Sequence[tuple[str, Evaluation]],
    left: str,
    searched: bool = True,
) -> str:
    """Return one line that says what limits the result.

    Parameters
    ----------
    result : DesignResult
        Result of the designer.
    cases : sequence of (str, Evaluation)
        Verified layouts; the first is no barrier, and the last is the layout found.
    left : str
        Text on the remaining risk.
    searched : bool
        Whether the layout found was searched for, so that a larger budget may give a better one.
    """
    chosen = cases[-1][1]
    parts = [no_layout_pays(result.site, cases)]
    parts += [_costs_less(name, other, cases[-1], searched) for name, other in cases[1:-1]]
    if chosen.layout and result.on_bound:
        parts.append(f"the layout lies on a bound of the search: {', '.join(result.on_bound)}")
    return "; ".join(filter(None, [*parts, left]))


def _costs_less(name: str, other: Evaluation, best: tuple[str, Evaluation], searched: bool) -> str:
    """Return a text if a layout costs less per year than the last one; otherwise an empty text."""
    words, chosen = best
    if not other.ci[1] < chosen.ci[0]:
        return ""
    line = f"the layout {name!r} costs less per year than {words!r}"
    if TARGET_RANK[other.targets] > TARGET_RANK[chosen.targets]:
        return (
            f"{line}, but its targets are {other.targets}, whereas those of the latter are "
            f"{chosen.targets}"
        )
    if TARGET_RANK[other.targets] == TARGET_RANK[MISSED]:
        return f"{line}, but also misses the targets"
    if searched:
        return f"{line}: use a larger --budget"
    return f"{line}: choose {name!r}, or search with --designer {DEFAULT}"


def no_layout_pays(site: Site, cases: Sequence[tuple[str, Evaluation]]) -> str:
    """Return a text if no layout pays or if this is not shown; otherwise an empty text.

    Parameters
    ----------
    site : Site
        The site.
    cases : sequence of (str, Evaluation)
        Verified layouts; the first is no barrier, and the last is the layout found.
    """
    status = "the slope as it stands" if site.existing else "no barrier"
    nothing, chosen = cases[0][1], cases[-1][1]
    if chosen.layout:
        if chosen.ci[1] < nothing.ci[0]:
            return ""
        if chosen.ci[0] > nothing.ci[1]:
            return (
                f"the layout costs more per year than it saves: Z is {span(chosen.ci)} with it and "
                f"{span(nothing.ci)} {before(site)}"
            )
        return (
            f"{chosen.releases:,} releases do not show that the layout saves more than it costs: Z "
            f"is {span(chosen.ci)} with the layout and {span(nothing.ci)} {before(site)}"
        )
    lower = [(name, e) for name, e in cases[1:-1] if e.objective < nothing.objective]
    if not lower:
        return f"none of the verified layouts costs less per year than {status}"
    open_ = [name for name, e in lower if e.ci[1] >= nothing.ci[0]]
    if not open_:
        return ""  # `limits` names the layouts that cost less
    names = " and ".join(map(repr, open_))
    return (
        f"{names} may cost less per year than {status}, but {nothing.releases:,} releases do "
        "not show it"
    )


def over_the_cap(problem: DesignProblem, cases: Sequence[tuple[str, Evaluation]]) -> list[str]:
    """Return lines on the verified layouts that are more expensive to build than allowed."""
    most = problem.max_cost
    if most is None:
        return []
    return [
        f"{name!r} costs {euros(e.cost)} EUR per metre to build, more than the {euros(most)} that "
        "may be spent"
        for name, e in cases[1:]
        if problem.place.too_expensive(e.layout) is not None
    ]


def frontier(
    done: ComparedLayouts, front: Sequence[TriedLayout], tried: int, replaced: bool
) -> list[str]:
    """Return lines on the frontier of a missed target, and on a layout that was replaced.

    Parameters
    ----------
    done : ComparedLayouts
        The compared layouts.
    front : sequence of TriedLayout
        The frontier.
    tried : int
        Number of layouts among which the frontier was determined.
    replaced : bool
        Whether the layout of the search was replaced by another verified layout.
    """
    chosen = (
        f"{done.chosen.name!r} was chosen instead of the layout of the search, because it meets "
        "the targets, misses them by less or has a lower annual cost; it was verified again on "
        "other releases"
    )
    if not front:
        return [chosen] if replaced else []
    known = sum(one.verified is not None for one in front)
    words = "all of these layouts were verified"
    if known < len(front):
        verb = "was" if known == 1 else "were"
        words = (
            f"{known} of these {len(front)} layouts {verb} verified; the estimates of the others "
            "are from the few releases of the search"
        )
    least = min(front, key=lambda one: one.level)
    lines = [
        f"{_what_missed(done, replaced)}; the table shows, for each upper bound of P(reach), the "
        f"layout that is cheapest to build among {tried:,} layouts",
        words,
        f"the lowest upper bound of P(reach) is {at_most(least.level)}, for {euros(least.cost)} "
        "EUR per metre to build",
    ]
    return [*lines, chosen] if replaced else lines


def _what_missed(done: ComparedLayouts, replaced: bool) -> str:
    """Return in words which layout missed a target."""
    met = done.chosen.evaluation.targets != MISSED
    return "the layout of the search missed a target" if replaced and met else "a target is missed"


def cheaper(cases: Sequence[tuple[str, Evaluation]]) -> list[str]:
    """Return lines on layouts that are cheaper to build and may have the same cost per year.

    Parameters
    ----------
    cases : sequence of (str, Evaluation)
        Verified layouts; the first is no barrier, and the last is the layout found.
    """
    words, chosen = cases[-1]
    return [
        f"the layout {name!r} may cost as little per year ({span(other.ci)}, {words} "
        f"{span(chosen.ci)}) and is cheaper to build: {euros(other.cost)} instead of "
        f"{euros(chosen.cost)} EUR per metre"
        for name, other in cases[1:-1]
        if other.ci[0] <= chosen.ci[1] and chosen.ci[0] <= other.ci[1]
        if other.cost < chosen.cost and euros(other.cost) != euros(chosen.cost)
        if TARGET_RANK[other.targets] <= TARGET_RANK[chosen.targets]
    ]


def of_design(done: DesignStudy) -> list[str]:
    """Return all lines on the layout of a design, its limits, failures and targets."""
    chosen = done.chosen.evaluation
    cases = [(case.name, case.evaluation) for case in done.comparable]
    lines = [
        compliance(done),
        *for_comparison(done),
        limits(done.result, cases, done.left, was_searched(done)),
        *cheaper(cases),
        *unreleased(done.problem.site, chosen),
        *failing(done.problem.site, chosen),
        undecided(done.problem, chosen, "a larger --verify"),
    ]
    return [line for line in lines if line]


def was_searched(done: DesignStudy) -> bool:
    """Return whether the layout found was searched for; that of the rule or the constant is not."""
    return done.chosen.name not in (done.rule.name, CONSTANT)


def compliance(done: DesignStudy) -> str:
    """Return a line on the cost of meeting all checks.

    It is empty if they are not required, or if no layout was searched for. If the targets of the
    layouts with and without required checks are in different states, the line does not say what the
    checks cost, because a part of the difference is due to the targets.
    """
    if done.problem.checks != "required" or not was_searched(done):
        return ""
    other, chosen = done.unchecked, done.chosen.evaluation
    no_better = "without required checks, the search found no better layout"
    if other is None:
        return no_better
    free = other.evaluation
    failed = failed_checks(done.other_checks[other.name])
    faults = [f"fails its checks ({failed_words(failed)})"] if failed else []
    if TARGET_RANK[free.targets] > TARGET_RANK[chosen.targets]:
        faults.append(f"has targets that are {free.targets}")
    built = " and ".join(b.label_and_place for b in free.layout) or unchanged(done.problem.site)
    but = f", which {' and '.join(faults)}" if faults else ""
    found = f"without required checks, the search finds {built}{but}"
    z = (
        f"Z is {euros(chosen.objective)} ({span(chosen.ci)}) instead of {euros(free.objective)} "
        f"({span(free.ci)})"
    )
    if free.targets != chosen.targets:
        return (
            f"{found}: {z}, but it is not known what meeting the checks costs, because the targets "
            f"are {chosen.targets} with them and {free.targets} without them"
        )
    more = f"{euros(chosen.objective - free.objective)} EUR per metre and year"
    cost = f"it is not shown that meeting the checks costs anything ({more})"
    if (apart := done.compliance) is not None:
        known = f"{euros(apart.value)} ({span(apart.ci)}) EUR per metre and year"
        cost = f"it is not shown that meeting the checks costs anything ({known})"
        if apart.ci[0] > 0.0:
            cost = f"meeting the checks costs {known}"
        elif apart.ci[1] < 0.0:  # the search thought it better, the verification does not
            return no_better
    return f"{found}: {cost}, as {z}"


def for_comparison(done: DesignStudy) -> list[str]:
    """Return a line on the layouts for comparison that may not be proposed."""
    kept = {case.name for case in (*done.comparable, *filter(None, [done.unchecked]))}
    return compared_only([case.name for case in done.cases if case.name not in kept])


def compared_only(layouts: Sequence[str]) -> list[str]:
    """Return a line on layouts that fail a required check, which are given by their names."""
    names = [repr(name) for name in layouts]
    if not names:
        return []
    fail = "fails a required check and is" if len(names) == 1 else "fail required checks and are"
    return [f"{' and '.join(names)} {fail} shown for comparison only"]


def failed_checks(checks: LayoutChecks) -> list[FailedCheck]:
    """Return the checks that new barriers of a layout do not meet, for a headline."""
    return in_words([check for check in checks.failed if not check.existing])


def in_words(failed: Sequence[BarrierCheck]) -> list[FailedCheck]:
    """Return checks that are not met, for a headline."""
    return [FailedCheck(f"{c.barrier}, at {c.x:.1f} m", c.check, c.use / c.limit) for c in failed]


def reaching(evaluation: Evaluation, site: Site) -> tuple[str, float]:
    """Return the design event that most often reaches the road, and the share of its releases.

    Events without releases are left out. If there are no others, the name is empty and the share 0.
    """
    known = [name for name in design_events(site) if evaluation.reach[name].releases]
    shares = {name: evaluation.reach[name].probability for name in known}
    most = max(shares, key=lambda name: shares[name], default="")
    return most, shares.get(most, 0.0)


def answer(done: DesignStudy) -> DesignAnswer:
    """Return what the first line of a design needs."""
    site, chosen, nothing = done.problem.site, done.chosen.evaluation, done.nothing.evaluation
    return DesignAnswer(
        layout="; ".join(order(barrier, site) for barrier in chosen.layout),
        bare=before(site),
        z=(chosen.objective, *chosen.ci),
        nothing=(nothing.objective, *nothing.ci),
        targets=chosen.targets,
        asked=asked_words(done.problem.targets),
        required=done.problem.checks == "required",
        failed=failed_checks(done.checks),
        reaching=reaching(chosen, site),
        cap=done.problem.max_cost,
        others=[_other(site, case) for case in done.comparable if case is not done.chosen],
        bare_targets=nothing.targets,
    )


def _other(site: Site, case: VerifiedLayout) -> OtherLayout:
    """Return what the first line of a design needs of another layout than the one found."""
    e = case.evaluation
    words = barriers_in_words(site, e.layout)
    return OtherLayout(case.name, words, (e.objective, *e.ci), e.targets)


def barriers_in_words(site: Site, layout: Layout) -> str:
    """Return the barriers of a layout in words, as in the table of layouts."""
    return "; ".join(map(describe, layout)) or unchanged(site)


def asked_words(targets: Targets) -> str:
    """Return targets in words; empty without any."""
    parts = []
    if targets.reach is not None:
        chance = percentage(targets.reach)
        parts.append(
            f"a block of a design event reaches the road with a probability of at most {chance}"
        )
    if targets.failure is not None:
        chance = percentage(targets.failure)
        parts.append(f"a barrier fails in a design event with a probability of at most {chance}")
    if targets.individual is not None:
        chance = f"{targets.individual:.2g}"
        parts.append(f"a commuter is killed within a year with a probability of at most {chance}")
    return " and that ".join(parts)


def left_over(evaluation: Evaluation) -> str:
    """Return a text on the remaining risk and the event that causes most of it."""
    left, most = evaluation.by_event, worst(evaluation)
    if most is None:
        return "no harm or repair remains in these releases"
    total = sum(left.values())
    words = f"the remaining harm and repair are {euros(total)} EUR per metre and year"
    if len(left) == 1:
        return words
    if left[most] < CAUSE_SHARE * total:
        return f"{words}; no event contributes more than {at_most(left[most] / total)}"
    return f"{words}; {euros(left[most])} of this is from the event {most!r}"


def unreleased(site: Site, evaluation: Evaluation) -> list[str]:
    """Return lines on the design events without releases, of which no probability is known."""
    return [
        f"no release of the design event {name!r} was drawn: it is not known how often it reaches "
        "the road"
        for name in design_events(site)
        if not evaluation.reach[name].releases
    ]


def failing(site: Site, evaluation: Evaluation) -> list[str]:
    """Return lines on the failure of barriers in design events, if it may be above 5 %."""
    lines = []
    for event in design_events(site) if can_fail(site, evaluation.layout) else ():
        chance = evaluation.failure[event]
        if chance.releases and chance.bound > REPORTED_FAILURE:
            lines.append(
                f"a barrier fails in {percent(chance.probability)} of the releases of the design "
                f"event {event!r} (95 % upper bound {at_most(chance.bound)})"
            )
    return lines


def undecided(problem: DesignProblem, evaluation: Evaluation, remedy: str) -> str:
    """Return a text that says whether the targets are met; it is empty without targets.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    evaluation : Evaluation
        Evaluation of the layout.
    remedy : str
        What would decide whether they are met.
    """
    asked = problem.targets
    if evaluation.targets is None:
        return ""
    pairs = (("reach", asked.reach), ("failure", asked.failure))
    words = " and ".join(f"P({name}) <= {percentage(p)}" for name, p in pairs if p is not None)
    parts = [f"{words} in every design event"] if words else []
    if asked.individual is not None:
        parts.append(f"individual risk <= {asked.individual:.6g} a year")
    more = f"; {remedy} would decide it" if evaluation.targets == UNDECIDED else ""
    return f"target {' and '.join(parts)}: {evaluation.targets}{more}"
