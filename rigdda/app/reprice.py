"""Answers for other prices, consequences, rates, caps and targets from the outcomes of a design.

No layout is simulated. Costs and probabilities are computed from the stored outcomes as a design
computes them. Z is the sum of the means of the events, each times the rate of the event. Another
rate therefore only changes the weight of a mean; the releases need no weights of their own. Only if
a layout has fewer than two releases per event on average, each release is weighted by the new rate
divided by the probability with which its event was drawn (importance sampling).

With the same releases, the results equal those of a new design to the last digit.
"""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from rigdda import BadInput, Layout, Outcome, Site, fields
from rigdda.agents.designers.frontier import TriedLayout, frontier, worst
from rigdda.agents.designers.protocol import CHOICE_STREAM
from rigdda.app import archive
from rigdda.app.archive import Archive
from rigdda.app.barrier_checks import check_layout
from rigdda.app.design_study import ComparedLayouts, VerifiedLayout
from rigdda.app.value_origins import Mark
from rigdda.barriers import standing
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.barrier_formulas import BarrierCheck
from rigdda.envs.cost import account, judge
from rigdda.envs.ensemble import Ensemble, statistics
from rigdda.envs.intervals import Estimate, estimate
from rigdda.envs.outcome_cache import NO_EVENT_MOTION, NO_MOTION
from rigdda.envs.problem import MISSED, End, Targets, can_fail, read_targets
from rigdda.model.site_tables import SECTION
from rigdda.seeds import is_of_stream

BEST_OF_SEARCH = "best of search"
"""Name of the layout that is best for the new values."""

Value = bool | int | float | str | Mapping[str, Any]

PERIOD, LENGTH = "return_period", "section_length"
"""Keys of an event that are read as its rate; the second is the length that the first refers to."""

EVENT_KEYS = (*(key for key in NO_EVENT_MOTION if key != "rate_of"), PERIOD, LENGTH)
"""Keys of an event that need no new releases; another meaning of a rate needs them."""

MOTION = (
    "existing",
    *(name for name in Site.__struct_fields__ if name not in (*NO_MOTION, "events")),
)
"""Tables of a site file on which the motion of rock depends."""

LABELS = ("name", "description", "family", "origin", "lumped")
"""Keys of a site file that affect no result of a design."""


class Change(NamedTuple):
    """A value of a site file that was changed, with its unit if it is a return period."""

    path: str
    before: Any
    after: Any
    unit: str = ""


def parse(text: str) -> tuple[str, Value]:
    """Return path and value of a setting written as PATH=VALUE, with the value as in TOML.

    Raises
    ------
    BadInput
        If it has another form.
    """
    path, given, value = text.partition("=")
    path = path.strip()
    if not given or not path:
        raise BadInput("--set", text, "write PATH=VALUE, such as consequences.closure=20000")
    try:
        found = msgspec.toml.decode(f"value = {value.strip()}")
    except msgspec.DecodeError:
        hint = "write a number, true, false or a text in quotation marks after the ="
        raise BadInput("--set", text, hint) from None
    return path, found["value"]


def parse_all(texts: Sequence[str]) -> dict[str, Value]:
    """Return settings by path; see `parse`.

    Raises
    ------
    BadInput
        If one has another form, or two have the same path.
    """
    found: dict[str, Value] = {}
    for text in texts:
        path, value = parse(text)
        if path in found:
            raise BadInput("--set", text, "set each key once")
        found[path] = value
    return found


def other_targets(
    reach: float | None, failure: float | None, individual: float | None
) -> dict[str, float] | None:
    """Return the targets that replace those of the design; None if all are None."""
    given = {"reach": reach, "failure": failure, "individual": individual}
    return {name: value for name, value in given.items() if value is not None} or None


def with_settings(site: Site, settings: Mapping[str, Value]) -> tuple[Site, tuple[Change, ...]]:
    """Return a site with other values and the changes.

    Parameters
    ----------
    site : Site
        The site.
    settings : mapping of str to value
        New values by path in the site file, such as "consequences.closure", "prices.fence.500",
        "events.block.rate" or "meshes.light.price".

    Raises
    ------
    BadInput
        If there is no such key, a value is invalid, or the motion of rock depends on it.
    """
    changes = []
    for path, value in settings.items():
        stem, _, key = path.rpartition(".")
        period, length = f"{stem}.{PERIOD}", settings.get(f"{stem}.{LENGTH}")
        before = _present(site, path, value)
        if key == "rate" and period in settings:
            raise BadInput(path, value, f"leave it out: {period} gives the rate, too")
        if not path.startswith("events.") or key not in (PERIOD, LENGTH):
            changes.append(Change(path, before, value))
            site = _with(site, path, {}, value)
        elif period not in settings:
            raise BadInput(path, value, f"set {period}, which refers to this length, too")
        elif key == PERIOD:
            rate = _present(site, f"{stem}.rate", value)
            site = _with(site, path, {} if length is None else {LENGTH: length}, value)
            metres = SECTION if length is None else length  # a number, or _with refuses it
            before = SECTION / (rate * metres) if rate else "never"
            changes.append(Change(path, before, value, f"years on {metres:g} m of slope"))
    return site, tuple(changes)


