"""Findings of a design in words: its limits, failures of barriers and undecided targets."""

from __future__ import annotations

from collections.abc import Sequence

from rigdda import BadInput, Layout, Mesh, Site
from rigdda.agents.design_study import design_events
from rigdda.agents.designers.protocol import DesignResult
from rigdda.agents.reports.wording import before, euros, percent, span
from rigdda.barriers import KINDS
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.siting import Room


def unbuildable(site: Site, layout: Layout) -> str:
    """Return a text that says why a layout may not be built, or an empty text if it may."""
    try:
        Room(site, site.barrier_zone).check_layout(layout, list(KINDS), len(layout))
    except BadInput as error:
        return f"is simulated as given but may not be built: {error}"
    return ""


def of_layout(site: Site, layout: Layout, event: str | None) -> str:
    """Return notes on the simulation of a layout; `event` is None if events are drawn by rate."""
    found = unbuildable(site, layout)
    words = [f"the layout {found}"] if found else []
    if event is None and any(isinstance(barrier, Mesh) for barrier in layout):
        words.append(
            "mesh makes events rarer but does not change a release: this command draws events by "
            "their rates without mesh; `design` and `study` take mesh into account"
        )
    return "; ".join(words)


def kept(site: Site, layout: Layout) -> list[str]:
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


SURE = 0.05
"""Upper bound of the probability of failure in a design event above which it is reported [-]."""

PART = 1 / 3
"""Least share of the remaining risk for which an event is named as its cause [-]."""


def worst(evaluation: Evaluation) -> str | None:
    """Return the event with the largest remaining harm and repair, or None if there is none."""
    left = evaluation.by_event
    most = max(left, key=lambda name: left[name], default=None)
    return most if most is not None and left[most] > 0.0 else None


def limits(result: DesignResult, cases: Sequence[tuple[str, Evaluation]], left: str) -> str:
    """Return one line that says what limits the result.

    Parameters
    ----------
    result : DesignResult
        Result of the designer.
    cases : sequence of (str, Evaluation)
        Verified layouts; the first is no barrier, and the last is the layout found.
    left : str
        Text on the remaining risk.
    """
    chosen = cases[-1][1]
    cheap = [name for name, other in cases[1:-1] if other.ci[1] < chosen.ci[0]]
    parts = [] if cheap and not chosen.layout else [_pays(result.site, cases[0][1], chosen)]
    parts += [
        f"the layout {name!r} costs less per year than the optimised one: use a larger --budget"
        for name in cheap
    ]
    if chosen.layout and result.on_bound:
        parts.append(f"the layout lies on a bound of the search: {', '.join(result.on_bound)}")
    return "; ".join(filter(None, [*parts, left]))


def _pays(site: Site, nothing: Evaluation, chosen: Evaluation) -> str:
    """Return a text if no layout pays or if this is not shown; otherwise an empty text."""
    if not chosen.layout:
        return "no layout was found that saves more per year than it costs"
    if chosen.ci[1] < nothing.ci[0]:
        return ""
    return (
        f"{chosen.releases:,} releases do not show that the layout saves more than it costs: Z is "
        f"{span(chosen.ci)} with the layout and {span(nothing.ci)} {before(site)}"
    )


def cheaper(cases: Sequence[tuple[str, Evaluation]]) -> list[str]:
    """Return lines on layouts that are cheaper to build and may have the same cost per year.

    Parameters
    ----------
    cases : sequence of (str, Evaluation)
        Verified layouts; the first is no barrier, and the last is the layout found.
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
    """Return a text on the remaining risk and the event that causes most of it."""
    left, most = evaluation.by_event, worst(evaluation)
    if most is None:
        return "no harm or repair remains in these releases"
    total = sum(left.values())
    words = f"the remaining harm and repair are {euros(total)} EUR per metre and year"
    if len(left) == 1:
        return words
    if left[most] < PART * total:
        return f"{words}; no event contributes more than {percent(left[most] / total)}"
    return f"{words}; {euros(left[most])} of this is from the event {most!r}"


def failing(site: Site, evaluation: Evaluation) -> list[str]:
    """Return lines on the failure of barriers in design events, if it may be above 5 %."""
    lines = []
    for event in design_events(site) if site.standing(evaluation.layout) else ():
        chance = evaluation.failure[event]
        if chance.releases and chance.bound > SURE:
            lines.append(
                f"a barrier fails in {percent(chance.probability)} of the releases of the design "
                f"event {event!r} (95 % upper bound {percent(chance.bound)})"
            )
    return lines


def undecided(problem: DesignProblem, evaluation: Evaluation) -> str:
    """Return a text that says whether the targets are met; it is empty without targets."""
    asked = problem.targets
    if evaluation.targets is None:
        return ""
    pairs = (("reach", asked.reach), ("failure", asked.failure))
    words = " and ".join(f"P({name}) <= {percent(p)}" for name, p in pairs if p is not None)
    parts = [f"{words} in every design event"] if words else []
    if asked.individual is not None:
        parts.append(f"individual risk <= {asked.individual:.2g} a year")
    more = "; a larger --verify would decide it" if evaluation.targets == "undecided" else ""
    return f"target {' and '.join(parts)}: {evaluation.targets}{more}"
