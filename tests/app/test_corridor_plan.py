"""The choice of layouts for a budget, and `rigdda corridor` as users meet it."""

from __future__ import annotations

import csv
import dataclasses
import itertools
import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from processes import png_size, refused, rig, rows, run
from test_report import Page

import rigdda
from rigdda import BadInput, Corridor, CorridorSection, Ditch, Fence, Site, load_layout
from rigdda.agents.corridor import allocation, planning, programme
from rigdda.agents.corridor.allocation import Estimates
from rigdda.agents.corridor.programme import SIMPLE_METHODS, Options
from rigdda.app.reports import corridor_report
from rigdda.envs import CorridorProblem, DesignProblem
from rigdda.envs.intervals import upper_bound
from rigdda.model import corridor as corridors

EXAMPLE = Path(rigdda.__file__).parents[1] / "examples/corridor/pass-road.toml"

Row = list[tuple[float, float]]


def options(fronts: list[Row], missed: list[list[float]] | None = None) -> Options:
    """Return options of sections from pairs of cost and value."""
    arrays = [np.array([(0.0, 100.0), *row]) for row in fronts]
    none = [np.zeros(len(own)) for own in arrays]
    return Options(
        np.ones(len(arrays)),
        [own[:, 0] for own in arrays],
        [0.05 * own[:, 0] for own in arrays],
        [own[:, 1] for own in arrays],
        none if missed is None else [np.array(own) for own in missed],
    )


def enumerated(given: Options, budget: float, yearly: float = math.inf) -> float:
    """Return the least total cost of all choices within the budgets."""
    found = []
    for choice in itertools.product(*(range(len(own)) for own in given.values)):
        within = given.total(choice, given.costs) <= budget * (1.0 + 1e-9)
        if within and given.total(choice, given.annual) <= yearly * (1.0 + 1e-9):
            found.append(given.total(choice, given.values))
    return min(found)


number = st.floats(1.0, 100.0).map(lambda value: round(value, 3))
fronts = st.lists(st.lists(st.tuples(number, number), max_size=4), min_size=1, max_size=4)


@settings(max_examples=60, deadline=None)
@given(fronts, st.floats(0.0, 300.0), st.floats(0.5, 20.0))
def test_the_optimum_is_that_of_an_enumeration(
    rows: list[Row], budget: float, yearly: float
) -> None:
    given = options(rows)
    choice = programme.optimum(given, budget, yearly)
    assert given.total(choice, given.costs) <= budget * (1.0 + 1e-6) + 1e-6
    best = enumerated(given, budget, yearly)
    assert given.total(choice, given.values) == pytest.approx(best, rel=1e-5)


@settings(max_examples=60, deadline=None)
@given(fronts, st.floats(0.0, 300.0), st.none() | st.floats(0.5, 20.0))
def test_simple_methods_stay_within_the_budgets_and_are_not_better(
    rows: list[Row], budget: float, yearly: float | None
) -> None:
    given = options(rows)
    limit = math.inf if yearly is None else yearly
    best = enumerated(given, budget, limit)
    for method in SIMPLE_METHODS.values():
        choice = method(given, budget, yearly)
        assert given.total(choice, given.costs) <= budget * (1.0 + 1e-6) + 1e-6
        assert given.total(choice, given.annual) <= limit * (1.0 + 1e-6) + 1e-6
        assert given.total(choice, given.values) >= best - 1e-6


def test_simple_methods_are_limited_by_the_yearly_budget() -> None:
    given = options([[(10.0, 50.0), (40.0, 20.0)], [(10.0, 60.0), (40.0, 40.0)]])
    for method in SIMPLE_METHODS.values():
        assert method(given, 1000.0) == (2, 2)
        assert method(given, 1000.0, 0.0) == (0, 0)
        assert method(given, 1000.0, 1.0) == (1, 1) or method is programme.worst_first
    assert programme.worst_first(given, 1000.0, 2.0) == (2, 0)


def test_next_steps_keep_the_yearly_budget_and_the_targets() -> None:
    given = options([[(10.0, 50.0), (40.0, 20.0)]], [[0.1, 0.1, 0.2]])
    steps = [step.after for step in planning._following(given, (0,), None)]
    assert steps == [1]  # the other option misses a target more
    assert planning._following(given, (0,), 0.4) == ()  # it costs 0.5 a year


