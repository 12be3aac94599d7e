"""What-ifs from the outcomes of a design, against evaluations from scratch."""

from __future__ import annotations

import gzip
import html
import json
import math
import re
import time
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from processes import refused, rows, run

import rigdda
from rigdda import MECHANICS, BadInput, Outcome, Site
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.agents.run_record import read
from rigdda.app import archive, design, reprice
from rigdda.app.barrier_checks import check_layout
from rigdda.app.reports import design_report, findings, reprice_report
from rigdda.barriers import to_tables
from rigdda.envs import DesignProblem, Evaluation, ensemble
from rigdda.envs.cost import judge
from rigdda.seeds import NO_BARRIERS, release_seeds

VERIFIED = 40


@pytest.fixture(scope="module")
def designed(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a design with a target that nothing meets."""
    folder = tmp_path_factory.mktemp("designed")
    problem = DesignProblem(site, targets={"reach": 0.0005}, max_cost=1200.0)
    done, _ = design.design(problem, "race", 700, 0, VERIFIED, folder, lambda *_: None)
    assert done.frontier
    return folder


CHANGES = (
    {},
    {"consequences.closure": 20000},
    {"consequences.days_exponent": 0.9, "consequences.clearing": 100.0},
    {"prices.fence.500": 900, "prices.removal": 0, "prices.access": 0.0},
    {"prices.interest": 0.0, "prices.life": 30, "prices.lives.ditch": 15},
    {"events.block.rate": 9, "events.group.return_period": 3},
    {"prices.upkeep.fence": 0.2, "consequences.closure": 0},
)


def changed_by_hand(site: Site, settings: dict[str, object]) -> Site:
    """Return the site that a user would write for some settings."""
    data = msgspec.to_builtins(site)
    for path, value in settings.items():
        top, *keys = path.split(".")
        table = data[top]
        if top == "events":
            name = keys.pop(0)
            table = next(event for event in table if event["name"] == name)
            if keys == ["return_period"]:
                keys, value = ["rate"], 1.0 / float(value)
        for key in keys[:-1]:
            table = table[key]
        table[keys[-1]] = value
    for table in (*data["sources"], *data["events"], data["motion"], data["origin"]):
        for name in [name for name, value in table.items() if value is None]:
            del table[name]
    return msgspec.convert(data, Site)


simulated: dict[tuple[object, ...], list[Outcome]] = {}


def anew(site: Site, layout: rigdda.Layout, drawn: list[tuple[int, str]]) -> list[Outcome]:
    """Return the outcomes of releases, simulated once for all sites with the same events."""
    key = site.events, layout, tuple(drawn)
    if key not in simulated:
        simulated[key] = rigdda.release_many([(site, layout, *one) for one in drawn])
    return simulated[key]


def from_scratch(site: Site, problem: DesignProblem, kept: archive.Archive) -> list[Evaluation]:
    """Return the evaluations of the verified layouts, with every release simulated anew."""
    counts = DesignProblem(kept.site).nothing.reach
    seeds = {n: range(NO_BARRIERS, NO_BARRIERS + counts[n].releases) for n in counts}
    bare = anew(site, (), [(seed, name) for name in site.event_names for seed in seeds[name]])
    facts = ensemble._facts(site, bare)
    events = DesignProblem(kept.site).plan(release_seeds("verification", kept.seed, VERIFIED))
    drawn = list(zip(release_seeds("verification", kept.seed, VERIFIED), events, strict=True))
    found = []
    for tables in kept.layouts:
        layout = archive.layout_of(tables)
        outcomes = anew(site, layout, drawn)
        one = judge(site, layout, outcomes, facts, kept.shares)
        found.append(replace(one, targets=problem.state(one), outcomes=()))
    return found


@pytest.mark.parametrize("settings", CHANGES, ids=lambda s: ",".join(s) or "none")
def test_a_what_if_equals_an_evaluation_from_scratch(
    settings: dict[str, object], designed: Path
) -> None:
    kept = archive.read(designed)
    done = reprice.reprice(designed, settings)
    by_hand = changed_by_hand(kept.site, settings)
    assert done.problem.site == by_hand
    wanted = from_scratch(by_hand, done.problem, kept)
    assert [case.evaluation for case in done.cases[:-1]] == wanted


@pytest.fixture(scope="module")
def with_traffic(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a design with a target of the individual risk."""
    folder = tmp_path_factory.mktemp("traffic")
    busy = msgspec.structs.replace(site, traffic=rigdda.Traffic(8000.0, 80.0, 250.0))
    problem = DesignProblem(busy, targets={"individual": 1e-5})
    design.design(problem, "race", 700, 0, VERIFIED, folder, lambda *_: None)
    return folder


def test_a_what_if_of_traffic_equals_an_evaluation_from_scratch(with_traffic: Path) -> None:
    kept = archive.read(with_traffic)
    settings = {"traffic.fatality_value": 2e6, "traffic.vehicles_per_day": 3000.0}
    done = reprice.reprice(with_traffic, settings, {"individual": 1e-4})
    assert done.problem.targets.individual == 1e-4
    wanted = from_scratch(changed_by_hand(kept.site, settings), done.problem, kept)
    assert [case.evaluation for case in done.cases[:-1]] == wanted
    assert done.chosen.evaluation.risk is not None


def test_a_what_if_prints_and_writes_the_risk_to_life(with_traffic: Path, tmp_path: Path) -> None:
    words = run("reprice", with_traffic, "--target-risk", 1e-4, "--out", "o", folder=tmp_path)
    done = reprice.reprice(with_traffic, targets={"individual": 1e-4})
    assert "risk to the traffic on 250 m of road" in words
    for row, case in zip(rows(tmp_path / "o/risk.csv"), done.cases, strict=True):
        risk = case.evaluation.risk
        assert risk is not None and row["layout"] == case.name
        assert float(row["individual"]) == risk.individual.value
        assert float(row["fatalities_high"]) == risk.fatalities.high


def test_without_changes_it_is_the_table_of_the_design(designed: Path) -> None:
    done, table = reprice.reprice(designed), rows(designed / "evaluations.csv")
    verified = [row for row in table if row["stage"] == "verification"]
    by_layout = {row["barriers"]: row for row in verified}
    for case in done.cases[:-1]:
        e = case.evaluation
        row = by_layout[json.dumps(to_tables(e.layout))]
        assert (float(row["objective"]), float(row["cost"])) == (e.objective, e.cost)
        assert (float(row["objective_low"]), float(row["objective_high"])) == e.ci
        assert float(row["debris_share"]) == e.debris_share
    assert reprice_report.rows(done)[0]["debris_share"] == 1.0  # as in the printed table
    # None meets the target, so one of the verified layouts is chosen, with those of the frontier.
    verified = {r["barriers"] for r in table if r["stage"] in ("verification", "frontier")}
    assert json.dumps(to_tables(done.chosen.evaluation.layout)) in verified


def test_every_layout_of_the_search_takes_part(designed: Path) -> None:
    kept, done = archive.read(designed), reprice.reprice(designed, {"consequences.closure": 1e6})
    assert done.tried == len(kept.releases) > 10
    names = {str(one.barriers) for one in kept.releases}
    searched = {row["barriers"] for row in rows(designed / "evaluations.csv")}
    assert len(names) == len(searched)
    for one in kept.releases:
        pairs = [(seed, o.event) for seed, o in zip(one.seeds, one.outcomes, strict=True)]
        assert len(set(pairs)) == len(pairs) > 0


def test_rates_are_weights_of_the_means_of_events(designed: Path) -> None:
    once = reprice.reprice(designed, {"events.block.rate": 1.0})
    thrice = reprice.reprice(designed, {"events.block.rate": 3.0})
    for a, b in zip(once.cases[:-1], thrice.cases[:-1], strict=True):
        one, three = a.evaluation.by_event, b.evaluation.by_event
        assert three["block"] == pytest.approx(3.0 * one["block"], rel=1e-12)
        assert three["group"] == one["group"]
        assert a.evaluation.reach == b.evaluation.reach


def test_what_protects_is_worth_more_where_closure_costs_more(designed: Path) -> None:
    cheap, dear = (
        reprice.reprice(designed, {"consequences.closure": c}, targets={"reach": None})
        for c in (100.0, 1e7)
    )
    assert cheap.chosen.evaluation.layout == ()
    assert dear.chosen.evaluation.layout
    assert dear.chosen.evaluation.objective < dear.nothing.evaluation.objective


def test_a_cap_and_targets_choose_among_what_was_tried(designed: Path) -> None:
    for cap in (0.0, 300.0, 1200.0):
        done = reprice.reprice(designed, max_cost=cap, targets={"reach": 0.9})
        assert done.chosen.evaluation.cost <= cap
        assert all(one.cost <= cap for one in done.frontier)
    met = reprice.reprice(designed, targets={"reach": 0.6})
    assert met.chosen.evaluation.targets == "met" and met.frontier == ()


def test_the_frontier_of_a_what_if_is_not_dominated(designed: Path) -> None:
    kept, done = archive.read(designed), reprice.reprice(designed, {"prices.fence.500": 2000})
    everything = reprice._candidates(done.problem, kept)
    for one in done.frontier:
        for other in everything.values():
            if done.problem.place.too_expensive(other.layout) is not None:
                continue
            worse = other.tried.cost >= one.cost or other.tried.level > one.level
            assert worse or (other.tried.cost, other.tried.level) == (one.cost, one.level)


def test_a_what_if_takes_less_than_five_seconds(designed: Path) -> None:
    start = time.process_time()
    reprice.reprice(designed, {"consequences.closure": 20000})
    assert time.process_time() - start < 5.0


@pytest.fixture(scope="module")
def checked(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a design in which every barrier must meet its checks."""
    folder = tmp_path_factory.mktemp("checked")
    problem = DesignProblem(site, checks="required")
    design.design(problem, "race", 500, 0, VERIFIED, folder, lambda *_: None)
    return folder


def test_a_design_with_required_checks_is_priced_with_them(checked: Path) -> None:
    kept, chosen = archive.read(checked), set()
    for closure in (1e3, 5e4, 1e7):
        done = reprice.reprice(checked, {"consequences.closure": closure})
        layout = done.chosen.evaluation.layout
        assert check_layout(done.problem, layout).satisfied
        assert not done.failed[reprice.BEST_OF_SEARCH]
        failing = [
            c for c in done.cases if not check_layout(done.problem, c.evaluation.layout).satisfied
        ]
        assert {c.name for c in failing} == {c.name for c in done.cases} - {
            c.name for c in done.comparable
        }
        assert done.tried < len(kept.releases)  # the search without checks tried others
        chosen.add(layout)
    assert len(chosen) > 1


def test_a_best_layout_that_fails_a_check_is_not_to_be_built(
    designed: Path, tmp_path: Path
) -> None:
    costly = ("--set", "consequences.closure=1000000", "--target", 0.9)
    words = run("reprice", designed, *costly, "--out", "o", folder=tmp_path)
    row = rows(tmp_path / "o/costs.csv")[-1]
    assert row["meets_checks"] == "False"
    assert "Do not build this as it is: " in words and "'best of search' fails its checks" in words


def test_a_return_period_is_compared_on_the_same_length(designed: Path) -> None:
    kept = archive.read(designed)
    rate = next(event.rate for event in kept.site.events if event.name == "block")
    path = "events.block.return_period"
    site, (change,) = reprice.with_settings(kept.site, {path: 100.0 / (rate * 100.0)})
    assert site == kept.site and change.before == pytest.approx(change.after)
    both = {path: 4.0, "events.block.section_length": 180.0}
    for settings in (both, dict(reversed(both.items()))):
        site, (change,) = reprice.with_settings(kept.site, settings)
        (event,) = (event for event in site.events if event.name == "block")
        assert event.rate == pytest.approx(100.0 / (4.0 * 180.0))
        assert change.before == pytest.approx(100.0 / (rate * 180.0))
        words = reprice_report.changed(change)
        assert words.startswith(f"{path} = 4 years on 180 m of slope (was ")
    with pytest.raises(BadInput, match="return_period"):
        reprice.with_settings(kept.site, {"events.block.rate": 1.0, path: 4.0})
    for key, value in (("rate_of", "arrival"), ("name", "other")):
        with pytest.raises(BadInput, match=f"events.block.{key}"):
            reprice.with_settings(kept.site, {f"events.block.{key}": value})


def test_the_command_answers_in_a_folder_of_its_own(designed: Path, tmp_path: Path) -> None:
    before = {path.name: path.read_bytes() for path in designed.iterdir() if path.is_file()}
    options = ("--set", "consequences.closure=20000", "--set", "prices.lives.fence=25")
    words = run("reprice", designed, *options, "--out", "o", folder=tmp_path)
    done = reprice.reprice(designed, {"consequences.closure": 20000, "prices.lives.fence": 25})
    table = rows(tmp_path / "o/costs.csv")
    for row, case in zip(table, done.cases, strict=True):
        assert row["layout"] == case.name
        assert float(row["objective"]) == case.evaluation.objective
        assert float(row["reach_bound"]) == case.evaluation.reach["block"].bound
    assert Site.load(tmp_path / "o/site.toml") == done.problem.site
    assert rigdda.load_layout(tmp_path / "o/layout.toml") == done.chosen.evaluation.layout
    assert rows(tmp_path / "o/frontier.csv") == [
        {k: "" if reprice_empty(v) else str(v) for k, v in row.items()}
        for row in design_report.frontier_rows(done.problem.site, done.frontier)
    ]
    assert "consequences.closure = 20000 (was 50,000)" in words
    assert "no layout was simulated" in words and "best of search" in words
    assert {p.name: p.read_bytes() for p in designed.iterdir() if p.is_file()} == before


@pytest.mark.parametrize(
    "options, words",
    [
        (("--target", 1.0, "--set", "consequences.closure=1000000"), "Do not build this as it is"),
        (("--target", 1.0, "--set", "consequences.closure=100"), "Build nothing"),
        (("--set", "consequences.closure=20000"), "No layout that was found for at most 1,200 EUR"),
        (("--target", 0.6), "Build"),
    ],
)
def test_a_report_starts_with_the_answer(
    options: tuple[object, ...], words: str, designed: Path, tmp_path: Path
) -> None:
    printed = run("reprice", designed, *options, "--out", "o", folder=tmp_path)
    (line,) = (line for line in printed.splitlines() if findings.is_headline(line))
    assert line.startswith(words)
    assert read(tmp_path / "o")["reprice"].findings.count(line) == 1
    run("report", "o", "--out", "page", folder=tmp_path)
    page = (tmp_path / "page/report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    summary = re.sub(r"<[^>]+>", "\n", page).partition("Summary")[2].partition("\nSite\n")[0]
    shown = [html.unescape(text) for text in summary.splitlines() if text.strip()]
    assert shown[0].strip() == line
    assert shown.count(line) == 1
    assert "What limits this answer" in shown


def test_two_answers_of_a_report_are_headed_by_their_folders(
    designed: Path, tmp_path: Path
) -> None:
    for name, target in (("low", 0.6), ("high", 0.9)):
        run("reprice", designed, "--target", target, "--out", name, folder=tmp_path)
    run("report", "low", "high", "--out", "page", folder=tmp_path)
    page = (tmp_path / "page/report.html").read_text(encoding="utf-8")
    assert page.index("other values in low") < page.index("other values in high")


def test_what_would_decide_a_target_is_a_new_design(designed: Path) -> None:
    """The command itself releases nothing."""
    done = reprice.reprice(designed, targets={"reach": None, "failure": 0.06})
    open_ = replace(done.chosen.evaluation, targets="undecided")
    cases = (*done.cases[:-1], replace(done.chosen, evaluation=open_))
    lines = reprice_report.sentences(replace(done, cases=cases))
    (line,) = (line for line in lines if line.startswith("target "))
    assert line.endswith("undecided; a new design with a larger --verify would decide it")


def test_no_failure_is_estimated_where_nothing_can_fail(designed: Path) -> None:
    done = reprice.reprice(designed, targets={"reach": None, "failure": 0.001})
    seen = set()
    for case, row in zip(done.cases, reprice_report.rows(done), strict=True):
        kinds = {barrier.kind for barrier in case.evaluation.layout}
        fallible = bool(kinds & {"fence", "gravity_wall", "embankment"})
        seen.add(fallible)
        assert math.isnan(row["failure"]) == math.isnan(row["failure_bound"]) == (not fallible)
        assert (row["targets"] == "met") == (not fallible)  # 40 releases do not show 0.1 %
    assert seen == {True, False}
    candidates = reprice._candidates(done.problem, archive.read(designed)).values()
    for one in candidates:
        kinds = {barrier.kind for barrier in one.layout}
        if not kinds & {"fence", "gravity_wall", "embankment"}:
            assert (one.over, one.share, one.least) == (0.0, 0.0, 0.0)
    assert done.chosen.evaluation.targets == "met"


def reprice_empty(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)


@pytest.mark.parametrize(
    "setting, named",
    [
        ("closure=3", ("closure = 3", "no such key")),
        ("consequences.closur=3", ("consequences.closur = 3", "did you mean closure")),
        ("consequences.closure=-3", ("consequences.closure = -3", "at least 0")),
        ("consequences.closure=many", ("--set", "many", "a number")),
        ("consequences.closure", ("--set", "PATH=VALUE")),
        ("consequences=3", ("consequences = 3", "add a key")),
        ("prices.fence.777=3", ("prices.fence", "777", "500")),
        ("prices.fence=3", ("prices.fence = 3", "table")),
        ("prices.life=0", ("prices.life = 0", "at least 1")),
        ("prices.lives.tree=10", ("prices.lives", "tree", "fence")),
        ("prices.life.fence=10", ("prices.life.fence = 10", "shorten")),
        ("events.block.area=[1.0, 2.0]", ("events.block.area", "rigdda design")),
        ("events.block.rate=-1", ("events.block.rate = -1", "at least 0")),
        ("events.block.section_length=180", ("section_length = 180", "events.block.return_period")),
        ("events.block.return_period=0", ("events.block.return_period = 0",)),
        ("events.block.ratee=1", ("events.block.ratee = 1", "did you mean rate")),
        ("events.stone.rate=1", ("events.stone.rate = 1", "block, group")),
        ("events.block=1", ("events.block = 1", "events.block.KEY")),
        ("meshes.light.price=1", ("meshes.light.price = 1", "no meshes")),
        ("surfaces.rock.friction_deg=30", ("surfaces.rock.friction_deg = 30", "rigdda design")),
        ("traffic.speed=50", ("traffic.speed = 50", "[traffic]", "rigdda design")),
        ("motion.dt=0.01", ("motion.dt = 0.01", "rigdda design")),
        ("barrier_zone.end=20", ("barrier_zone.end = 20", "rigdda design")),
        ("name=\"other\"", ("name = 'other'", "no result depends on it")),
    ],
)  # fmt: skip
def test_a_bad_setting_is_one_line(
    setting: str, named: tuple[str, ...], designed: Path, tmp_path: Path
) -> None:
    line = refused("reprice", designed, "--set", setting, folder=tmp_path)
    assert all(words in line for words in named), line
    assert list(tmp_path.iterdir()) == []


def test_a_key_that_is_set_twice_is_refused(designed: Path, tmp_path: Path) -> None:
    twice = ("--set", "prices.life=30", "--set", "prices.life=40")
    assert "once" in refused("reprice", designed, *twice, folder=tmp_path)


def test_a_folder_without_a_design_is_refused(tmp_path: Path, designed: Path) -> None:
    assert archive.ARCHIVE_FILE in refused("reprice", tmp_path / "none", folder=tmp_path)
    whole = (designed / archive.ARCHIVE_FILE).read_bytes()
    for i, content in enumerate((b"", whole[:1000], gzip.compress(b"\x80"), b"x" * 99)):
        folder = tmp_path / str(i)
        folder.mkdir()
        (folder / archive.ARCHIVE_FILE).write_bytes(content)
        line = refused("reprice", folder, folder=tmp_path)
        assert "damaged or of another version" in line


def test_releases_of_other_mechanics_are_refused(designed: Path, tmp_path: Path) -> None:
    kept = msgspec.structs.replace(archive.read(designed), mechanics="0")
    archive.write(tmp_path / archive.ARCHIVE_FILE, kept)
    with pytest.raises(BadInput, match=f"mechanics '0', those of this version are '{MECHANICS}'"):
        archive.read(tmp_path)


def test_the_folder_of_the_design_is_not_overwritten(designed: Path, tmp_path: Path) -> None:
    line = refused("reprice", designed, "--out", designed, folder=tmp_path)
    assert "another folder" in line


def test_an_archive_is_the_same_after_writing(designed: Path, tmp_path: Path) -> None:
    kept = archive.read(designed)
    archive.write(tmp_path / archive.ARCHIVE_FILE, kept)
    assert (tmp_path / archive.ARCHIVE_FILE).read_bytes() == (
        designed / archive.ARCHIVE_FILE
    ).read_bytes()
    with pytest.raises(BadInput, match="completed"):
        archive.read(tmp_path / "other")


def test_a_design_event_without_releases_is_not_known(designed: Path) -> None:
    kept, done = archive.read(designed), reprice.reprice(designed)
    some = next(iter(reprice._candidates(done.problem, kept).values()))
    groups = tuple(o for o in some.outcomes if o.event == "group")
    found = reprice.judged(done.problem, replace(some, outcomes=groups), kept)
    assert found.reach["block"].releases == 0 and found.reach["block"].bound == 1.0
    assert TriedLayout.of(done.problem.site, found).level == 1.0