def _table_of(site: Site, path: str, value: Value) -> tuple[str, list[str]]:
    """Return the table of a path that may be changed, and the keys within it."""
    top, *keys = path.split(".")
    names = type(site).__struct_fields__
    if top not in names:
        near = difflib.get_close_matches(top, names, 1)
        hint = f"did you mean {near[0]}?" if near else "give a key such as consequences.closure"
        raise BadInput(path, value, f"there is no such key: {hint}")
    if top == "barrier_zone":
        hint = "a search in another zone tries other layouts: run `rigdda design` for this"
        raise BadInput(path, value, hint)
    if top in MOTION:
        raise _needs_simulation(path, value)
    if top in LABELS:
        raise BadInput(path, value, "leave it out: no result depends on it")
    if not keys:
        raise BadInput(path, value, f"add a key of the table, such as {top}.KEY=VALUE")
    if getattr(site, top) is None:
        hint = f"add the table [{top}] to the site file and run `rigdda design`"
        raise BadInput(path, value, hint)
    return top, keys


def _needs_simulation(path: str, value: Value) -> BadInput:
    hint = "releases depend on it: change it in the site file and run `rigdda design`"
    return BadInput(path, value, hint)


def _named(site: Site, path: str, value: Value, top: str) -> tuple[int, list[str]]:
    """Return the index of a named table in a list, and the keys within it.

    Names may contain dots. The longest name with which the path begins is meant.
    """
    rest = path.removeprefix(f"{top}.")
    names = [table.name for table in getattr(site, top)]
    found = [name for name in names if rest == name or rest.startswith(f"{name}.")]
    if not found:
        known = ", ".join(names) or f"none: the site has no {top}"
        raise BadInput(path, value, f"give the name of one of the {top}: {known}")
    name = max(found, key=len)
    keys = rest[len(name) + 1 :].split(".") if rest != name else []
    if not keys:
        raise BadInput(path, value, f"add a key, such as {top}.{name}.KEY=VALUE")
    if keys[0] == "name":
        raise BadInput(path, value, "leave it out: the layouts of the design refer to this name")
    if top == "events":
        known_keys = type(site.events[0]).__struct_fields__
        if keys[0] in known_keys and keys[0] not in EVENT_KEYS:
            raise _needs_simulation(path, value)
    return names.index(name), keys


def _present(site: Site, path: str, value: Value) -> Any:
    """Return the present value of a path, or None if it has none; `value` is the new one."""
    top, keys = _table_of(site, path, value)
    table: Any = getattr(site, top)
    if isinstance(table, tuple):
        index, keys = _named(site, path, value, top)
        table = table[index]
    found = msgspec.to_builtins(table)
    for key in keys:
        found = found.get(key) if isinstance(found, dict) else None
    return found


def _with(site: Site, path: str, others: Mapping[str, Value], value: Value) -> Site:
    """Return a site with one other value, and with `others` in the same table."""
    top, keys = _table_of(site, path, value)
    table: Any = getattr(site, top)
    if not isinstance(table, tuple):
        new = _changed(table, path, top, keys, others, value)
        return msgspec.structs.replace(site, **{top: new})
    index, keys = _named(site, path, value, top)
    where = f"{top}.{table[index].name}"
    new = _changed(table[index], path, where, keys, others, value)
    return msgspec.structs.replace(site, **{top: (*table[:index], new, *table[index + 1 :])})


def _changed(
    table: msgspec.Struct,
    path: str,
    where: str,
    keys: Sequence[str],
    others: Mapping[str, Value],
    value: Value,
) -> msgspec.Struct:
    """Return a table of a site with one other value, and with `others`."""
    found = {k: v for k, v in msgspec.to_builtins(table).items() if v is not None} | dict(others)
    if keys[0] == PERIOD:
        found.pop("rate")
    inner = found
    for key in keys[:-1]:
        inner = inner.setdefault(key, {})
        if not isinstance(inner, dict):
            raise BadInput(path, value, f"shorten it: {key} has no further keys")
    inner[keys[-1]] = value
    return fields.read(type(table), found, where)