@settings(max_examples=40, deadline=None)
@given(fronts, st.floats(1.0, 300.0))
def test_the_shadow_price_is_the_slope_of_the_linear_relaxation(
    rows: list[Row], budget: float
) -> None:
    given = options(rows)

    def relaxed(money: float) -> float:
        total = given.total(given.nothing, given.values)
        for step in programme.increments(given):
            part = min(1.0, money / step.cost)
            total -= part * step.saving
            money -= part * step.cost
            if money <= 0.0:
                break
        return total

    price, step = programme.shadow_price(given, budget), 1e-6 * budget
    before, after = relaxed(budget - step), relaxed(budget + step)
    low, high = sorted((relaxed(budget) - after, before - relaxed(budget)))
    assert low / step - 1e-3 <= price <= high / step + 1e-3
    slopes = [step.saving / step.cost for step in programme.increments(given)]
    assert slopes == sorted(slopes, reverse=True) and all(slope > 0.0 for slope in slopes)


def test_a_thousand_sections_take_seconds() -> None:
    rng = np.random.default_rng(0)
    lengths, costs, values = rng.uniform(50.0, 300.0, 1000), [], []
    for length in lengths:
        own = np.sort(np.append(0.0, rng.uniform(50.0, 3000.0, rng.integers(5, 12))))
        left = np.exp(-own / rng.uniform(200.0, 1500.0)) * rng.uniform(0.8, 1.2, len(own))
        costs.append(length * own)
        values.append(length * (rng.lognormal(5.5, 1.0) * left + 0.05 * own))
    none = [np.zeros(len(own)) for own in costs]
    given = Options(lengths, costs, [0.05 * own for own in costs], values, none)
    budget, begun = 200.0 * float(lengths.sum()), time.process_time()
    choice = programme.optimum(given, budget)
    assert time.process_time() - begun < 10.0
    assert given.total(choice, given.costs) <= budget * (1.0 + 1e-6)
    assert given.gain(choice) >= given.gain(programme.by_ratio(given, budget))


def test_missed_targets_come_before_cost() -> None:
    given = options([[(10.0, 120.0), (30.0, 50.0)]], [[0.2, 0.0, 0.1]])
    assert programme.optimum(given, 100.0) == (1,)
    assert programme.optimum(given, 5.0) == (0,)


def test_a_robust_choice_avoids_what_may_be_bad() -> None:
    given = options([[(10.0, 40.0), (10.0, 42.0)]])
    rng = np.random.default_rng(0)
    risky = 40.0 + 30.0 * rng.standard_normal(500)
    scenarios = [np.column_stack([np.full(500, 100.0), risky, np.full(500, 42.0)])]
    assert programme.optimum(given, 20.0) == (1,)
    assert programme.optimum(given, 20.0, scenarios=scenarios) == (2,)


def section(gaps: list[float], releases: float = 100.0) -> Estimates:
    """Return estimates of options that cost 0, 100, 200 EUR/m and so on, and save a gap each."""
    value = 100.0 - np.array([0.0, *gaps])
    count = len(value)
    cost = 100.0 * np.arange(count)
    return Estimates(100.0, cost, value, np.full(count, 2500.0), np.full(count, releases))


def test_releases_go_to_the_section_whose_choice_is_uncertain() -> None:
    clear, close = section([40.0]).worth([0.0]), section([1.0]).worth([0.0])
    assert close[1] > 100.0 * clear[1]
    priced = section([40.0]).worth([0.4])  # 100 EUR/m at .4 a year cost as much as they save
    assert priced[1] > 100.0 * clear[1]
    found = allocation.batches(
        [section([40.0]), section([1.0])], [0.0], 20 * allocation.BATCH_RELEASES
    )
    assert found[1, 1] > 10 and sum(found.values()) == 20
    assert all(option > 0 for _, option in found)  # no barrier is known already


@given(st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=5), st.floats(0.0, 1.0))
def test_a_batch_never_harms_and_the_next_one_is_worth_less(
    gaps: list[float], price: float
) -> None:
    few, many = section(gaps), section(gaps, 10_000.0)
    assert (few.worth([price]) >= 0.0).all()
    assert many.worth([price]).sum() <= few.worth([price]).sum() + 1e-9


