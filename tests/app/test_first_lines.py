"""The first line of a design and its findings, which the command prints and the report repeats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest
from valley import SITE, Valley

from rigdda import Ditch, Fence, Layout, save_layout
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.agents.designers.protocol import DesignResult, History
from rigdda.agents.designers.rule import RuleAnswer
from rigdda.agents.run_record import RunRecord
from rigdda.app.barrier_checks import LayoutChecks
from rigdda.app.design_study import DesignStudy, VerifiedLayout
from rigdda.app.reports import design_report, findings, html_report, tables
from rigdda.app.reports.html_blocks import Figures, Items, Paragraph, ResultsFolder
from rigdda.envs import Evaluation
from rigdda.envs.barrier_formulas import BarrierCheck
from rigdda.envs.comparison import Difference
from rigdda.envs.design_envelope import DesignEnvelope
from rigdda.envs.intervals import estimate

FENCE, DITCH = (Fence(17.0, 3.0, energy_class=1000),), (Ditch(30.3, 1.0, 3.0),)
BARE = Valley(SITE).evaluate((), seeds=range(8))

LOW = BarrierCheck("ditch 1.0 m deep", 30.3, "depth", 2.0, 1.0, "m", 1.0, "")
"""A check that is not met."""

WORN = LOW._replace(barrier="existing fence 250 kJ", existing=True)
"""A check that an existing barrier does not meet."""


def evaluated(layout: Layout, z: float, targets: str | None = None, **values: Any) -> Evaluation:
    """Return an evaluation whose Z has the given value and is known to within 5 EUR."""
    chances = dict.fromkeys(SITE.event_names, estimate(0, 20))
    found = replace(
        BARE, layout=layout, objective=z, ci=(z - 5.0, z + 5.0), targets=targets, reach=chances,
        failure=chances, cost=10.0 * len(layout), releases=40,
    )  # fmt: skip
    return replace(found, **values)


def study(
    cases: dict[str, Evaluation],
    table: tuple[BarrierCheck, ...] = (),
    failing: tuple[str, ...] = (),
    difference: Difference | None = None,
    **keywords: Any,
) -> DesignStudy:
    """Return a design whose last case is the layout found.

    `table` has the checks of the layout found, and `failing` the other cases that fail a check.
    """
    problem = Valley(SITE, **keywords)
    *_, chosen = cases.values()
    return DesignStudy(
        problem=problem,
        cases=tuple(VerifiedLayout(name, e) for name, e in cases.items()),
        result=DesignResult(SITE, chosen.layout, chosen, History(()), 10, "search", (), 0.0, ()),
        left="",
        rule=RuleAnswer(FENCE, "rule", "", None, DesignEnvelope([], 0.95, [], [])),
        checks=LayoutChecks((), table, ()),
        other_checks={name: LayoutChecks((), (LOW,), ()) for name in failing},
        compliance=difference,
    )


def reported(done: DesignStudy, path: Path) -> list[Any]:
    """Return the blocks of the summary in the report of a design."""
    design_report.write_rows(path / "layouts.csv", design_report.layout_rows(done))
    design_report.write_rows(path / "chances.csv", design_report.chance_rows(done))
    rows = [design_report._check_row(check) for check in done.checks.table]
    design_report.write_rows(path / "checks.csv", rows, design_report.CHECK_COLUMNS)
    save_layout(done.chosen.evaluation.layout, path / "layout.toml")
    targets = done.problem.targets
    options = {
        "target": targets.reach, "failure": targets.failure, "target_risk": targets.individual,
        "max_cost": done.problem.max_cost, "checks": done.problem.checks,
    }  # fmt: skip
    record = RunRecord.begin("design", ["design"], options, SITE)
    record.end(["layouts.csv", "chances.csv", "checks.csv", "layout.toml"])
    record.findings = findings.of_design(done)
    return [*html_report.summary_section([ResultsFolder(path, "o", {"design": record})])]


def headline(done: DesignStudy) -> str:
    """Return the line that the command prints."""
    return findings.headline(findings.answer(done))


NOTHING = evaluated((), 212.0)
MISSING = evaluated((), 212.0, "missed")
CHEAP, DEAR = evaluated(DITCH, 181.0), evaluated(FENCE, 276.0)
REACH = {"targets": {"reach": 0.05}}
REQUIRED = {"checks": "required"}


def rule_with_a_better_constant(**keywords: Any) -> DesignStudy:
    return study({"nothing": NOTHING, "constant": CHEAP, "rule": DEAR}, **keywords)


def with_targets(nothing: str, constant: str, rule: str, **keywords: Any) -> DesignStudy:
    states = {"nothing": nothing, "constant": constant, "rule": rule}
    plain = {"nothing": NOTHING, "constant": CHEAP, "rule": DEAR}
    cases = {name: replace(plain[name], targets=state) for name, state in states.items()}
    return study(cases, **REACH, **keywords)


def without_releases_of(event: str) -> Evaluation:
    return replace(CHEAP, reach=CHEAP.reach | {event: estimate(0, 0)})


STUDIES: dict[str, tuple[Callable[[], DesignStudy], str]] = {
    "a layout that saves": (
        lambda: study({"nothing": NOTHING, "optimised (race)": CHEAP}),
        "Build: ditch",
    ),
    "a new barrier that fails a check": (
        lambda: study({"nothing": NOTHING, "optimised (race)": CHEAP}, (LOW,)),
        "Do not build this as it is: ditch",
    ),
    "an existing barrier that fails a check": (
        lambda: study({"nothing": NOTHING, "optimised (race)": CHEAP}, (WORN,)),
        "Build: ditch",
    ),
    "a rule that costs more than the constant": (
        rule_with_a_better_constant,
        "Compare with 'constant' before you build: fence",
    ),
    "a rule that costs more than a constant that fails a required check": (
        lambda: rule_with_a_better_constant(failing=("constant",), **REQUIRED),
        "Build nothing: the layout that was found costs 64 EUR per metre and year more than",
    ),
    "a rule that fails a check and costs more": (
        lambda: rule_with_a_better_constant(table=(LOW,)),
        "Do not build this as it is: fence",
    ),
    "a search that finds nothing although the rule saves": (
        lambda: study({"nothing": NOTHING, "rule": CHEAP, "optimised (race)": NOTHING}),
        "Compare with 'rule' before you decide to build nothing. 'rule' costs 31 EUR per metre",
    ),
    "a rule that misses a target that the constant meets": (
        lambda: with_targets("missed", "met", "missed"),
        "Compare with 'constant' before you build: fence",
    ),
    "a rule that fails a check and misses a target that the constant meets": (
        lambda: with_targets("missed", "met", "missed", table=(LOW,)),
        "Compare with 'constant' before you build: fence",
    ),
    "a rule that misses a target that the slope meets": (
        lambda: with_targets("met", "missed", "missed"),
        "Do not build this: fence",
    ),
    "a rule that misses a target that nothing meets": (
        lambda: with_targets("missed", "missed", "missed"),
        "No layout that was found meets the target that a block of a design event reaches",
    ),
    "a rule that meets a target that nothing misses": (
        lambda: with_targets("met", "missed", "met"),
        "Build nothing: the layout that was found costs 64 EUR",
    ),
    "a rule that is needed for a target": (
        lambda: with_targets("missed", "missed", "met"),
        "Build, for the target alone: fence",
    ),
    "nothing within a cap": (
        lambda: study({"nothing": NOTHING, "optimised (race)": NOTHING}, max_cost=100.0),
        "Build nothing: no layout was found for at most 100 EUR per metre that is worth its cost.",
    ),
    "nothing within a cap with checks": (
        lambda: study({"nothing": NOTHING, "race": NOTHING}, max_cost=0.0, **REQUIRED),
        "Build nothing: no layout was found for at most 0 EUR per metre that meets every check and",
    ),
    "a target that is missed within a cap": (
        lambda: study({"nothing": MISSING, "race": MISSING}, max_cost=0.0, **REACH),
        "No layout that was found for at most 0 EUR per metre meets the target that",
    ),
    "a design event without releases": (
        lambda: study({"nothing": NOTHING, "race": without_releases_of("block")}),
        "Build: ditch",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", STUDIES)
def test_the_report_begins_with_what_the_command_prints(name: str, tmp_path: Path) -> None:
    make, words = STUDIES[name]
    done = make()
    line = headline(done)
    assert line.startswith(words)
    assert "nan" not in line
    assert findings.is_headline(line)
    first = reported(done, tmp_path)[0]
    mood = "answer" if line.startswith("Build") else "warning"
    assert first == Paragraph(line, mood)


def test_a_better_layout_is_named_with_its_barriers() -> None:
    assert headline(rule_with_a_better_constant()).endswith(
        ". 'constant' costs 95 EUR per metre and year less: ditch at 30.3 m, 1.0 m deep, 3.0 m "
        "wide."
    )
    missed = headline(with_targets("missed", "met", "missed"))
    assert missed.endswith(
        "The target that a block of a design event reaches the road with a probability of at most "
        "5 % is missed with this layout and met with 'constant': ditch at 30.3 m, 1.0 m deep, "
        "3.0 m wide."
    )
    assert headline(with_targets("met", "missed", "missed")).endswith(
        " is missed with it and met without barriers."
    )
    fails = headline(with_targets("missed", "met", "missed", table=(LOW,)))
    assert ". The layout that was found fails its checks: " in fails
    open_ = headline(study({
        "nothing": replace(NOTHING, targets="undecided"),
        "constant": replace(DEAR, targets="met"),
        "rule": replace(NOTHING, targets="undecided"),
    }, **REACH))  # fmt: skip
    assert open_.startswith("Compare with 'constant' before you decide to build nothing. The")
    assert "is undecided without barriers and met with 'constant': fence at 17.0 m" in open_


def test_a_saving_is_to_be_shown_if_the_slope_meets_the_targets_too() -> None:
    near = replace(CHEAP, ci=(150.0, 215.0), targets="met")
    for state, words in (("met", "Verify with more releases"), ("missed", "Build: ditch")):
        bare = replace(NOTHING, targets=state)
        assert headline(study({"nothing": bare, "race": near}, **REACH)).startswith(words)


@pytest.mark.parametrize("name", ["rule", "constant"])
def test_a_layout_without_a_search_has_no_findings_on_a_search(name: str) -> None:
    other = "constant" if name == "rule" else "rule"
    done = study({"nothing": NOTHING, other: CHEAP, name: DEAR}, **REQUIRED)
    lines = " ".join(findings.of_design(done))
    assert "the search found no better layout" not in lines
    assert "--budget" not in lines
    assert (
        f"the layout {other!r} costs less per year than {name!r}: choose {other!r}, or search with "
        "--designer race" in lines
    )


def test_a_search_has_findings_on_a_search() -> None:
    done = study({"nothing": NOTHING, "rule": CHEAP, "optimised (race)": DEAR}, **REQUIRED)
    lines = " ".join(findings.of_design(done))
    assert "without required checks, the search found no better layout" in lines
    assert "than 'optimised (race)': use a larger --budget" in lines


@pytest.mark.parametrize(
    "states, attributed",
    [
        ((None, None), True),
        (("met", "met"), True),
        (("met", "missed"), False),
        (("undecided", "met"), False),
    ],
)
def test_the_checks_cost_only_what_the_targets_do_not(
    states: tuple[str | None, str | None], attributed: bool
) -> None:
    with_checks, without = states
    cases = {
        "nothing": NOTHING,
        "without checks": replace(CHEAP, targets=without),
        "optimised (race)": replace(DEAR, targets=with_checks),
    }
    apart = Difference(95.0, (80.0, 110.0), 40, 30)
    done = study(cases, failing=("without checks",), difference=apart, **REQUIRED)
    line = findings.compliance(done)
    assert ("meeting the checks costs 95 (80 to 110)" in line) == attributed
    unknown = (
        "Z is 276 (271 to 281) instead of 181 (176 to 186), but it is not known what meeting the "
        f"checks costs, because the targets are {with_checks} with them and {without} without them"
    )
    assert line.endswith(unknown) != attributed


def test_a_layout_without_checks_that_verification_shows_to_be_worse_is_no_find() -> None:
    cases = {"nothing": NOTHING, "without checks": DEAR, "optimised (race)": CHEAP}
    worse = Difference(-95.0, (-110.0, -80.0), 40, 30)
    done = study(cases, failing=("without checks",), difference=worse, **REQUIRED)
    assert findings.compliance(done) == "without required checks, the search found no better layout"
    alike = Difference(-5.0, (-20.0, 10.0), 40, 30)
    done = study(cases, failing=("without checks",), difference=alike, **REQUIRED)
    assert "it is not shown that meeting the checks costs anything" in findings.compliance(done)


def test_a_design_event_without_releases_is_left_out_and_named(tmp_path: Path) -> None:
    done = study({"nothing": NOTHING, "race": without_releases_of("block")})
    assert findings.reaching(done.chosen.evaluation, SITE) == ("", 0.0)
    unknown = (
        "no release of the design event 'block' was drawn: it is not known how often it reaches "
        "the road"
    )
    assert unknown in findings.of_design(done)
    blocks = reported(done, tmp_path)
    (shown,) = (block.figures for block in blocks if isinstance(block, Figures))
    assert ("“block” reaches the road", "not known", "no release of this event was drawn") in shown
    (lines,) = (block.lines for block in blocks if isinstance(block, Items))
    assert f"N{unknown[1:]}." in lines


def test_the_event_that_reaches_most_often_is_one_with_releases() -> None:
    site = msgspec.structs.replace(
        SITE, events=tuple(msgspec.structs.replace(event, design=True) for event in SITE.events)
    )
    chances = {"block": estimate(0, 0), "group": estimate(5, 20)}
    found = replace(CHEAP, reach=chances)
    for order in (chances, dict(reversed(chances.items()))):
        assert findings.reaching(replace(found, reach=order), site) == ("group", 0.25)


FAILURE = {"targets": {"failure": 0.1}}


def test_no_failure_is_estimated_where_nothing_can_fail(tmp_path: Path) -> None:
    never = estimate(0, 20)
    done = study({"nothing": NOTHING, "constant": CHEAP, "rule": DEAR}, **FAILURE)
    for row in design_report.chance_rows(done):
        assert (row["failure"] == 0.0) == (row["layout"] == "rule")
        assert row["reach"] == 0.0
    text = tables.chances(done)
    assert text is not None
    bounds = [*text.columns[3].cells]
    assert bounds == ["-", "-", tables.bounded(never)]
    front = [TriedLayout(case.evaluation.layout, 1.0, never, never) for case in done.cases]
    fails = [row["failure_bound"] for row in design_report.frontier_rows(SITE, front)]
    assert [bound == never.bound for bound in fails] == [False, False, True]
    shown = design_report.frontier_table(SITE, front)
    assert [*shown.columns[3].cells] == ["-", "-", "0 %"]
    assert findings.failing(SITE, CHEAP) == []
    (line,) = findings.failing(SITE, DEAR)
    assert line.startswith("a barrier fails in 0 % of the releases of the design event 'block'")
    blocks = reported(study({"nothing": NOTHING, "constant": CHEAP}, **FAILURE), tmp_path)
    (figures,) = (block.figures for block in blocks if isinstance(block, Figures))
    assert not [name for name, *_ in figures if "fails" in name]


def test_a_table_of_checks_tells_which_barriers_exist(tmp_path: Path) -> None:
    done = study({"nothing": NOTHING, "race": CHEAP}, (LOW, WORN))
    reported(done, tmp_path)
    _, rows = ResultsFolder(tmp_path, "o", {}).table("checks.csv")
    assert [row["existing"] for row in rows] == ["False", "True"]
    assert [one.barrier for one in findings.failed_checks(done.checks)] == [
        "ditch 1.0 m deep, at 30.3 m"
    ]