class ArchivedProblem(DesignProblem):
    """A design problem whose statistics follow from archived releases, without simulation.

    Parameters
    ----------
    kept : Archive
        The archive.
    site : Site
        The site with the new values.
    targets : Targets
        The targets.
    max_cost : float, optional
        Largest capital cost of a layout [EUR per metre of road].

    Raises
    ------
    BadInput
        As `DesignProblem` does.
    """

    def __init__(self, kept: Archive, site: Site, targets: Targets, max_cost: float | None):
        super().__init__(
            site, kept.max_barriers, kept.kinds, targets, zone=kept.zone, max_cost=max_cost
        )
        facts = statistics(site, kept.bare, kept.blocks)
        nothing = replace(judge(site, (), kept.bare, facts, kept.shares), outcomes=())
        object.__setattr__(self, "_ensemble", Ensemble(nothing, facts, kept.shares))

    @property
    def shares(self) -> dict[str, float]:
        """Share of the releases for each event in the design."""
        return self._known.shares

    @property
    def _known(self) -> Ensemble:
        found: Ensemble = self._ensemble  # type: ignore[attr-defined]
        return found


@dataclass(frozen=True, slots=True)
class ScoredLayout:
    """A layout of the search with the results of its releases for the new values.

    Parameters
    ----------
    layout : tuple of Barrier
        The layout.
    outcomes : tuple of Outcome
        Outcomes of its releases: those of the verification, or else of the search.
    verified : bool
        Whether it was verified.
    upper : float
        Estimate of Z plus two standard errors [EUR per metre of road and year].
    tried : TriedLayout or None
        Its cost and probabilities; None if the site has no design events.
    over, share, least : float
        Largest excess over a target, of upper bounds, of probabilities and of lower bounds [-].
    """

    layout: Layout
    outcomes: tuple[Outcome, ...]
    verified: bool
    upper: float
    tried: TriedLayout | None
    over: float
    share: float
    least: float


@dataclass(frozen=True, slots=True)
class Repriced(ComparedLayouts):
    """Results for other values.

    Parameters
    ----------
    changes : tuple of Change
        What was changed in the site file.
    cases : tuple of VerifiedLayout
        The verified layouts of the design and, as the last one, the best layout of the search.
    verified : bool
        Whether the best layout was verified by the design. If not, its evaluation is on the
        releases of the search, and Z is probably too low, because it was chosen among many.
    tried : int
        Number of layouts among which it was chosen.
    frontier : tuple of TriedLayout
        The cheapest layout for each level of P(reach), if the best layout misses a target.
    required : bool
        Whether the design required that every barrier meets its checks.
    failed : dict of str to tuple of BarrierCheck
        Checks that the barriers of each case do not meet, by its name.
    placeholders : tuple of Mark
        Values of the site file that are marked as placeholders and were not changed.
    """

    changes: tuple[Change, ...]
    verified: bool
    tried: int
    frontier: tuple[TriedLayout, ...]
    required: bool
    failed: dict[str, tuple[BarrierCheck, ...]]
    placeholders: tuple[Mark, ...]

    @property
    def comparable(self) -> tuple[VerifiedLayout, ...]:
        """The cases that may be proposed: if checks are required, those that meet them."""
        return tuple(c for c in self.cases if not (self.required and self.failed[c.name]))