def test_the_opportunity_cost_is_the_mean_of_what_is_lost() -> None:
    drawn = np.random.default_rng(0).standard_normal(200_000)
    expected = np.maximum(-(3.0 + 2.0 * drawn), 0.0).mean()
    found = allocation.opportunity(np.array([3.0]), np.array([4.0]))
    assert found[0] == pytest.approx(expected, rel=0.03)


TEXT = """name = "pass"
budget = [4_000, 12_000]
[[sections]]
site = "verge"
length = 100.0
name = "km 1.2"
[[sections]]
site = "narrow"
length = 50.0
"""
SMALL = ("--releases", 300)


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("pass")
    (folder / "pass.toml").write_text(TEXT)
    words = run("corridor", "pass.toml", *SMALL, "--out", "o", folder=folder)
    return folder / "o", words


def test_the_command_writes_what_its_tables_say(planned: tuple[Path, str]) -> None:
    out, words = planned
    budgets = rows(out / "budgets.csv")
    assert [row["budget"] for row in budgets[::4]] == ["4000.0", "12000.0", "unlimited"]
    sections = rows(out / "sections.csv")
    for row in budgets:
        if row["budget"] != "unlimited":
            assert float(row["spent"]) <= float(row["budget"]) * (1.0 + 1e-9)
        low, gain, high = (float(row[name]) for name in ("gain_low", "gain", "gain_high"))
        assert low <= gain <= high
    for i, budget in enumerate(("4000.0", "12000.0")):
        own = [row for row in sections if row["budget"] == budget]
        best = budgets[4 * i]
        assert math.fsum(float(row["cost"]) for row in own) == pytest.approx(float(best["spent"]))
        assert math.fsum(float(row["gain"]) for row in own) == pytest.approx(float(best["gain"]))
        problem = CorridorProblem(Corridor.load(out.parent / "pass.toml"))
        names = (out / f"layouts/budget-{i + 1}/section-{s + 1}.toml" for s in range(2))
        layouts = [load_layout(name) for name in names]
        assert problem.cost(layouts) == pytest.approx(float(best["spent"]))
    assert png_size(out / "gain.png")[0] > 500 and png_size(out / "strip.png")[0] > 500
    assert "km 1.2" in words and "unlimited" in words


def test_layouts_are_told_with_their_places(planned: tuple[Path, str]) -> None:
    out, words = planned
    layout = load_layout(out / "layouts/budget-2/section-1.toml")
    assert layout
    placed = f"at x = {layout[0].x:.1f} m"
    section = next(r for r in rows(out / "sections.csv") if r["budget"] == "12000.0")
    assert placed in section["layout"] and placed in " ".join(words.split())
    fronts = [(row["section"], row["layout"]) for row in rows(out / "fronts.csv")]
    assert all("at x = " in layout or layout == "no barrier" for _, layout in fronts)
    assert len(set(fronts)) == len(fronts)
    assert "at x = " in rows(out / "priorities.csv")[0]["build"]


def test_the_corridor_is_kept_as_it_was_used(planned: tuple[Path, str], tmp_path: Path) -> None:
    out, _ = planned
    copy = out / "corridor-as-used/corridor.toml"
    assert Corridor.load(copy) == Corridor.load(out.parent / "pass.toml")
    run("corridor", copy, *SMALL, "--out", "again", folder=tmp_path)
    for name in ("budgets.csv", "sections.csv"):
        assert (tmp_path / "again" / name).read_bytes() == (out / name).read_bytes()
    run("report", out, "--out", "page", folder=tmp_path)
    page = (tmp_path / "page/report.html").read_text(encoding="utf-8")
    assert "the folder corridor-as-used has the corridor" in page
    assert "and the site as it was used" not in page


