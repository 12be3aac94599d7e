"""Studies of layouts by file and by script: their rows, and going on after a kill."""

from __future__ import annotations

import csv
import importlib.util
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from processes import png_size, refused, rig, rows, run, run_process

import rigdda
from rigdda import Site
from rigdda.app import studies
from rigdda.app.reports import findings, study_report
from rigdda.app.reports.study_report import StudiedLayout, StudyResults
from rigdda.app.reports.tables import _interval, write_rows
from rigdda.envs.comparison import difference
from rigdda.envs.intervals import upper_bound

EXAMPLES = Path(rigdda.__file__).parents[1] / "examples"
STUDY = """
site = "chute.toml"
releases = 6

[[layouts]]
name = "nothing"

[[layouts]]
name = "one"
barriers = [{ kind = "fence", x = 18.0, height = 2.0, energy_class = 500 }]

[[layouts]]
name = "from a file"
file = "walls.json"
"""


@pytest.fixture
def folder(site: Site, tmp_path: Path) -> Path:
    """A folder with a study and what it names."""
    site.save(tmp_path / "chute.toml")
    rigdda.save_layout((rigdda.Wall(20.0, 2.0), rigdda.Wall(15.0, 1.0)), tmp_path / "walls.json")
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def test_a_study_is_one_row_a_layout_and_release(folder: Path, site: Site) -> None:
    words = run("study", "study.toml", "--seed", 3, "--out", "o", folder=folder)
    table = rows(folder / "o/study.csv")
    names = ["nothing", "one", "from a file"]
    assert [(r["layout"], int(r["seed"])) for r in table] == [
        (name, seed) for name in names for _ in site.events for seed in range(3, 9)
    ]
    layout = (rigdda.Wall(20.0, 2.0), rigdda.Wall(15.0, 1.0))
    _, outcome = rigdda.release(site, layout, 8, site.event_names[-1])
    assert float(table[-1]["debris_fraction"]) == outcome.debris_fraction
    assert float(table[-1]["barrier_1_max_energy"]) == outcome.barriers[1].max_energy
    assert float(table[-1]["capital"]) == site.capital(layout)
    assert float(table[-1]["harm"]) == site.bill(layout, outcome).harm
    assert {row["event"] for row in table} == set(site.event_names)
    assert table[0]["barrier_0_hits"] == "" and table[6 * len(site.events)]["barrier_1_hits"] == ""
    assert all(name in words for name in names)
    assert "note: the layout 'from a file' is simulated as given but may not be built" in words
    assert "'one' is" not in words