def reprice(
    results: str | os.PathLike[str],
    settings: Mapping[str, Value] | None = None,
    targets: Targets | Mapping[str, float | None] | None = None,
    max_cost: float | None = None,
) -> Repriced:
    """Return the results of a design for other values, without simulating a layout.

    The demand on barriers is simulated if it is not stored, for example if other events are design
    events.

    Parameters
    ----------
    results : path
        Folder of a completed `rigdda design`.
    settings : mapping, optional
        New values by path in the site file, see `with_settings`.
    targets : Targets or mapping, optional
        Other targets; those that are not given are as in the design.
    max_cost : float, optional
        Another largest capital cost [EUR per metre of road]; by default that of the design.

    Raises
    ------
    BadInput
        If the folder contains no completed design, or a setting is invalid.
    Diverged
        If a simulation of the demand diverges.
    """
    kept = archive.read(Path(results))
    site, changes = with_settings(kept.site, settings or {})
    asked = targets if isinstance(targets, Targets) else _merged(kept.targets, targets or {})
    most = kept.max_cost if max_cost is None else max_cost
    problem = ArchivedProblem(kept, site, asked, most)
    found = _candidates(problem, kept)
    required = kept.checks == "required"
    failed = {layout: failed_checks(problem, layout, kept) for layout in found}
    candidates = [
        one
        for one in found.values()
        if problem.place.too_expensive(one.layout) is None and not (required and failed[one.layout])
    ]
    best, evaluation = choose(problem, candidates, kept)
    cases = []
    for name, tables in zip(kept.names, kept.layouts, strict=True):
        layout = archive.layout_of(tables)
        cases.append(VerifiedLayout(name, judged(problem, found[layout], kept)))
    cases.append(VerifiedLayout(BEST_OF_SEARCH, evaluation))
    front: tuple[TriedLayout, ...] = ()
    if evaluation.targets == MISSED:
        front = tuple(
            replace(one, verified=judged(problem, found[one.layout], kept))
            if found[one.layout].verified
            else one
            for one in frontier([c.tried for c in candidates if c.tried is not None])
        )
    return Repriced(
        problem=problem,
        cases=tuple(cases),
        changes=changes,
        verified=best.verified,
        tried=len(candidates),
        frontier=front,
        required=required,
        placeholders=_without(kept.placeholders, site, settings or {}),
        failed={case.name: failed[case.evaluation.layout] for case in cases},
    )


def _without(marked: Sequence[Mark], site: Site, settings: Mapping[str, Value]) -> tuple[Mark, ...]:
    """Return the placeholders of a site file that are not among some settings."""
    given = set()
    for path, value in settings.items():
        top, place = path.partition(".")[0], 0
        table, _, key = path.rpartition(".")
        if isinstance(getattr(site, top), tuple):
            place, keys = _named(site, path, value, top)
            table, key = top, keys[0]
        given.add(Mark(table, place, key).stored)
    return tuple(mark for mark in marked if mark.stored not in given)


def failed_checks(
    problem: DesignProblem, layout: Layout, kept: Archive
) -> tuple[BarrierCheck, ...]:
    """Return the checks that the new barriers of a layout do not meet.

    The demand is that of the slope with the existing barriers that the layout keeps. Only for the
    layout that the design found, it is that below the other barriers, as in the design, which has
    stored it.

    Parameters
    ----------
    problem : DesignProblem
        The problem with the new values.
    layout : tuple of Barrier
        The layout.
    kept : Archive
        The archive of the design.

    Raises
    ------
    Diverged
        If a simulation of the demand diverges.
    """
    if layout == archive.layout_of(kept.layouts[-1]):
        # the new cap does not apply here
        free = DesignProblem(problem.site, kept.max_barriers, kept.kinds, zone=kept.zone)
        return tuple(check for check in check_layout(free, layout).failed if not check.existing)
    return tuple(
        check
        for barrier in standing(layout)
        for check in problem.place.failed_checks(barrier, layout)
    )


def _merged(before: Targets, given: Mapping[str, float | None]) -> Targets:
    """Return targets of which some are replaced."""
    read_targets(given)
    return replace(before, **given)


def judged(problem: DesignProblem, candidate: ScoredLayout, kept: Archive) -> Evaluation:
    """Return the evaluation of a candidate.

    An event that was not released with the layout costs as much as without barriers.
    """
    known = {outcome.event for outcome in candidate.outcomes}
    missing = [name for name in problem.site.event_names if name not in known]
    lent = [replace(outcome, barriers=()) for outcome in kept.bare if outcome.event in missing]
    found = problem.judge(candidate.layout, (*candidate.outcomes, *lent))
    unknown = dict.fromkeys(missing, estimate(0, 0))
    found = replace(found, reach=found.reach | unknown, failure=found.failure | unknown)
    return replace(
        found,
        outcomes=(),
        releases=len(candidate.outcomes),
        simulated=0,
        targets=problem.state(found),
    )


VERIFIED = ("verification", CHOICE_STREAM)
"""Streams of releases that no search used, the one of the table of the design first."""