def test_files_of_an_earlier_run_do_not_remain(tmp_path: Path) -> None:
    (tmp_path / "pass.toml").write_text(TEXT)
    few = ("--releases", 200, "--out", "o")
    run("corridor", "pass.toml", *few, folder=tmp_path)
    out, (one, _, _) = tmp_path / "o", TEXT.partition('[[sections]]\nsite = "narrow"')
    own = [out / name for name in ("layouts/mine.toml", "layouts/budget-1/section-02.toml",
                                   "corridor-as-used/site-b.toml")]  # fmt: skip
    for file in own:
        file.write_text("mine")
    (tmp_path / "pass.toml").write_text(one)
    run("corridor", "pass.toml", "--budget", 4_000, *few, folder=tmp_path)
    for folder in ("layouts", "corridor-as-used"):
        found = {file for file in (out / folder).rglob("*") if file.is_file()}
        assert {file for file in found if file not in own} == {
            out / name
            for name in ("layouts/budget-1/section-1.toml", "corridor-as-used/corridor.toml",
                         "corridor-as-used/site-1.toml")
            if name.startswith(folder)
        }  # fmt: skip
    assert all(file.read_text() == "mine" for file in own)
    assert not (out / "layouts/budget-2").exists()


TARGETED = """name = "targets"
budget = [0, 12_000, 2_000_000]
[[sections]]
site = "own.toml"
length = 60.0
name = "km 1.2"
reach = 0.002
[[sections]]
site = "quick"
length = 140.0
reach = 0.002
"""


