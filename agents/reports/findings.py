"""What a design says beyond its numbers: what limits it, what fails, what is undecided."""

from __future__ import annotations

from collections.abc import Sequence

from rigdda import BadInput, Layout, Mesh, Site
from rigdda.agents.design_study import design_events
from rigdda.agents.designers.protocol import DesignResult
from rigdda.agents.reports.wording import euros, percent, span
from rigdda.barriers import KINDS
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.siting import Room


def unbuildable(site: Site, layout: Layout) -> str:
    """Return in words why `design` would refuse a layout, nothing if it would not."""
    try:
        Room(site, site.barrier_zone).check_layout(layout, list(KINDS), len(layout))
    except BadInput as error:
        return f"is simulated as given, but could not be built: {error}"
    return ""


def of_layout(site: Site, layout: Layout, event: str | None) -> str:
    """Return in words what is to be known of a layout in releases of an event, or by rate."""
    found = unbuildable(site, layout)
    words = [f"the layout {found}"] if found else []
    if event is None and any(isinstance(barrier, Mesh) for barrier in layout):
        words.append(
            "mesh makes events rarer but does not change a release: here events are drawn by their "
            "rates without mesh; `design` and `study` take mesh into account"
        )
    return "; ".join(words)


def unfitted(site: Site) -> str:
    """Return in words which surfaces the lumped-mass model knows by its defaults only."""
    names = sorted({*site.slope.chain()[1]} - set(site.lumped))
    if not names:
        return ""
    return (
        f"the rebound from {', '.join(names)} uses default coefficients that were not fitted to "
        "observations (see [lumped.NAME]): real blocks may run out much less or much farther"
    )


SURE = 0.05
"""Share of its design events in which a barrier may fail without a word: its upper bound."""

PART = 1 / 3
"""Share of what is left from which on an event is said to make it."""


def worst(evaluation: Evaluation) -> str | None:
    """Return the event that makes most of what is left of the risk, None if nothing is left."""
    left = evaluation.by_event
    most = max(left, key=lambda name: left[name], default=None)
    return most if most is not None and left[most] > 0.0 else None


def limits(result: DesignResult, cases: Sequence[tuple[str, Evaluation]], left: str) -> str:
    """Return one line that says what limits the answer.

    Parameters
    ----------
    result : DesignResult
        What the designer found.
    cases : sequence of (str, Evaluation)
        Verified layouts: nothing the first, the found one the last.
    left : str
        What is left of the risk, in words.
    """
    chosen = cases[-1][1]
    cheap = [name for name, other in cases[1:-1] if other.ci[1] < chosen.ci[0]]
    parts = [] if cheap and not chosen.layout else [_pays(cases[0][1], chosen)]
    parts += [
        f"the layout {name!r} costs less per year than the optimised one: use a larger --budget"
        for name in cheap
    ]
    if chosen.layout and result.on_bound:
        parts.append(f"the layout lies on a bound of the search: {', '.join(result.on_bound)}")
    return "; ".join(filter(None, [*parts, left]))


def _pays(nothing: Evaluation, chosen: Evaluation) -> str:
    """Return in words that no layout pays, or that none is shown to pay; else nothing."""
    if not chosen.layout:
        return "no layout was found that saves more per year than it costs"
    if chosen.ci[1] < nothing.ci[0]:
        return ""
    return (
        f"{chosen.releases:,} releases do not show that the layout saves more than it costs: Z is "
        f"{span(chosen.ci)} with it and {span(nothing.ci)} without"
    )


def cheaper(cases: Sequence[tuple[str, Evaluation]]) -> list[str]:
    """Return lines that name what costs as little a year, as far as is told, and less to build.

    Parameters
    ----------
    cases : sequence of (str, Evaluation)
        Verified layouts: nothing the first, the found one the last.
    """
    chosen = cases[-1][1]
    order = {None: 0, "met": 0, "undecided": 1, "missed": 2}
    return [
        f"the layout {name!r} may cost as little per year ({span(other.ci)}, optimised "
        f"{span(chosen.ci)}) and is cheaper to build: {euros(other.cost)} instead of "
        f"{euros(chosen.cost)} EUR per metre"
        for name, other in cases[1:-1]
        if other.ci[0] <= chosen.ci[1] and chosen.ci[0] <= other.ci[1]
        if other.cost < chosen.cost and order[other.targets] <= order[chosen.targets]
    ]


def left_over(evaluation: Evaluation) -> str:
    """Return in words what is left of the risk, and which event makes most of it."""
    left, most = evaluation.by_event, worst(evaluation)
    if most is None:
        return "no harm or repair remains in these releases"
    total = sum(left.values())
    words = f"the remaining harm and repair are {euros(total)} EUR per metre and year"
    if len(left) == 1:
        return words
    if left[most] < PART * total:
        return f"{words}; no event contributes more than {percent(left[most] / total)}"
    return f"{words}, {euros(left[most])} of it from the event {most!r}"


def failing(site: Site, evaluation: Evaluation) -> list[str]:
    """Return lines that say how often barriers fail in design events, if that may be above 5 %."""
    lines = []
    for event in design_events(site) if evaluation.layout else ():
        chance = evaluation.failure[event]
        if chance.releases and chance.bound > SURE:
            lines.append(
                f"a barrier fails in {percent(chance.probability)} of the releases of the design "
                f"event {event!r} (95 % upper bound {percent(chance.bound)})"
            )
    return lines


def undecided(problem: DesignProblem, evaluation: Evaluation) -> str:
    """Return in words whether the targets are met; nothing without targets."""
    asked = problem.targets
    if evaluation.targets is None:
        return ""
    pairs = (("reach", asked.reach), ("failure", asked.failure))
    words = " and ".join(f"P({name}) <= {percent(p)}" for name, p in pairs if p is not None)
    more = "; a larger --verify would decide it" if evaluation.targets == "undecided" else ""
    return f"target {words} in every design event: {evaluation.targets}{more}"
