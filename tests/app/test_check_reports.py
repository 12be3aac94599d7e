"""Tables and the picture of checks that a design writes."""

from __future__ import annotations

import csv
from pathlib import Path

import msgspec
import pytest
from envelopes import envelope
from light_site import LIGHT

from rigdda import Fence
from rigdda.agents.designers.rule import judge
from rigdda.app.barrier_checks import BarrierCheck, LayoutChecks
from rigdda.app.reports import checks, demand_picture
from rigdda.envs import DesignProblem
from rigdda.envs.fence_checks import FenceCheck, demand_at

STATIONS = {11.3 + i: 8.0 + i for i in range(24)}


@pytest.fixture
def problem() -> DesignProblem:
    return DesignProblem("quick")


def test_the_demand_along_the_slope_says_which_classes_do(problem: DesignProblem) -> None:
    rows = [*checks.along_slope(problem, envelope(STATIONS, height=1.0))]
    assert [row["x_m"] for row in rows] == [*STATIONS]
    for row in rows:
        fit = [int(name) for name in row["classes_that_fit_kJ"].split()]
        assert all(name > row["demanded_energy_kJ"] for name in fit)
        demanded = row["demanded_class_kJ"]
        assert all(name >= demanded for name in fit)
        assert row["demanded_energy_kJ"] == pytest.approx(1.2 * row["design_energy_kJ"])
    near = rows[-1]  # 0.5 m from the road no elongation is clear
    assert near["classes_that_fit_kJ"] == ""


def test_the_demanded_energy_is_that_of_a_class_also_at_the_service_level(
    problem: DesignProblem,
) -> None:
    service = msgspec.structs.replace(problem.site.rule, level="SEL", energy=1.0)
    at = DesignProblem(msgspec.structs.replace(problem.site, rule=service))
    (row, *_) = checks.along_slope(at, envelope(STATIONS))
    assert row["demanded_energy_kJ"] == pytest.approx(3.0 * row["design_energy_kJ"])


def test_the_picture_is_drawn_for_any_demand(problem: DesignProblem, tmp_path: Path) -> None:
    for name, mass, height in (("usual", 1000.0, 1.0), ("huge", 1e7, 40.0), ("tiny", 1.0, 0.1)):
        found = envelope(STATIONS, mass=mass, height=height)
        rows = [*checks.along_slope(problem, found)]
        layouts = {"rule": (Fence(18.3, 3.5, energy_class=1000),), "layout found": ()}
        file = tmp_path / f"{name}.png"
        demand_picture.write(file, problem, rows, layouts)
        assert file.read_bytes().startswith(b"\x89PNG") and file.stat().st_size > 20_000


def test_the_words_on_the_rule_say_what_it_is(problem: DesignProblem) -> None:
    fits = judge(problem, envelope({20.0: 10.0}))
    words = checks.rule_words(fits)
    assert words.startswith("rule (UNI 11211-4): fence 100 kJ, 2.0 m high, at 20.0 m")
    assert "utilisation: energy 0.77" in words
    none = judge(DesignProblem("quick", kinds=("fence", "ditch")), envelope({20.0: 90.0}, mass=1e6))
    words = checks.rule_words(none)
    assert words.startswith("the rule (UNI 11211-4) gives no fence: no fence fits")
    assert "shown instead: ditch" in words


def test_a_check_that_is_not_met_is_told() -> None:
    good = BarrierCheck("fence", 1.0, "energy", 80.0, 100.0, "kJ", 1.0, "block")
    bad = BarrierCheck("wall", 2.0, "sliding, rock", 80.0, 100.0, "kN/m", 1.0 / 1.5, "full")
    found = LayoutChecks((), (good, bad), ("fence 100 kJ, at 3.0 m",))
    told = [*checks.notes(found)]
    assert told[0] == "not met: wall, sliding, rock: full"
    assert told[1:] == ["no block of the design events reaches the fence 100 kJ, at 3.0 m"]
    assert checks.table(found).row_count == 4


def test_the_sheets_hold_every_figure_to_the_digit(problem: DesignProblem) -> None:
    answer = judge(problem, envelope({20.0: 10.0}))
    fence = Fence(20.0, 2.0, energy_class=250)
    demand = demand_at(answer.envelope, problem.site.rule, 20.0)
    assert answer.check is not None and demand is not None
    mine = FenceCheck.of(problem.site, fence, demand)
    rows = [*checks.sheets(answer, LayoutChecks((mine,), (), ()))]
    half = len(rows) // 2
    assert {row["layout"] for row in rows[:half]} == {"rule"}
    assert {row["layout"] for row in rows[half:]} == {"layout found"}
    for row, own in zip(rows[half:], mine.rows(), strict=True):
        assert (row["symbol"], row["value"]) == (own.symbol, own.value)


def test_a_design_writes_its_checks(tmp_path: Path) -> None:
    from rigdda.app import design
    from rigdda.app.reports.folder import FILES

    assert set(checks.FILES) <= set(FILES)
    problem = DesignProblem(LIGHT, kinds=("fence",))
    done, _ = design.design(problem, "rule", 40, 0, 20, tmp_path, lambda *_: None)
    checks.write(done, tmp_path)
    with (tmp_path / "checks.csv").open(newline="", encoding="utf-8") as file:
        table = [*csv.DictReader(file)]
    assert [row["check"] for row in table] == ["energy", "height", "elongation"]
    for row, found in zip(table, done.checks.table, strict=True):
        assert float(row["use"]) == found.use
        assert float(row["demand"]) / float(row["capacity"]) == found.use
    assert [case.name for case in done.cases] == ["nothing", "constant", "rule"]
    assert all((tmp_path / name).is_file() for name in checks.FILES)