@pytest.fixture(scope="module")
def targeted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return results for targets that no layout meets, and what was printed."""
    folder = tmp_path_factory.mktemp("targets")
    Site.load("verge").save(folder / "own.toml")
    text = (folder / "own.toml").read_text(encoding="utf-8")
    marked = "# Name of the site; placeholder: replace.\n" + text
    (folder / "own.toml").write_text(marked, encoding="utf-8")
    (folder / "pass.toml").write_text(TARGETED)
    words = run("corridor", "pass.toml", "--releases", 200, "--out", "o", folder=folder)
    return folder / "o", words


def test_targets_and_their_cost_are_told(targeted: tuple[Path, str]) -> None:
    out, words = targeted
    assert "Money is spent on targets first" in words
    assert "even with unlimited money, these sections may miss a target: km 1.2, quick" in words
    budgets = rows(out / "budgets.csv")
    whole = next(row for row in budgets if row["budget"] == "unlimited")
    assert float(whole["gain"]) <= 0.0
    assert all(row["share_of_unlimited"] == "" for row in budgets)
    assert all(row["sections_missing_targets"] == "2" for row in budgets)
    line = next(line for line in words.splitlines() if line.startswith(" unlimited"))
    assert line.split()[-5:-1] == ["-"] * 4


def test_sections_without_a_gain_that_is_shown_are_named(targeted: tuple[Path, str]) -> None:
    out, words = targeted
    lines = [line for line in words.splitlines() if "it is not shown that the barriers" in line]
    told = {line.partition(" EUR")[0].removeprefix("with ").replace(",", ""): line
            for line in lines}  # fmt: skip
    for row in rows(out / "sections.csv"):
        low, gain, high = (float(row[name]) for name in ("gain_low", "gain", "gain_high"))
        assert low <= gain <= high
        if row["budget"] != "unlimited":
            doubtful = row["layout"] != "no barrier" and low <= 0.0
            line = told.get(f"{float(row['budget']):.0f}", "")
            assert (f"{row['section']} (" in line) == doubtful
    assert "2000000" in told


def test_the_shown_budget_builds_something(targeted: tuple[Path, str]) -> None:
    _, words = targeted
    assert "what a budget of 12,000 EUR builds" in words


def test_placeholders_of_sites_are_told(targeted: tuple[Path, str]) -> None:
    _, words = targeted
    assert words.count("placeholders") == 1
    assert "the site file own.toml marks 1 values as placeholders to replace" in words


def test_a_yearly_budget_limits_all_methods(planned: tuple[Path, str], tmp_path: Path) -> None:
    free = rows(planned[0] / "budgets.csv")
    limit = 0.5 * float(free[-1]["annual_cost_of_barriers"])
    (tmp_path / "pass.toml").write_text(f"yearly_budget = {limit}\n{TEXT}")
    words = run("corridor", "pass.toml", *SMALL, "--out", "o", folder=tmp_path)
    budgets = rows(tmp_path / "o/budgets.csv")
    assert all(float(r["annual_cost_of_barriers"]) <= limit * (1.0 + 1e-6) for r in budgets)
    assert all(row["shadow_price"] == "" for row in budgets)
    assert "All methods keep the yearly budget" in words


def test_the_report_shows_what_each_budget_achieves(
    planned: tuple[Path, str], tmp_path: Path
) -> None:
    out, _ = planned
    run("report", out, "--out", "page", folder=tmp_path)
    page = Page((tmp_path / "page/report.html").read_text(encoding="utf-8"))
    assert page.heads[0] == "1. Corridor"
    for file in ("budgets.csv", "sections.csv"):
        assert len(page.tables[f"o/{file}"]) == len(rows(out / file))
    budgets = rows(out / "budgets.csv")
    for shown, row in zip(page.tables["o/budgets.csv"], budgets, strict=True):
        assert shown["method"] == row["method"]
        assert float(shown["spent"].replace(",", "")) == pytest.approx(float(row["spent"]), abs=0.5)
    labels = {attrs.get("aria-label") for tag, attrs in page.tags if tag == "svg"}
    assert {"Gain and budget", "What is built along the corridor"} <= labels


@pytest.mark.slow
def test_a_killed_plan_goes_on_and_ends_the_same(planned: tuple[Path, str], tmp_path: Path) -> None:
    whole, _ = planned
    (tmp_path / "pass.toml").write_text(TEXT)
    count, out = _lines(whole / "evaluations"), tmp_path / "killed"
    for least in (count // 4, count // 2):
        killed = rig("corridor", "pass.toml", *SMALL, "--out", "killed", folder=tmp_path)
        while _lines(out / "evaluations") < least:
            assert killed.poll() is None
            time.sleep(0.02)
        killed.kill()
        killed.communicate()
    run("corridor", "pass.toml", *SMALL, "--out", "killed", folder=tmp_path)
    for name in ("budgets.csv", "sections.csv", "fronts.csv", "priorities.csv"):
        assert (out / name).read_bytes() == (whole / name).read_bytes()


def _lines(folder: Path) -> int:
    """Return the number of stored evaluations."""
    return sum(file.read_bytes().count(b"\n") for file in folder.glob("*.jsonl"))


def test_a_corridor_is_saved_and_read_back(tmp_path: Path) -> None:
    (tmp_path / "pass.toml").write_text(TEXT)
    one = Corridor.load(tmp_path / "pass.toml")
    assert Corridor.load(one.save(tmp_path / "copy")) == one


def test_sections_may_stand_in_a_table_and_share_prices(tmp_path: Path) -> None:
    with (tmp_path / "s.csv").open("w", newline="") as file:
        csv.writer(file).writerows(
            [("name", "site", "length", "reach"), ("a", "verge", 10, ""), ("b", "quick", 20, 0.1)]
        )
    text = 'name = "t"\nbudget = 1000\ntable = "s.csv"\n[consequences]\nclosure = 7000.0\n'
    (tmp_path / "t.toml").write_text(text + "[prices]\ninterest = 0.01\n")
    found = Corridor.load(tmp_path / "t.toml")
    assert [s.length for s in found.sections] == [10.0, 20.0]
    assert [s.reach for s in found.sections] == [None, 0.1]
    assert all(s.site.consequences.closure == 7000.0 for s in found.sections)
    assert all(s.site.prices.interest == 0.01 for s in found.sections)


def test_prices_of_a_corridor_replace_those_of_the_same_key(tmp_path: Path) -> None:
    prices = (
        "[prices]\nupkeep = { fence = 0.02 }\nfence = { 500 = 100.0 }\nditch = { soil = 9.0 }\n"
    )
    (tmp_path / "pass.toml").write_text(TEXT + prices)
    for section in Corridor.load(tmp_path / "pass.toml").sections:
        own, new = Site.load(section.site.name).prices, section.site.prices
        assert new.upkeep == own.upkeep | {"fence": 0.02}
        assert new.fence == own.fence | {"500": 100.0}
        assert new.ditch == own.ditch | {"soil": 9.0}
        assert replace(new, upkeep=own.upkeep, fence=own.fence, ditch=own.ditch) == own


def test_traffic_of_a_site_takes_the_length_of_its_section(tmp_path: Path) -> None:
    traffic = "[traffic]\nvehicles_per_day = 900\nspeed = 50.0\n"
    site = Site.load("verge")
    other = rigdda.Traffic(vehicles_per_day=900.0, speed=50.0, section_length=1000.0)
    replace(site, traffic=other).save(tmp_path / "own.toml")
    text = TEXT.replace('"narrow"', '"own.toml"').replace('"verge"', '"own.toml"')
    (tmp_path / "pass.toml").write_text(text)
    own = Corridor.load(tmp_path / "pass.toml")
    (tmp_path / "pass.toml").write_text(text + traffic)
    assert own == Corridor.load(tmp_path / "pass.toml")
    assert [s.site.traffic.section_length for s in own.sections if s.site.traffic] == [100.0, 50.0]


def test_the_example_has_targets_and_traffic_of_its_sections() -> None:
    corridor = Corridor.load(EXAMPLE)
    wanted = [section.targets for section in corridor.sections]
    assert wanted[1]["reach"] == 0.4 and wanted[3]["individual"] == 1e-5
    assert all(value is None for value in wanted[0].values())
    for section in corridor.sections:
        assert section.site.traffic is not None
        assert section.site.traffic.section_length == section.length
    assert CorridorProblem(corridor).problems[3].targets.individual == 1e-5


def test_a_target_of_the_risk_to_life_needs_traffic(tmp_path: Path) -> None:
    text = TEXT.replace("length = 50.0", "length = 50.0\nindividual = 1e-5")
    (tmp_path / "pass.toml").write_text(text)
    line = refused("corridor", "pass.toml", folder=tmp_path)
    assert "sections.narrow.targets.individual" in line and "traffic" in line
    (tmp_path / "pass.toml").write_text(text + "[traffic]\nspeed = 50.0\n")
    assert "traffic.vehicles_per_day" in refused("corridor", "pass.toml", folder=tmp_path)


def test_traffic_of_a_corridor_takes_the_length_of_each_section(tmp_path: Path) -> None:
    traffic = "[traffic]\nvehicles_per_day = 900\nspeed = 50.0\n"
    (tmp_path / "pass.toml").write_text(TEXT + traffic)
    for section in Corridor.load(tmp_path / "pass.toml").sections:
        assert section.site.traffic is not None
        assert section.site.traffic.section_length == section.length
    (tmp_path / "pass.toml").write_text(TEXT + traffic + "section_length = 9999\n")
    line = refused("corridor", "pass.toml", folder=tmp_path)
    assert "traffic.section_length = 9999: leave it out" in line


def test_options_are_judged_by_the_risk_to_life() -> None:
    corridor = Corridor.load(EXAMPLE)
    problem = CorridorProblem(corridor).problems[3]
    found = problem.evaluate((), range(60))
    option = planning.Option((), 0.0, 0.0, found)
    risk = found.risk.individual.high
    expected = max(0.0, 1.0 - 1e-5 / risk) if risk > 0.0 else 0.0
    assert option.missed(problem) == pytest.approx(expected)
    easy = replace(corridor.sections[3], individual=0.5)
    one = CorridorProblem(Corridor("one", (easy,), (1.0,))).problems[0]
    assert option.missed(one) == 0.0


def test_the_difference_of_two_choices_is_that_of_the_sections_that_differ(site: Site) -> None:
    sections = tuple(CorridorSection(site, 40.0 * (i + 1), f"km {i}") for i in range(3))
    problem = CorridorProblem(Corridor("three", sections, (1e5,)))
    ditch = (Ditch(site.slope.toe, 1.0, 3.0),)
    bare, built = (problem.problems[1].evaluate(layout, range(50)) for layout in ((), ditch))
    first, _, last = (own.nothing for own in problem.problems)
    one, other = (problem.judge([first, chosen, last]) for chosen in (built, bare))
    found = problem.ahead(one, other)
    assert found.value == pytest.approx(80.0 * (bare.objective - built.objective))
    assert found.low < found.value < found.high
    assert problem.ahead(one, one) == (0.0, 0.0, 0.0)


def test_built_in_corridors_are_valid() -> None:
    assert corridors.names() == ["corridor-12", "corridor-50"]
    assert [len(Corridor.load(name).sections) for name in corridors.names()] == [12, 50]


@pytest.mark.parametrize(
    "change, named",
    [
        (("budget = [4_000, 12_000]", "budget = []"), ("budget", "at least one")),
        (("budget = [4_000, 12_000]", "budget = -1"), ("budget", "-1")),
        (("budget = [4_000, 12_000]", 'budget = "much"'), ("budget", "much")),
        (("budget = [4_000, 12_000]", ""), ("budget", "no default")),
        (("length = 50.0", "length = 0"), ("length", "0")),
        (("length = 50.0", "lenght = 5"), ("lenght", "did you mean length")),
        (('site = "narrow"', 'site = "nowhere"'), ("site", "nowhere")),
        (('site = "narrow"', 'site = "gone.toml"'), ("site", "gone.toml")),
        (('name = "km 1.2"', 'name = "narrow"'), ("sections.name", "narrow")),
        (("length = 50.0", "length = 50.0\nreach = 2"), ("reach", "2")),
        (('name = "pass"', 'name = "pass"\ntable = "x.csv"'), ("sections", "table")),
        (('name = "pass"', 'name = "pass"\nyearly_budget = -2'), ("yearly_budget", "-2")),
        (('name = "pass"', 'name = "pass"\nprices = {interest = 9}'), ("prices.interest", "9")),
        (('name = "pass"', 'name = "pass"\nprices = {fenze = 9}'), ("prices.fenze", "fence")),
    ],
)
def test_malformed_corridors_are_one_line(
    change: tuple[str, str], named: tuple[str, ...], tmp_path: Path
) -> None:
    assert change[0] in TEXT
    (tmp_path / "pass.toml").write_text(TEXT.replace(*change))
    line = refused("corridor", "pass.toml", folder=tmp_path)
    assert all(word in line for word in named), line


@pytest.mark.parametrize(
    "text, named",
    [
        ("", "row"),
        ("name,site,length\n", "row"),
        ("name,site,length\na,quick\n", "cells"),
        ("name,site,metres\na,quick,3\n", "metres"),
        ("name,site,length\na,quick,far\n", "far"),
        ("name,site,length\na,quick,-3\n", "-3"),
        ("name,site,length\na,quick,1_20\n", "s.csv row 2.length = '1_20': give a number"),
        ("name,site,length,reach\n\na,quick,5,0_1\n", "s.csv row 3.reach = '0_1': give a number"),
        ("name,site,length\na,quick,\uff13\n", "row 2.length = .*: give a number"),
        ("name,site,length\na,quick,1e999\n", "row 2.length = inf: give a finite number"),
        ("name,site,length,length\na,quick,3,4\n", "table = 'length': .* 2 have this one"),
        ("name,site, name,length\na,quick,b,4\n", "table = 'name': give each column a different"),
        ("name,site,length\na,quick,4,5\n", "s.csv row 2 = 4: give 3 cells"),
        ('name,site,length\n"a,quick,' + 140_000 * "3" + "\n", "repair line 2"),
    ],
)
def test_malformed_tables_are_told(text: str, named: str, tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text(text, encoding="utf-8")
    (tmp_path / "t.toml").write_text('name = "t"\nbudget = 1\ntable = "s.csv"\n')
    with pytest.raises(BadInput, match=named):
        Corridor.load(tmp_path / "t.toml")


def test_unknown_corridors_and_options(tmp_path: Path) -> None:
    assert "corridor-12" in refused("corridor", "corridor-13", folder=tmp_path)
    assert "--budget" in refused("corridor", "corridor-12", "--budget", -1, folder=tmp_path)
    assert "--releases" in refused("corridor", "corridor-12", "--releases", 5, folder=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_missed_target_is_judged_by_all_releases() -> None:
    """With 20 releases, upper bounds are above a target that 200 more show to be met."""
    problem = DesignProblem("verge", targets={"reach": 0.5})
    layout = (Fence(problem.zone.start + 2.0, 4.0, energy_class=500),)
    few, many = (problem.evaluate(layout, seeds=range(*ends)) for ends in ((0, 20), (20, 220)))
    option = planning.Option(layout, 0.0, 0.0)
    option.add(problem, few.outcomes)
    alone = option.missed(problem)
    option.add_report(problem, many)
    events = [event.name for event in problem.site.events if event.design]
    bounds = [
        upper_bound(
            few.reach[name].count + many.reach[name].count,
            few.reach[name].releases + many.reach[name].releases,
        )
        for name in events
    ]
    assert option.missed(problem) == pytest.approx(max(0.0, max(bounds) - 0.5))
    assert option.missed(problem) < alone


def test_the_numbers_of_targets_are_written() -> None:
    problem = DesignProblem("verge")
    layout = (Fence(problem.zone.start + 2.0, 4.0, energy_class=500),)
    found = problem.evaluate(layout, seeds=range(60))
    columns = corridor_report.risk_columns(found, problem.site)
    events = [event.name for event in problem.site.events if event.design]
    assert columns["reach_high"] == max(found.reach[name].bound for name in events)
    assert columns["failure_high"] == max(found.failure[name].bound for name in events)
    assert columns["reach"] in [found.reach[name].probability for name in events]
    assert columns["individual"] is None  # the site has no traffic
    assert corridor_report.risk_columns(problem.nothing, problem.site)["failure_high"] is None
    ditch = dataclasses.replace(found, layout=(Ditch(9.0, 1.0, 3.0),))
    assert corridor_report.risk_columns(ditch, problem.site)["failure_high"] is None
    assert corridor_report.risk_columns(ditch, problem.site)["reach_high"] is not None
    busy = DesignProblem("slab-cut")
    risk = busy.nothing.risk
    assert risk is not None
    columns = corridor_report.risk_columns(busy.nothing, busy.site)
    assert (columns["individual"], columns["individual_high"]) == risk.individual[::2]


def test_an_option_is_judged_on_all_its_releases_together() -> None:
    """Twelve batches of 25 releases without a loss are as good as 300 releases, not as 87."""
    problem = DesignProblem("quick", targets={"reach": 0.5})
    layout = (Fence(problem.zone.start + 2.0, 4.0, energy_class=3000),)
    whole = problem.evaluate(layout, range(96))
    option = planning.Option(layout, 0.0, 0.0)
    for first in range(0, 96, 24):
        option.add(problem, whole.outcomes[first : first + 24])
    assert option.known is not None
    assert option.releases == 96 and option.value().value == pytest.approx(whole.objective)
    assert option.value().interval == pytest.approx(whole.ci)
    assert option.known.reach == whole.reach and option.known.failure == whole.failure


def test_fronts_belong_to_the_checks_and_the_targets(site: Site, tmp_path: Path) -> None:
    files = set()
    for checks, reach in (("reported", None), ("required", None), ("reported", 0.2)):
        corridor = Corridor("one", (CorridorSection(site, 40.0, "km 0", reach=reach),), (1e5,))
        planner = planning.Planner(CorridorProblem(corridor, checks=checks), 200, folder=tmp_path)
        planner._search()
        files |= set(tmp_path.glob("front-*.json"))
        assert all(planner.problem.problems[0].fits(own.layout) for own in planner.fronts[0])
    assert len(files) == 3


def test_errors_of_sections_of_one_site_add_up() -> None:
    """The statistics without barriers of one site are the same for all its sections."""
    site = Site.load("quick")
    sections = tuple(CorridorSection(site, 100.0, f"km {i}") for i in range(9))
    nine = CorridorProblem(Corridor("nine", sections, (1e5,)))
    one = CorridorProblem(Corridor("one", sections[:1], (1e5,)))
    wide, narrow = (p.judge([q.nothing for q in p.problems]) for p in (nine, one))
    assert wide.objective == pytest.approx(9.0 * narrow.objective)
    assert np.ptp(wide.ci) == pytest.approx(9.0 * np.ptp(narrow.ci))
    layout = (Ditch(site.slope.toe, 1.0, 3.0),)
    parts = [nine.problems[0].evaluate(layout, range(100 * i, 100 * i + 60)) for i in range(9)]
    apart = nine.judge(parts)
    sides = [length * np.ptp(e.ci) for length, e in zip(nine.lengths, parts, strict=True)]
    assert np.ptp(apart.ci) < 0.6 * sum(sides)  # other releases are independent
