"""The frontier of a missed target, and that every sentence holds for the table above it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from processes import rows
from valley import SITE, Barren, Valley, seen

from rigdda import Ditch, Fence
from rigdda.agents import designers
from rigdda.agents.designers.frontier import TriedLayout, frontier
from rigdda.agents.designers.protocol import DesignResult, History, best_of_finals, ranked
from rigdda.agents.designers.rule import RuleAnswer
from rigdda.app import design, verified_frontier
from rigdda.app.barrier_checks import LayoutChecks
from rigdda.app.design_study import DesignStudy, VerifiedLayout
from rigdda.app.reports import design_report, findings
from rigdda.app.reports.wording import at_most, euros, percent, span
from rigdda.barriers import to_tables
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.design_envelope import DesignEnvelope
from rigdda.envs.intervals import estimate
from rigdda.envs.problem import Targets

FENCE, DITCH = Fence(17.0, 3.0, energy_class=1000), Ditch(30.3, 1.0, 3.0)
LAYOUTS = ((), (FENCE,), (DITCH,), (FENCE, DITCH))
PROBLEM = Valley(SITE, targets={"reach": 0.03, "failure": 0.05})
BARE = PROBLEM.evaluate((), seeds=range(8))


def evaluations(problem: DesignProblem, layout: tuple) -> st.SearchStrategy[Evaluation]:
    """Return evaluations of a layout whose parts add up, as any releases might give them."""
    costs = st.integers(0, 200_000).map(lambda cents: cents / 100)

    @st.composite
    def one(draw: st.DrawFn) -> Evaluation:
        capital = draw(costs) if layout else 0.0
        events = {name: draw(costs) for name in problem.site.event_names}
        left = sum(events.values())
        harm = left * draw(st.floats(0.0, 1.0))
        n = draw(st.sampled_from([10, 90, 1000, 3000]))

        def chances() -> dict:
            return {name: estimate(draw(st.integers(0, n)), n) for name in events}

        z = capital + left
        low, high = draw(st.integers(0, 20)) / 20, draw(st.integers(20, 40)) / 20
        found = replace(
            BARE,
            layout=layout,
            objective=z,
            ci=(capital + low * left, capital + high * left),
            capital=capital,
            harm=harm,
            repair=left - harm,
            cost=draw(costs) if layout else 0.0,
            reach=chances(),
            failure=chances(),
            by_event=events,
            releases=2 * n,
        )
        return replace(found, targets=problem.state(found))

    return one()


@st.composite
def studies(draw: st.DrawFn) -> DesignStudy:
    """Return a design study with any numbers and any choice."""
    asked = draw(st.sampled_from([Targets(), Targets(0.03), Targets(0.3, 0.05)]))
    problem = Valley(SITE, targets=asked)
    found = [draw(evaluations(problem, layout)) for layout in LAYOUTS[:3]]
    chosen = draw(st.sampled_from(LAYOUTS))
    last = found[LAYOUTS.index(chosen)] if chosen in LAYOUTS[:3] else draw(
        evaluations(problem, chosen)
    )  # fmt: skip
    names = ("nothing", "rule", "constant", "optimised (race)")
    cases = tuple(map(VerifiedLayout, names, [*found, last]))
    bounds = ("fence: start of the zone",)
    result = DesignResult(
        problem.site, chosen, last, History(()), 10, "search", bounds, 0.0, ()
    )  # fmt: skip
    left = findings.left_over(last)
    rule = RuleAnswer((), "no barrier", "", None, DesignEnvelope([], 0.95, [], []))
    return DesignStudy(
        problem=problem,
        cases=cases,
        result=result,
        left=left,
        rule=rule,
        checks=LayoutChecks((), (), ()),
    )


SPAN = r"[\d.,e+]+ to [\d.,e+]+"


def check_sentence(line: str, done: DesignStudy) -> None:
    """Check one clause against the numbers of the table; one that no rule covers fails."""
    table = {case.name: case.evaluation for case in done.cases}
    nothing, chosen, name = done.nothing.evaluation, done.chosen.evaluation, done.cases[-1].name
    if line == "none of the verified layouts costs less per year than no barrier":
        assert not chosen.layout
        assert all(e.objective >= nothing.objective for e in table.values())
    elif found := re.fullmatch(r"(.*) may cost less per year than no barrier, but ([\d,]+) "
                               r"releases do not show it", line):  # fmt: skip
        for one in found[1].split(" and "):
            other = table[one.strip("'")]
            assert other.objective < nothing.objective and other.ci[1] >= nothing.ci[0]
        assert found[2] == f"{nothing.releases:,}"
    elif found := re.fullmatch(rf"[\d,]+ releases do not show that the layout saves more than it "
                               rf"costs: Z is ({SPAN}) with the layout and ({SPAN}) without "
                               r"barriers", line):  # fmt: skip
        assert chosen.ci[1] >= nothing.ci[0] and nothing.ci[1] >= chosen.ci[0]
        assert found.groups() == (span(chosen.ci), span(nothing.ci))
    elif found := re.fullmatch(rf"the layout costs more per year than it saves: Z is ({SPAN}) with "
                               rf"it and ({SPAN}) without barriers", line):  # fmt: skip
        assert chosen.ci[0] > nothing.ci[1] and chosen.objective > nothing.objective
        assert found.groups() == (span(chosen.ci), span(nothing.ci))
    elif found := re.fullmatch(r"the layout '(.*)' costs less per year than '(.*?)'(.*)", line):
        assert found[2] == name and table[found[1]].objective < chosen.objective
        check_advice(found[3], table[found[1]], chosen)
    elif found := re.fullmatch(rf"the layout '(.*)' may cost as little per year \(({SPAN}), (.*) "
                               rf"({SPAN})\) and is cheaper to build: (\S+) instead of (\S+) EUR "
                               r"per metre", line):  # fmt: skip
        other = table[found[1]]
        assert other.ci[0] <= chosen.ci[1] and other.cost < chosen.cost
        told = (span(other.ci), name, span(chosen.ci), euros(other.cost), euros(chosen.cost))
        assert found.groups()[1:] == told and found[5] != found[6]
    else:
        check_rest(line, done, chosen)


def check_advice(words: str, other: Evaluation, chosen: Evaluation) -> None:
    if words == ": use a larger --budget":
        assert other.targets in (None, "met", "undecided")
        assert chosen.targets != "met" or other.targets == "met"
    elif words == ", but also misses the targets":
        assert (other.targets, chosen.targets) == ("missed", "missed")
    else:
        states = f"{other.targets}, whereas those of the latter are {chosen.targets}"
        assert words == f", but its targets are {states}"
        assert findings.TARGET_RANK[other.targets] > findings.TARGET_RANK[chosen.targets]


def check_rest(line: str, done: DesignStudy, chosen: Evaluation) -> None:
    targets = done.problem.targets
    if found := re.fullmatch(r"a barrier fails in (.*) of the releases of the design event '(.*)' "
                             r"\(95 % upper bound (.*)\)", line):  # fmt: skip
        chance = chosen.failure[found[2]]
        assert (found[1], found[3]) == (percent(chance.probability), at_most(chance.bound))
    elif found := re.fullmatch(r"target (.*) in every design event: (met|missed|undecided)", line):
        events = [event.name for event in done.problem.site.events if event.design]
        pairs = [(chosen.reach, targets.reach)]
        if FENCE in chosen.layout:  # a ditch cannot fail
            pairs.append((chosen.failure, targets.failure))
        asked = [(seen[e], p) for seen, p in pairs if p is not None for e in events]
        bad = any(chance.floor > p for chance, p in asked)
        good = all(chance.bound <= p for chance, p in asked)
        assert found[2] == ("missed" if bad else "met" if good else "undecided")
    elif line == "a larger --verify would decide it":
        assert chosen.targets == "undecided"
    elif found := re.fullmatch(r"the remaining harm and repair are (\S+) EUR per metre and year",
                               line):  # fmt: skip
        assert found[1] == euros(sum(chosen.by_event.values()))
        assert sum(chosen.by_event.values()) == pytest.approx(chosen.harm + chosen.repair)
    elif found := re.fullmatch(r"(\S+) of this is from the event '(.*)'", line):
        most = max(chosen.by_event.values())
        assert found[1] == euros(chosen.by_event[found[2]]) == euros(most)
    elif found := re.fullmatch(r"no event contributes more than ([\d.]+) %", line):
        total = sum(chosen.by_event.values())
        assert all(100.0 * z / total <= float(found[1]) + 1e-9 for z in chosen.by_event.values())
    elif line == "no harm or repair remains in these releases":
        assert chosen.harm + chosen.repair == pytest.approx(0.0, abs=1e-9)
    else:
        bound = "the layout lies on a bound of the search: " + ", ".join(done.result.on_bound)
        assert line == bound, f"no rule for: {line}"


def clauses(lines: Sequence[str]) -> list[str]:
    return [clause for line in lines for clause in line.split("; ")]


@pytest.mark.filterwarnings("ignore::hypothesis.errors.HypothesisWarning")
@settings(max_examples=200, deadline=None)
@given(studies())
def test_every_sentence_holds_for_the_table_under_which_it_stands(done: DesignStudy) -> None:
    for clause in clauses(findings.of_design(done)):
        check_sentence(clause, done)


@pytest.mark.filterwarnings("ignore::hypothesis.errors.HypothesisWarning")
@settings(max_examples=200, deadline=None)
@given(studies())
def test_what_pays_is_never_denied(done: DesignStudy) -> None:
    words = " ".join(findings.of_design(done))
    nothing = done.nothing.evaluation
    better = [c.name for c in done.cases[1:-1] if c.evaluation.ci[1] < nothing.ci[0]]
    if better and not done.chosen.evaluation.layout:
        assert "none of the verified layouts" not in words
        assert all(f"the layout {name!r} costs less per year" in words for name in better)


@pytest.mark.parametrize("share", [0.0, 1e-5, 0.0304, 0.03, 0.0949, 0.0996, 0.1, 0.123, 0.999, 1.0])
def test_an_upper_bound_is_rounded_up(share: float) -> None:
    told = float(at_most(share).removesuffix(" %"))
    assert 100.0 * share <= told + 1e-9
    assert told - 100.0 * share <= max(1.0, 0.1 * told)
    assert at_most(0.03) == "3 %" and at_most(0.0304) == "3.1 %"


points = st.builds(
    lambda cost, count, n: TriedLayout((), float(cost), estimate(min(count, n), n), estimate(0, n)),
    st.integers(0, 12), st.integers(0, 30), st.sampled_from([5, 20, 30]),
)  # fmt: skip


@settings(max_examples=200, deadline=None)
@given(st.lists(points, min_size=1, max_size=30))
def test_a_frontier_holds_all_that_nothing_dominates(tried: list[TriedLayout]) -> None:
    front = frontier(tried)

    def dominates(a: TriedLayout, b: TriedLayout) -> bool:
        no_worse = a.cost <= b.cost and a.level <= b.level
        return no_worse and (a.cost, a.level) != (b.cost, b.level)

    for one in front:
        assert not any(dominates(other, one) for other in tried)
    left = {(one.cost, one.level) for one in tried if not any(dominates(o, one) for o in tried)}
    assert {(one.cost, one.level) for one in front} == left
    assert [one.cost for one in front] == sorted(one.cost for one in front)


def test_a_dear_layout_is_not_chosen_for_a_difference_by_chance() -> None:
    """Fence of 7,499 EUR/m at 5.0 % against fence and ditch of 3,773 EUR/m at 2.8 to 3.7 %."""

    def evaluated(layout: tuple, z: float, cost: float, count: int, n: int) -> Evaluation:
        chance = dict.fromkeys(BARE.reach, estimate(count, n))
        found = replace(BARE, layout=layout, objective=z, cost=cost, reach=chance,
                        failure=dict.fromkeys(BARE.reach, estimate(0, n)))  # fmt: skip
        return replace(found, targets=problem.state(found))

    problem = Valley(SITE, targets={"reach": 0.002})
    lucky = evaluated((FENCE,), 400.0, 7499.0, 3, 140)
    both = evaluated((FENCE, DITCH), 230.0, 3773.0, 5, 140)
    assert best_of_finals(problem, [lucky, both]) == both
    worse = evaluated((DITCH,), 100.0, 300.0, 60, 140)
    assert best_of_finals(problem, [lucky, both, worse]) == both
    open_ = evaluated((DITCH, FENCE), 900.0, 9e3, 1, 140)
    assert open_.targets == "undecided"  # layouts that are shown to miss it rank behind it
    assert best_of_finals(problem, [lucky, both, open_, worse]) == open_
    within = evaluated((), 300.0, 0.0, 0, 140)
    assert best_of_finals(problem, [lucky, both, within]) == within
    free = Valley(SITE)
    assert best_of_finals(free, [lucky, both, worse]) == ranked(free, [lucky, both, worse])[0]


def dominated(one: TriedLayout, tried: Sequence[TriedLayout]) -> list[TriedLayout]:
    """Return the layouts that are cheaper and have a lower bound, or one of both."""
    return [
        other
        for other in tried
        if other.cost <= one.cost and other.level <= one.level
        and (other.cost, other.level) != (one.cost, one.level)
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["race", "random", "tpe"])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_search_returns_what_no_layout_of_it_dominates(
    name: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rigdda.agents.designers.catalogue.ensemble", seen)
    problem = Valley(SITE, targets={"reach": 1e-4})
    result = designers.module(name).design(problem, 1_500, seed)
    assert {one.layout for one in result.tried} == {
        entry.evaluation.layout for entry in result.history.entries
    }
    assert result.frontier
    assert not any(dominated(one, result.tried) for one in result.frontier)
    for one in result.tried:
        own = [e.evaluation for e in result.history.entries if e.evaluation.layout == one.layout]
        assert one.cost == problem.site.capital(one.layout) == own[0].cost
        assert one.reach.releases <= sum(e.reach["block"].releases for e in own)


@pytest.mark.parametrize("seed", [0, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("site", [Valley, Barren])
def test_a_missed_target_returns_a_verified_frontier(
    site: type[Valley], seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rigdda.agents.designers.catalogue.ensemble", seen)
    problem = site(SITE, targets={"reach": 1e-4})
    done, _ = design.design(problem, "race", 1_500, seed, 500, tmp_path, lambda *_: None)
    chosen = done.chosen.evaluation
    assert chosen.targets == "missed" and done.frontier
    known = done.result.tried
    assert len({one.layout for one in known}) == len(known)
    assert done.frontier == done.result.frontier
    searched = rows(tmp_path / "evaluations.csv")
    assert {json.dumps(to_tables(one.layout)) for one in known} == {
        row["barriers"] for row in searched
    }
    table = rows(tmp_path / "evaluations.csv")
    extra = [row for row in table if row["stage"] == "frontier"]
    assert len(extra) <= verified_frontier.MOST_VERIFIED + len(done.cases)
    assert len({row["barriers"] for row in extra}) == len(extra)  # each once
    assert len(extra) >= sum(one.verified is not None for one in done.frontier) - len(done.cases)
    told = {  # the choice is verified on releases that did not affect it
        float(row["objective"])
        for row in table
        if row["stage"] == "verification"
        and row["barriers"] == json.dumps(to_tables(chosen.layout))
    }
    assert told == {chosen.objective}
    verified = {one.layout for one in done.frontier if one.verified is not None}
    for one in done.frontier:
        assert not dominated(one, known)
    assert () in verified
    floor = min(one.reach.bound for one in done.frontier if one.verified is not None)
    assert chosen.reach["block"].floor <= floor
    lines = findings.frontier(done, done.frontier, len(known), done.replaced)
    assert f"among {len(known):,} layouts" in lines[0]
    count = len(verified)
    assert ("all of these layouts were verified" in lines[1]) == (count == len(done.frontier))
    least = min(done.frontier, key=lambda one: one.level)
    assert f"is {at_most(least.level)}, for {euros(least.cost)} EUR" in lines[2]
    design_report.write_frontier(tmp_path, problem, done.frontier)
    written = rows(tmp_path / "frontier.csv")
    assert [float(row["cost"]) for row in written] == [one.cost for one in done.frontier]
    assert [float(row["reach_bound"]) for row in written] == [o.level for o in done.frontier]
    assert (tmp_path / "frontier.png").read_bytes().startswith(b"\x89PNG")
    again, resumed = design.design(problem, "race", 1_500, seed, 500, tmp_path, lambda *_: None)
    assert resumed.simulated == 0 and again.frontier == done.frontier
    design_report.write_frontier(tmp_path, problem, ())
    assert not (tmp_path / "frontier.csv").exists()


def test_an_undecided_layout_is_replaced_by_one_that_meets_the_target() -> None:
    """The rule meets the target, whereas that of the search may miss it."""

    def evaluated(layout: tuple, z: float, count: int, n: int) -> Evaluation:
        chance = dict.fromkeys(BARE.reach, estimate(count, n))
        none = dict.fromkeys(BARE.reach, estimate(0, n))
        found = replace(BARE, layout=layout, objective=z, reach=chance, failure=none, releases=n)
        return replace(found, targets=PROBLEM.state(found))

    rule, cheap = evaluated((FENCE,), 900.0, 0, 1000), evaluated((DITCH,), 100.0, 30, 1000)
    assert (rule.targets, cheap.targets) == ("met", "undecided")
    known = {own.layout: own for own in (rule, cheap, evaluated((), 200.0, 500, 1000))}
    checked: list[str] = []

    def check(layout: tuple, stage: str) -> Evaluation:
        checked.append(stage)
        return known[layout]

    result = DesignResult(PROBLEM.site, cheap.layout, cheap, History(()), 10, "search", (), 0.0, ())
    cases = [VerifiedLayout(n, e) for n, e in zip("abc", (known[()], rule, cheap), strict=True)]
    found, front, replaced = verified_frontier.with_frontier(PROBLEM, result, cases, check, True)
    assert (found.layout, front, replaced) == (rule.layout, (), True)
    assert cases[-1].evaluation == rule
    assert checked == ["frontier", "frontier"]  # no barrier is shown to miss it
    alone = [VerifiedLayout("a", known[()]), VerifiedLayout("c", cheap)]
    same = verified_frontier.with_frontier(PROBLEM, result, alone, check, True)
    assert same == (result, (), False)