def _candidates(problem: ArchivedProblem, kept: Archive) -> dict[Layout, ScoredLayout]:
    """Return every layout of the archive with the results of its releases for the new values."""
    bare = account(problem.site, (), kept.bare)
    spent = {
        name: (bare.harm + bare.repair)[bare.event == name] for name in problem.site.event_names
    }
    candidates = {}
    for releases in kept.releases:
        layout = archive.layout_of(releases.barriers)
        pairs = list(zip(releases.seeds, releases.outcomes, strict=True))
        streams = [[o for seed, o in pairs if is_of_stream(seed, s)] for s in VERIFIED]
        checked = next(filter(None, streams), [])
        outcomes = tuple(checked or releases.outcomes)
        candidates[layout] = _candidate(problem, layout, outcomes, bool(checked), spent)
    return candidates


FEW_RELEASES = 8
"""Number of releases of an event to which the mean without barriers complements fewer releases."""

ERRORS = 2.0
"""Number of standard errors above an estimate of Z at which layouts are compared first [-]."""


def _candidate(
    problem: DesignProblem,
    layout: Layout,
    outcomes: tuple[Outcome, ...],
    verified: bool,
    spent: Mapping[str, np.ndarray],
) -> ScoredLayout:
    """Return a layout with the results of its releases.

    The sample of each event is extended by one release that deviates from the mean by the standard
    deviation without barriers, because an occurrence in none of n releases does not mean that its
    probability is zero.
    """
    site, costs = problem.site, account(problem.site, layout, outcomes)
    value, variance = site.annual(layout), 0.0
    chances: dict[str, tuple[Estimate, Estimate]] = {}
    for event in site.events:
        which, without = costs.event == event.name, spent[event.name]
        bills, n = (costs.harm + costs.repair)[which], int(which.sum())
        rate = site.rate(event.name, layout)
        more = max(FEW_RELEASES - n, 0)
        mean = (float(bills.sum()) + more * float(without.mean())) / (n + more)
        squares = float(np.square(bills - mean).sum()) + (more + 1) * float(without.var())
        value += rate * mean
        variance += rate**2 * squares / (n + more) ** 2
        if event.design:
            counts = int(costs.reached[which].sum()), int(costs.failed[which].sum())
            chances[event.name] = estimate(counts[0], n), estimate(counts[1], n)
    risk = None
    if problem.targets.individual is not None and costs.toll is not None:
        killed = {name: costs.toll[costs.event == name, 2].tolist() for name in site.event_names}
        risk = problem.individual_risk(layout, killed)
    ends: tuple[End, ...] = ("upper", "value", "lower")
    reach, failure = ([pair[which] for pair in chances.values()] for which in range(2))
    failing = failure if can_fail(site, layout) else []
    over = [problem.targets.excess(reach, failing, risk, end) for end in ends]
    tried = None
    if chances:
        tried = TriedLayout(layout, site.capital(layout), worst(reach), worst(failure))
    upper = value + ERRORS * math.sqrt(variance)
    return ScoredLayout(layout, outcomes, verified, upper, tried, *over)


SHORTLIST = 40
"""Number of layouts whose intervals of Z are computed to choose the best."""


def choose(
    problem: DesignProblem, candidates: Sequence[ScoredLayout], kept: Archive
) -> tuple[ScoredLayout, Evaluation]:
    """Return the best of candidates that may be built, and its evaluation.

    Among those that meet the targets, it is the one with the lowest Z. A layout that was not
    verified counts with the upper end of the 95 % interval of Z instead, so that no layout is
    chosen only because its few releases happen to be favourable.

    If none meets the targets, the choice is among the verified layouts with barriers, or among all
    if there are none. Those that are shown to miss a target are left out, unless all are. The
    choice is the layout that misses the targets least. If the probabilities of none of them are
    within the targets, others that are not shown to miss them by more and have at least half as
    many releases compete with it by Z, see `protocol.best_of_finals`.
    """
    field = [c for c in candidates if c.over <= 0.0]
    if not field:
        may = [c for c in candidates if c.verified and c.layout] or candidates
        may = [c for c in may if c.least <= 0.0] or may
        first = min(may, key=lambda c: (c.over, c.upper))
        enough = 0.5 * len(first.outcomes)
        field = [c for c in may if c.least <= first.over and len(c.outcomes) >= enough]
        if any(c.share <= 0.0 for c in may):
            field = [first]
    order = sorted(field, key=lambda c: c.upper)
    short = [*order[:SHORTLIST], *(c for c in order[SHORTLIST:] if c.verified)]
    judgements = [(c, judged(problem, c, kept)) for c in short]
    return min(judgements, key=lambda p: p[1].objective if p[0].verified else p[1].ci[1])