def test_names_are_written_whatever_the_locale(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = STUDY.replace('"one"', '"größer"').replace("releases = 6", "releases = 1")
    (folder / "study.toml").write_text(text, encoding="utf-8")
    for name, value in {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C"}.items():
        monkeypatch.setenv(name, value)
    assert "gr??er" in run_process("study", "study.toml", "--out", "o", folder=folder)
    assert "größer,block,0" in (folder / "o/study.csv").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_killed_study_goes_on_and_ends_the_same(folder: Path) -> None:
    whole = run("study", "study.toml", "--out", "o", folder=folder)
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text(text.replace("releases = 6", "releases = 600"))
    killed = rig("study", "study.toml", "--out", "k", folder=folder)
    file = folder / "k/study.csv"
    while not (file.is_file() and file.read_bytes().count(b"\n") > 3):
        assert killed.poll() is None
        time.sleep(0.02)
    killed.kill()
    killed.communicate()
    (folder / "study.toml").write_text(text)
    again = run("study", "study.toml", "--out", "k", folder=folder)
    assert "from an earlier run" in again and "earlier" not in whole
    assert file.read_bytes() == (folder / "o/study.csv").read_bytes()


def test_a_row_cut_off_or_of_another_site_is_simulated_again(folder: Path) -> None:
    asked, file = studies.load(folder / "study.toml"), folder / "study.csv"
    assert studies.run(asked, 0, file, lambda *_: None) == 0
    whole = file.read_bytes()
    file.write_bytes(whole[:-9])
    assert studies.run(asked, 0, file, lambda *_: None) == asked.size - 1
    assert file.read_bytes() == whole
    assert studies.run(asked, 2, file, lambda *_: None) == 3 * 4 * len(asked.site.events)
    with file.open(newline="") as lines:
        assert {row["seed"] for row in csv.DictReader(lines)} == set("234567")
    (folder / "chute.toml").write_text((folder / "chute.toml").read_text().replace("28.0", "29.0"))
    assert studies.run(studies.load(folder / "study.toml"), 2, file, lambda *_: None) == 0


@pytest.mark.parametrize(
    "column, value",
    [
        ("layout", "other"),
        ("seed", "7"),
        ("capital", "inf"),
        ("harm", "nan"),
        ("event", "flood"),
        ("debris_fraction", "nan"),
        ("debris_fraction", "abc"),
        ("debris_fraction", ""),
        ("debris_fraction", 200_000 * "1"),
        ("barrier_0_failed", "perhaps"),
        ("barrier_1_hits", "1"),
    ],
)
def test_a_damaged_row_is_simulated_again(column: str, value: str, folder: Path) -> None:
    asked, file = studies.load(folder / "study.toml"), folder / "study.csv"
    studies.run(asked, 0, file, lambda *_: None)
    whole, table = file.read_bytes(), rows(file)
    first = 6 * len(asked.site.events)  # the first of the layout with one barrier
    table[first][column] = value
    write_rows(file, table)
    assert studies.run(asked, 0, file, lambda *_: None) == asked.size - 1
    assert file.read_bytes() == whole
    studies.results(asked, file)


def test_a_file_that_an_editor_has_saved_keeps_its_rows(folder: Path) -> None:
    text = STUDY.replace('"one"', '"line\\nbreak, \\"größer\\"\\r"')
    (folder / "study.toml").write_text(text, encoding="utf-8")
    asked, file = studies.load(folder / "study.toml"), folder / "study.csv"
    assert studies.run(asked, 0, file, lambda *_: None) == 0
    whole = file.read_bytes()
    studies.results(asked, file)
    assert studies.run(asked, 0, file, lambda *_: None) == asked.size
    file.write_bytes(whole.replace(b"\r\n", b"\n"))
    assert studies.run(asked, 0, file, lambda *_: None) == asked.size
    assert file.read_bytes() == whole


@pytest.mark.parametrize("content", [b"my,own,data", b"my,own,data\n1,2,3\n", 200_000 * b"x"])
def test_a_file_of_somebody_else_is_left_alone(content: bytes, folder: Path) -> None:
    (folder / "study.csv").write_bytes(content)
    line = refused("study", "study.toml", "--out", ".", folder=folder)
    assert "study.csv" in line and "another folder" in line
    assert (folder / "study.csv").read_bytes() == content


@pytest.mark.parametrize(
    "change, named",
    [
        (("releases = 6", "releases = 1000000000000"), ("releases", "at most")),
        (("releases = 6", "releases = 0"), ("releases", "0")),
        (("releases = 6", "relases = 6"), ("relases",)),
        (('name = "one"', 'name = "nothing"'), ("layouts[1].name", "nothing")),
        (("energy_class = 500", "energy_class = 7"), ("layouts.one.barriers[0].energy_class", "7")),
        (("x = 18.0", "x = 500.0"), ("x", "500", "terrain")),
        (("walls.json", "none.json"), ("none.json", "existing")),
        (("chute.toml", "nowhere.toml"), ("nowhere.toml", "existing")),
        (("[[layouts]]", "[[layouts"), ("TOML",)),
    ],
)
def test_a_bad_study_is_one_line(
    change: tuple[str, str], named: tuple[str, ...], folder: Path
) -> None:
    (folder / "study.toml").write_text(STUDY.replace(*change))
    before = set(folder.iterdir())
    line = refused("study", "study.toml", folder=folder)
    assert all(word in line for word in named), line
    assert set(folder.iterdir()) == before


def test_a_mesh_that_occurs_twice_is_refused_before_any_release(folder: Path) -> None:
    mesh = '{ kind = "mesh", x = 4.0, option = "face" }'
    text = f'site = "quick"\n[[layouts]]\nname = "two"\nbarriers = [{mesh}, {mesh}]\n'
    (folder / "study.toml").write_text(text)
    before = set(folder.iterdir())
    line = refused("study", "study.toml", folder=folder)
    assert "layouts.two.barriers[1].option = 'face': use each mesh option at most once" in line
    twice = f"barriers = [{mesh}, {mesh}]\n"
    (folder / "layout.toml").write_text(twice)
    line = refused("simulate", "quick", "--layout", "layout.toml", folder=folder)
    assert "barriers[1].option = 'face'" in line
    assert set(folder.iterdir()) == before | {folder / "layout.toml"}


def test_a_study_that_is_not_text_is_one_line(folder: Path) -> None:
    (folder / "study.toml").write_bytes(b'site = "\xff"')
    assert "UTF-8" in refused("study", "study.toml", folder=folder)


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_study_s_table_is_what_the_problem_says(folder: Path, site: Site) -> None:
    """Z of a study is that of `DesignProblem.judge` of the same outcomes, intervals nearly."""
    asked, file = studies.load(folder / "study.toml"), folder / "study.csv"
    studies.run(asked, 0, file, lambda *_: None)
    table = rows(file)
    layout = asked.layouts["one"]
    own = [row for row in table if row["layout"] == "one"]
    bills = {name: [r for r in own if r["event"] == name] for name in site.event_names}
    z = site.annual(layout) + sum(
        site.rate(name, layout) * sum(float(r["harm"]) + float(r["repair"]) for r in found) / 6
        for name, found in bills.items()
    )
    cells = study_report.costs(studies.results(asked, file)).columns[1]._cells
    assert float(str(cells[1]).split()[0].replace(",", "")) == pytest.approx(z, rel=0.01)


@pytest.mark.slow
def test_the_example_in_python_says_that_stronger_fences_fail_less() -> None:
    found = example("study").study(releases=40)
    failed = [e.failure["block"].probability for e in found.values()]
    assert failed == sorted(failed, reverse=True) and failed[0] > failed[-1]
    assert [e.cost for e in found.values()] == sorted(e.cost for e in found.values())


def test_the_example_by_file_is_sound() -> None:
    asked = studies.load(EXAMPLES / "study.toml")
    assert len(asked.layouts) == 4 and asked.size == 4 * 3 * 40


def test_a_study_tells_differences_on_common_releases(folder: Path, site: Site) -> None:
    words = run("study", "study.toml", "--out", "o", folder=folder)
    asked = studies.load(folder / "study.toml")
    found = studies.results(asked, folder / "o/study.csv")
    pairs = {(row["one"], row["two"]): row for row in rows(folder / "o/differences.csv")}
    assert list(pairs) == [("nothing", "one"), ("nothing", "from a file"), ("one", "from a file")]
    by_name = {one.name: one for one in found.layouts}
    for (one, two), row in pairs.items():
        a, b = by_name[one], by_name[two]
        apart = found.objective(a)[0] - found.objective(b)[0]
        assert float(row["difference"]) == pytest.approx(apart)
        assert float(row["low"]) <= apart <= float(row["high"])
        jobs = [
            (site, layout, int(r["seed"]), r["event"])
            for layout, name in ((a.layout, one), (b.layout, two))
            for r in rows(folder / "o/study.csv")
            if r["layout"] == name
        ]
        outcomes = rigdda.release_many(jobs)
        half = len(outcomes) // 2
        parts = outcomes[:half], outcomes[half:]
        again = difference(site, (a.layout, b.layout), parts, found.facts)
        assert float(row["difference"]) == pytest.approx(again.value, rel=1e-12)
        assert float(row["low"]) == pytest.approx(again.ci[0], rel=1e-9)
    best = min(rows(folder / "o/layouts.csv"), key=lambda row: float(row["objective"]))
    assert f"{best['layout']!r} has the lowest Z" in words
    for row in rows(folder / "o/layouts.csv"):
        total = sum(float(row[part]) for part in ("capital", "harm", "repair"))
        assert float(row["objective"]) == pytest.approx(total)
    for name in ("sections.png", "costs.png"):
        assert png_size(folder / "o" / name)[0] > 900


def test_events_of_a_study_are_those_of_its_releases(folder: Path) -> None:
    run("study", "study.toml", "--out", "o", folder=folder)
    every = rows(folder / "o/study.csv")
    for row in rows(folder / "o/events.csv"):
        own = [r for r in every if (r["layout"], r["event"]) == (row["layout"], row["event"])]
        assert int(row["releases"]) == len(own) == 6
        reached = sum(r["reached"] == "True" for r in own)
        assert float(row["reach"]) == pytest.approx(reached / 6)
        assert float(row["reach_bound"]) == pytest.approx(upper_bound(reached, 6))
        energies = [1e-3 * float(r["max_energy_on_road"]) for r in own]
        dear = [e for e in energies if e > 0.0]
        if dear:
            assert float(row["energy_on_road_95"]) == pytest.approx(np.quantile(dear, 0.95))
        else:
            assert row["energy_on_road_95"] == ""


def test_no_failure_is_estimated_where_nothing_can_fail(folder: Path) -> None:
    """Of the layouts, only the fence can fail: the walls of the file are rigid."""
    run("study", "study.toml", "--out", "o", folder=folder)
    table = rows(folder / "o/events.csv")
    assert {row["layout"] for row in table if row["failure"]} == {"one"}
    assert {row["layout"] for row in table if row["failure_bound"]} == {"one"}
    asked = studies.load(folder / "study.toml")
    shown = study_report.events(studies.results(asked, folder / "o/study.csv"))
    fails = zip(shown.columns[1].cells, shown.columns[3].cells, strict=True)
    assert {name for name, cell in fails if cell != "-"} == {"one"}


def test_every_violation_of_every_layout_is_named_at_once(folder: Path) -> None:
    text = STUDY.replace("x = 18.0, height = 2.0, energy_class = 500", "x = 500.0, height = -2.0")
    text += """
[[layouts]]
name = "two"
barriers = [
    { kind = "ditch", x = 20.0, depth = 1.0, width = 2.0, colour = 3 },
    { kind = "fence", x = 15.0, height = 2.0, energy_class = 7 },
]

[[layouts]]
name = "far"
barriers = [{ kind = "wall", x = 400.0, height = 2.0 }, { kind = "wall", x = 500.0, height = 2.0 }]
"""
    (folder / "study.toml").write_text(text)
    line = refused("study", "study.toml", folder=folder)
    for words in ("layouts.one.barriers[0].height = -2.0", "layouts.two.barriers[0].colour = 3",
                  "layouts.two.barriers[1].energy_class = 7", "= 400.0", "= 500.0"):  # fmt: skip
        assert words in line, (words, line)


def test_a_layout_that_may_not_be_built_is_told_all_reasons(site: Site) -> None:
    layout = (
        rigdda.Fence(17.0, 2.0, energy_class=500),
        rigdda.Fence(17.1, 5.8, energy_class=8500),
        rigdda.GravityWall(16.0, 9.0, 1.0),
        rigdda.Ditch(6.0, 1.0, 2.0),
    )
    words = findings.unbuildable(site, layout)
    for part in ("layout[1].height = 5.8", "layout[1].x = 17.1", "layout[2].height = 9.0"):
        assert part in words
    assert words.count("layout[3]") >= 2


def test_none_of_a_few_releases_is_not_never() -> None:
    """The interval of a layout that stopped all 16 blocks holds what one of them would cost."""
    site = Site.load("verge")
    rows = [
        {"event": name, "reached": "False", "harm": "0.0", "repair": "0.0", "road_volume": "0.0",
         "released_volume": "1.0", "width": "1.0", "barrier_0_failed": "False"}
        for name in site.event_names for _ in range(16)
    ]  # fmt: skip
    own = studies._account(site, rows)
    assert not own.failed.any() and not own.reached.any()
    none, ones = np.zeros(len(rows)), np.ones(len(rows))
    one = StudiedLayout("no barrier", (), own, none, none, released=ones, widths=ones)
    sums = StudyResults.of(site, [one]).sums(one)
    least = site.rate(site.event_names[0], ()) * site.consequences.harm(1.0, True) / 16
    assert sums.both.low == 0.0 and sums.both.high > least


def test_a_share_that_is_never_seen_has_an_interval() -> None:
    low, high = _interval(np.zeros(16), 0.0, True)
    assert low == 0.0 and 50.0 * upper_bound(0, 16) < high < 120.0 * upper_bound(0, 16)
    assert _interval(np.zeros(16), 0.0, False) == [0.0, 0.0]
