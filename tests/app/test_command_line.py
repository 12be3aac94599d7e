"""The command line as users meet it: real files, and real processes for what only they show."""

from __future__ import annotations

import json
import os
import pty
import re
from pathlib import Path
from typing import NamedTuple

import pyarrow.parquet as pq
import pytest
from processes import png_size, refused, rig, rows, run, run_process, run_told
from rerun.chunk import RrdReader

import rigdda
from rigdda import Site, sites
from rigdda.agents.limits import RELEASE_SEED
from rigdda.app import cli
from rigdda.app.terminal import WholeNumber
from rigdda.barriers import to_tables

CHUTE = "chute.toml"
TINY = ("--budget", "400", "--verify", "40", "--ground-samples", "0")
COMMANDS = (
    "sites", "new", "check", "simulate", "design", "reprice", "report", "study", "corridor", "fit",
    "sensitivity", "train", "evaluate", "exam", "dataset", "fidelity", "validate", "replay",
    "repeat", "open",
)  # fmt: skip
FILES = (
    "evaluations.csv", "evaluations.jsonl", "outcomes.msgpack.gz", "layouts.csv", "chances.csv",
    "layout.toml", "section.png", "section.svg", "cost.png", "cost.svg", "episode.rrd",
    "problem.json", "run.json", "band.csv", "band.png", "band.svg",
    "checks.csv", "design_sheet.csv", "demand.csv", "demand.png", "demand.svg",
)  # fmt: skip
NUMBERS = ("objective", "objective_low", "objective_high", "capital", "harm", "repair", "cost")


@pytest.fixture(scope="module")
def toml(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("site") / CHUTE
    site.save(file)
    return file


class Designed(NamedTuple):
    """The folder of a design, its output, and the answers that were told before it ended."""

    folder: Path
    words: str
    told: list[str]


@pytest.fixture(scope="module")
def small_design(toml: Path, tmp_path_factory: pytest.TempPathFactory) -> Designed:
    """A small design of a cheap site."""
    folder = tmp_path_factory.mktemp("designed")
    options = (*TINY, "--ground-samples", 1, "--seed", 3, "--out", folder)
    return Designed(folder, *run_told("design", toml, *options, folder=folder))


@pytest.fixture
def designed(small_design: Designed) -> tuple[Path, str]:
    """The folder and the words of a small design of a cheap site."""
    return small_design.folder, small_design.words


def without_time(file: Path) -> list[dict[str, str]]:
    """Return the rows of evaluations without the processor time that they took."""
    return [{k: v for k, v in row.items() if k != "seconds"} for row in rows(file)]


def test_every_file_of_a_design_is_there_and_sound(designed: tuple[Path, str]) -> None:
    folder, _ = designed
    assert {path.name for path in folder.iterdir()} == set(FILES)
    layout = rigdda.load_layout(folder / "layout.toml")
    table = rows(folder / "evaluations.csv")
    verified = [row for row in table if row["stage"] == "verification"]
    assert verified == table[-len(verified) :] and len(verified) in {4, 5}  # 5: without checks
    assert json.loads(table[-1]["barriers"]) == to_tables(layout)
    assert json.loads(verified[0]["barriers"]) == []
    assert int(table[-1]["simulations"]) <= 600  # of both searches
    for row in table:
        z, low, high, capital, harm, repair, _ = (float(row[name]) for name in NUMBERS)
        assert z == pytest.approx(capital + harm + repair)
        assert low <= z <= high
    for name in ("section.png", "cost.png", "demand.png"):
        width, height = png_size(folder / name)
        assert 900 <= width <= 2000 and 600 <= height <= 2500
    sheet = rows(folder / "design_sheet.csv")
    assert {row["symbol"] for row in sheet} >= {"v", "g_tr", "g_dp", "m_d", "E_d", "h_d", "D_d"}
    entities = {chunk.entity_path for chunk in RrdReader(folder / "episode.rrd").stream()}
    assert {"/world/road", "/world/terrain", "/notes"} <= entities
    assert json.loads((folder / "problem.json").read_text())["site"] == "quick"


def test_a_design_says_what_an_engineer_asks(designed: tuple[Path, str]) -> None:
    folder, words = designed
    names = ("nothing", "rule", "constant", "optimised (race)", "rock shed", "Z (95 %)")
    for name in (*names, "reaches road", "barrier fails", "s of processor time"):
        assert name in words
    assert "remain" in words or "saves more" in words
    assert "rule (UNI 11211-4): fence" in words
    layout = rigdda.load_layout(folder / "layout.toml")
    for barrier in layout:
        assert f"at x = {barrier.x:.1f} m" in words or f"mesh {barrier.option!r}" in words
    assert max(len(line) for line in words.splitlines() if " ─" in line) <= 80
    costs = [row for row in rows(folder / "evaluations.csv") if row["stage"] == "verification"]
    told = next(line for line in words.splitlines() if line.startswith(" nothing")).split()
    assert float(told[1].replace(",", "")) == pytest.approx(float(costs[0]["objective"]), rel=0.01)


@pytest.mark.slow
def test_a_design_repeats_for_its_seed(
    designed: tuple[Path, str], toml: Path, tmp_path: Path
) -> None:
    folder, _ = designed
    run("design", toml, *TINY, "--seed", 3, "--out", tmp_path, folder=tmp_path)
    assert (tmp_path / "layout.toml").read_bytes() == (folder / "layout.toml").read_bytes()
    again, before = (without_time(f / "evaluations.csv") for f in (tmp_path, folder))
    assert again == before


def test_a_killed_design_goes_on(designed: tuple[Path, str], toml: Path, tmp_path: Path) -> None:
    folder, _ = designed
    lines = (folder / "evaluations.jsonl").read_bytes().splitlines(keepends=True)
    half = len(lines) // 2
    (tmp_path / "evaluations.jsonl").write_bytes(b"".join(lines[:half]) + lines[half][:40])
    for name in ("problem.json", "run.json"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    words = run("design", toml, *TINY, "--seed", 3, "--out", tmp_path, folder=tmp_path)
    assert re.search(r"[\d,]+ releases from an earlier run", words)
    assert (tmp_path / "layout.toml").read_bytes() == (folder / "layout.toml").read_bytes()
    again, before = (without_time(f / "evaluations.csv") for f in (tmp_path, folder))
    assert again == before
    for name in ("outcomes.msgpack.gz", "layouts.csv", "chances.csv"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


@pytest.mark.parametrize(
    "change, named",
    [
        (("verge",), ("site", "'quick'")),
        ((CHUTE, "--kinds", "ditch"), ("kinds",)),
        ((CHUTE, "--target", "0.1"), ("targets",)),
        ((CHUTE, "--max-cost", "900"), ("max_cost",)),
        ((CHUTE, "--zone", "12", "30"), ("zone",)),
    ],
)
def test_a_design_of_another_problem_is_left_alone(
    change: tuple[str, ...], named: tuple[str, ...], designed: tuple[Path, str], toml: Path
) -> None:
    folder, _ = designed
    before = {path: path.read_bytes() for path in folder.iterdir()}
    line = refused("design", *change, *TINY, "--out", folder, folder=toml.parent)
    assert all(word in line for word in ("--out", "another folder", *named)), line
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_a_design_is_answered_for_other_prices(designed: tuple[Path, str], tmp_path: Path) -> None:
    folder, told = designed
    words = run("reprice", folder, "--out", "same", folder=tmp_path)
    for name in (" nothing", " constant"):  # their first rows are those of the table of costs
        first, again = (
            next(line for line in text.splitlines() if line.startswith(name)).split()
            for text in (told, words)
        )
        assert first == again
    words = run("reprice", folder, "--set", "prices.removal=0", "--out", "o", folder=tmp_path)
    assert "prices.removal = 0 (was 100)" in words
    table = rows(tmp_path / "o/costs.csv")
    evaluated = rows(folder / "evaluations.csv")
    verified = sum(row["stage"] == "verification" for row in evaluated)
    assert table[0]["layout"] == "nothing" and len(table) == verified + 1  # and the rock shed


@pytest.mark.slow
def test_a_cap_and_a_missed_target_are_told(toml: Path, tmp_path: Path) -> None:
    options = ("--max-cost", 500, "--target", 0.001, "--out", "o")
    words = run("design", toml, *TINY, *options, folder=tmp_path)
    layout = rigdda.load_layout(tmp_path / "o/layout.toml")
    assert Site.load(toml).capital(layout) <= 500.0
    assert all(float(row["cost"]) <= 500.0 for row in rows(tmp_path / "o/evaluations.csv"))
    assert (
        "a target is missed; the table shows, for each upper bound of P(reach), the layout" in words
    )
    assert "frontier.csv, frontier.png are in o" in words
    assert png_size(tmp_path / "o/frontier.png")[0] > 900
    costs = [float(row["cost"]) for row in rows(tmp_path / "o/frontier.csv")]
    assert costs == sorted(costs) and costs[0] == 0.0


def test_a_refusal_is_the_exit_code_of_a_process(tmp_path: Path) -> None:
    process = rig("design", "no-such-site", folder=tmp_path)
    out, err = process.communicate(timeout=300)
    assert (process.returncode, out) == (2, "")
    assert err.count("\n") == 1 and "no-such-site" in err and "Traceback" not in err


def test_a_folder_that_does_not_tell_its_problem_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "layout.toml").write_text("# mine\n")
    line = refused("design", "quick", *TINY, "--out", tmp_path, folder=tmp_path)
    assert "layout.toml" in line and "another folder" in line
    assert [path.name for path in tmp_path.iterdir()] == ["layout.toml"]


@pytest.mark.slow
def test_kinds_zone_and_target_are_kept_to(toml: Path, tmp_path: Path) -> None:
    options = ("--kinds", "ditch,embankment", "--zone", 25, 34, "--target", 0.9)
    words = run("design", toml, *TINY, *options, "--out", "o", folder=tmp_path)
    layout = rigdda.load_layout(tmp_path / "o/layout.toml")
    assert all(b.kind in ("ditch", "embankment") and 25.0 <= b.x <= 34.0 for b in layout)
    assert re.search(r"target P\(reach\) <= 90 %.*: (met|missed|undecided)", words)


@pytest.mark.parametrize(
    "designer", ["rule", *(pytest.param(name, marks=pytest.mark.slow) for name in ("tpe", "ppo"))]
)
def test_a_designer_can_be_chosen(designer: str, toml: Path, tmp_path: Path) -> None:
    tiny = ("--budget", 40, "--verify", 12, "--ground-samples", 0)
    words = run("design", toml, "--designer", designer, *tiny, folder=tmp_path)
    own = designer in ("rule", "constant")
    assert (designer if own else f"optimised ({designer})") in words
    assert list(tmp_path.glob("runs/design-*/layout.toml"))


def test_simulate_writes_what_it_says(toml: Path, tmp_path: Path) -> None:
    layout = tmp_path / "walls.json"
    rigdda.save_layout((rigdda.Wall(20.0, 2.0), rigdda.Wall(15.0, 1.0)), layout)
    words = run(
        *("simulate", toml, "--layout", layout, "--releases", 3, "--seed", 5, "--out", "o"),
        folder=tmp_path,
    )
    table = rows(tmp_path / "o/outcomes.csv")
    assert [int(row["seed"]) for row in table] == [5, 6, 7]
    first = rigdda.Run.load(tmp_path / "o/run.npz")
    _, outcome = rigdda.release(Site.load(toml), rigdda.load_layout(layout), 5)
    assert float(table[0]["debris_fraction"]) == outcome.debris_fraction
    assert float(table[0]["barrier_1_max_energy"]) == outcome.barriers[1].max_energy
    assert first.scene.barriers == (rigdda.Wall(20.0, 2.0), rigdda.Wall(15.0, 1.0))
    assert png_size(tmp_path / "o/section.png")[0] > 900
    for name in ("a block reaches the road [%]", "95 % interval", "wall 1.0 m high, at 15.0 m"):
        assert name in words


def test_a_ditch_in_the_crest_of_an_embankment_is_drawn(tmp_path: Path) -> None:
    """It may not be built, but is simulated as given."""
    layout = (rigdda.Embankment(11.3, 4.0, 3.0), rigdda.Ditch(12.55, 1.0, 1.0))
    rigdda.save_layout(layout, tmp_path / "layout.toml")
    options = ("--layout", "layout.toml", "--releases", 6, "--out", "o")
    told = run_told("simulate", "quick", *options, folder=tmp_path)
    assert "may not be built" in f"{told}"
    assert png_size(tmp_path / "o/section.png")[0] > 900


def test_a_design_of_nothing_has_a_report(tmp_path: Path) -> None:
    tiny = ("--budget", 60, "--verify", 30, "--ground-samples", 0, "--max-cost", 0)
    run("design", "quick", *tiny, "--out", "o", folder=tmp_path)
    table = rows(tmp_path / "o/chances.csv")
    assert table and {row["failure"] for row in table if row["layout"] == "nothing"} == {""}
    run("report", "o", "--out", "page", folder=tmp_path)
    assert "Build nothing" in (tmp_path / "page/report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_simulate_takes_every_kind(toml: Path, tmp_path: Path) -> None:
    layout = (
        rigdda.Fence(12.0, 2.0, 5e4),
        rigdda.GravityWall(16.0, 1.0),
        rigdda.Ditch(20.2, 0.5, 1.0),
        rigdda.Embankment(21.3, 0.3, 0.2),
    )
    rigdda.save_layout(layout, tmp_path / "layout.json")
    options = ("--releases", 1, "--layout", "layout.json", "--out", "o")
    words = run("simulate", toml, *options, folder=tmp_path)
    kinds = [b.kind for b in rigdda.Run.load(tmp_path / "o/run.npz").scene.barriers]
    assert kinds == [b.kind for b in layout]
    assert png_size(tmp_path / "o/section.png")[0] > 900
    for name in ("fence 50 kJ/m", "gravity wall", "ditch", "embankment", "failed"):
        assert name in words
    made = run("replay", toml, "--layout", "layout.json", "--out", "r", folder=tmp_path)
    remark, file = made.splitlines()
    assert remark.startswith("note: the layout is simulated as given but may not be built")
    assert (tmp_path / file).is_file()


def test_replay_makes_an_episode_and_says_where(toml: Path, tmp_path: Path) -> None:
    words = run("replay", toml, "--seed", 2, "--out", "o", folder=tmp_path)
    file = tmp_path / words.strip()
    assert file.name == "episode.rrd"
    assert any(chunk.entity_path == "/world/road" for chunk in RrdReader(file).stream())


def test_replay_says_that_a_layout_may_not_be_built(tmp_path: Path) -> None:
    rigdda.save_layout((rigdda.Fence(9.5, 2.0, energy_class=100),), tmp_path / "layout.toml")
    words = run("replay", "quick", "--layout", "layout.toml", "--out", "o", folder=tmp_path)
    note, file = words.strip().splitlines()
    assert note.startswith("note: the layout is simulated as given but may not be built")
    assert "within 11.3 to 34.3 m" in note and (tmp_path / file).is_file()


def test_releases_of_one_event_are_of_that_event(tmp_path: Path) -> None:
    options = ("--event", "group", "--releases", 3, "--out", "o")
    run("simulate", "quick", *options, folder=tmp_path)
    assert {row["event"] for row in rows(tmp_path / "o/outcomes.csv")} == {"group"}


def test_sites_lists_every_built_in_site_and_its_events(tmp_path: Path) -> None:
    words = run("sites", folder=tmp_path)
    assert all(name in words for name in rigdda.sites.names())
    assert "group" in words and "bench" in words


@pytest.mark.slow
def test_designers_are_compared_in_money(tmp_path: Path) -> None:
    options = ("--designer", "rule", "--budget", 60)
    more = ("--sites", 2, "--verify", 40, "--out", "o")
    words = run("evaluate", *options, *more, folder=tmp_path)
    table = rows(tmp_path / "o/scores.csv")
    assert [row["designer"] for row in table] == 2 * ["constant", "random", "rule"]
    assert len({row["site"] for row in table}) == 2
    for row in table:
        fall = float(row["nothing"]) - float(row["objective"])
        assert float(row["gain"]) == pytest.approx(fall)
    assert "behind the best" in words
    written = (tmp_path / "o/scores.csv").read_bytes()
    words = run("evaluate", *options, *more, folder=tmp_path)
    assert "from an earlier run" in words
    assert (tmp_path / "o/scores.csv").read_bytes() == written


def test_a_quick_look_with_points(tmp_path: Path) -> None:
    options = ("--model", "lumped", "--releases", 20, "--out", "o")
    marked = sites.text("verge").replace("[road]\n", "[road]\n# Edge; placeholder: replace.\n", 1)
    (tmp_path / "site.toml").write_text(marked, encoding="utf-8")
    words = run("simulate", "site.toml", *options, folder=tmp_path)
    assert "placeholder" in words
    assert "uses default coefficients that were not fitted" in words
    assert len({row["seed"] for row in rows(tmp_path / "o/points.csv")}) == 20


def test_the_seed_of_every_command_has_a_limit() -> None:
    options = [o for name in COMMANDS for o in cli.cli.commands[name].params if o.name == "seed"]
    assert len(options) >= 10
    for option in options:
        assert isinstance(option.type, WholeNumber)
        assert option.type.max is not None and option.type.max < 2**64


def test_the_largest_seed_is_in_the_tables(toml: Path, tmp_path: Path) -> None:
    options = ("--releases", 2, "--seed", RELEASE_SEED, "--out", "o")
    run("simulate", toml, *options, folder=tmp_path)
    table = pq.read_table(tmp_path / "o/stops.parquet")
    assert {*table["seed"].to_pylist()} == {RELEASE_SEED, RELEASE_SEED + 1}
    assert [int(row["seed"]) for row in rows(tmp_path / "o/outcomes.csv")] == [
        RELEASE_SEED,
        RELEASE_SEED + 1,
    ]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, tmp_path: Path) -> None:
    words = run(command, "--help", folder=tmp_path)
    assert words.startswith(f"Usage: rigdda {command}")
    if command not in ("sites", "new", "repeat", "open"):
        assert ("--seed" in words or command in ("reprice", "report")) and "--out" in words
    assert list(tmp_path.iterdir()) == []


def test_without_a_command_help_is_shown(tmp_path: Path) -> None:
    words = run_process(folder=tmp_path)
    assert all(command in words for command in COMMANDS)
    assert run_process("--version", folder=tmp_path) == f"rigdda {rigdda.__version__}\n"


@pytest.mark.parametrize(
    "change, named",
    [
        (("[road]", "[road]\ncolour = 3"), ("colour",)),
        (("[1.0, 7.5]", "[7.5, 1.0]"), ("sources.face.band",)),
        (("end = 44.8", "end = 448.0"), ("road.end", "448", "at most 80")),
        (("friction_deg = 28.0", "friction_deg = nan"), ("friction_deg", "nan", "finite")),
        (("[road]", "[road"), ("site file", "TOML")),
    ],
    ids=["unknown field", "band uphill", "road off the profile", "NaN", "TOML"],
)
def test_a_bad_site_file_is_one_line(
    change: tuple[str, str], named: tuple[str, ...], toml: Path, tmp_path: Path
) -> None:
    text = toml.read_text()
    compact = re.sub(r"\[\s*([-\d.]+),\s*([-\d.]+),\s*\]", r"[\1, \2]", text)
    assert change[0] in compact
    bad = tmp_path / "bad.toml"
    bad.write_text(compact.replace(*change))
    line = refused("simulate", bad, "--releases", 1, folder=tmp_path)
    assert all(word in line for word in named), line
    assert list(tmp_path.iterdir()) == [bad]


@pytest.mark.parametrize(
    "table, named",
    [
        ("x = 20.0\nheight = -2.0", ("height", "-2", "at least 0.001")),
        ("x = nan\nheight = 2.0", ("x", "nan", "finite")),
        ("x = 20.0\nheight = 2.0\ncolour = 3", ("colour",)),
        ("x = 400.0\nheight = 2.0", ("wall x", "400", "stay on the terrain")),
    ],
    ids=["negative height", "NaN", "unknown field", "off the slope"],
)
def test_a_bad_layout_file_is_one_line(
    table: str, named: tuple[str, ...], toml: Path, tmp_path: Path
) -> None:
    bad = tmp_path / "layout.toml"
    bad.write_text(f"[[barriers]]\n{table}\n")
    for command in ("simulate", "replay"):
        line = refused(command, toml, "--layout", bad, folder=tmp_path)
        assert all(word in line for word in named), line
    assert list(tmp_path.iterdir()) == [bad]


@pytest.mark.parametrize(
    "arguments, named",
    [
        (("simulate", "nowhere"), ("site", "nowhere", "quick")),
        (("design", "nowhere.toml"), ("site", "nowhere.toml", "existing")),
        (("design", "quick", "--designer", "oracle"), ("oracle", "race")),
        (("design", "quick", "--budget", "1"), ("--budget", "1", "2")),
        (("design", "quick", "--kinds", "net"), ("kinds", "net", "ditch")),
        (("design", "quick", "--zone", "0", "400"), ("zone", "at least")),
        (("design", "quick", "--target", "2"), ("--target", "2")),
        (("simulate", "quick", "--event", "flood"), ("event", "flood", "group")),
        (("replay", "quick", "--event", "flood"), ("event", "flood", "group")),
        (("evaluate", "--split", "exam"), ("--split", "exam", "test")),
        (("exam", "--entry", "no_such_module:design"), ("--entry", "no_such_module")),
        (("exam", "--entry", "math:cos", "--sites", 28), ("sites", "28", "at most 27")),
        (("exam", "--entry", "math:cos", "--spec", "none.toml"), ("spec", "none.toml")),
        (("dataset", "--split", "exam"), ("--split", "exam", "train")),
        (("dataset", "--sites", 1201), ("sites", "1201", "at most 1200")),
        (("fidelity", "nowhere"), ("site", "nowhere")),
        (("simulate", "quick", "--releases", "many"), ("--releases", "many")),
        (("simulate", "quick", "--seed", "-1"), ("--seed", "-1")),
        (("simulate", "quick", "--releases", 10**9), ("--releases", "1000000000")),
        (("design", "quick", "--budget", 10**9), ("--budget", "1000000000")),
        (("design", "quick", "--seed", 2**32), ("--seed", "4294967296", "4,294,967,295")),
        (("train", "--seed", 10**22), ("--seed",)),
        (("simulate", "quick", "--seed", 2**63 - 1), ("--seed", f"{2**63 - 1 - 10**6:,}")),
        (("study", "none.toml", "--seed", 2**63), ("--seed", f"{2**63 - 1 - 10**6:,}")),
        (("check", "quick", "--seed", 2**63), ("--seed", f"{2**63 - 1 - 10**6:,}")),
        (("validate", "--seed", 2**63), ("--seed", f"{2**63 - 1 - 10**6:,}")),
        (("replay", "quick", "--seed", 2**64), ("--seed", f"{2**64 - 1:,}")),
        (("fidelity", "quick", "--seed", 2**32), ("--seed", "4294967296", "4,294,967,295")),
        (("evaluate", "--seed", 2**32), ("--seed", "4294967296")),
        (("evaluate", "--sites", 10**5), ("sites", "100000", "at most")),
        (("validate", "--only", ""), ("--only", "''", "free-fall")),
        (("simulate", "quick", "--layout", "none.toml"), ("layout", "none.toml", "existing")),
        (("replay", "none.rrd"), ("none.rrd", "existing")),
        (("replay", "none.npz"), ("none.npz", "existing")),
        (("simulate",), ("SITE",)),
        (("validate", "--only", "perpetual"), ("--only", "perpetual", "free-fall")),
        (("simulate", "quick", "--colour"), ("--colour",)),
        (("dance",), ("dance",)),
    ],
)
def test_bad_arguments_are_one_line(
    arguments: tuple[object, ...], named: tuple[str, ...], tmp_path: Path
) -> None:
    line = refused(*arguments, folder=tmp_path)
    assert all(word in line for word in named), line
    assert list(tmp_path.iterdir()) == []


def test_the_accuracy_suite_is_a_table(tmp_path: Path) -> None:
    words = run("validate", "--only", "damped-fall", "--out", "it", folder=tmp_path)
    figures, orders = rows(tmp_path / "it/validate.csv"), rows(tmp_path / "it/convergence.csv")
    assert [r["quantity"] for r in figures] == ["way", "speed"]
    assert all(r["passed"] == "True" and float(r["error"]) < float(r["bar"]) for r in figures)
    assert all(float(r["order"]) == pytest.approx(2.0, abs=0.1) for r in orders)
    assert "damped-fall" in words and "order" in words


def on_terminal(*arguments: object, folder: Path) -> bytes:
    """Run to success with a terminal as standard error; return what it is sent."""
    ours, theirs = pty.openpty()
    process = rig(*arguments, folder=folder, stderr=theirs)
    os.close(theirs)
    seen = b""
    try:
        while part := os.read(ours, 4096):
            seen += part
    except OSError:  # the other end is closed
        pass
    os.close(ours)
    process.communicate(timeout=300)
    assert process.returncode == 0
    return seen


def test_a_design_answers_before_it_is_done(
    small_design: Designed, toml: Path, tmp_path: Path
) -> None:
    _, words, told = small_design
    assert told and told[0].startswith("so far, with 40 releases of each layout: Z nothing ")
    assert ", rule " in told[0] and ", constant " in told[0]
    assert "verification: 40 new releases" in words
    coarse = ("--budget", "4000", "--verify", "800", "--ground-samples", "0", "--precision", "0.3")
    seen = on_terminal("design", toml, *coarse, "--out", "b", folder=tmp_path)
    assert b"so far (100 releases each)" in seen and b"best so far" in seen
    found = rows(tmp_path / "b/evaluations.csv")
    assert int(found[-1]["simulations"]) < 4000 and int(found[-1]["releases"]) < 800


def test_a_terminal_sees_progress(toml: Path, tmp_path: Path) -> None:
    seen = on_terminal("simulate", toml, "--releases", 3, folder=tmp_path)
    assert b"tables and pictures" in seen and b"3/3" in seen  # the last state is always drawn


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ("evaluate", "--budget", "1e4"),
            "--budget = '1e4': give a whole number of at least 2 and",
        ),
        (("evaluate", "--sites", "0"), "--sites = '0': give a whole number of at least 1 and"),
        (
            ("design", "quick", "--target", "0"),
            "--target = '0': give a number above 0.0 and at most",
        ),
        (
            ("design", "quick", "--precision", "2"),
            "--precision = '2': give a number of at least 0.0 and at most 0.5",
        ),
        (("design", "quick", "--seed", "-1"), "--seed = '-1': give a whole number of at least 0"),
        (
            ("design", "quick", "--precision", "nan"),
            "--precision = 'nan': give a finite number of at least 0.0 and at most 0.5",
        ),
        (
            ("design", "quick", "--target", "NaN"),
            "--target = 'NaN': give a finite number above 0.0 and at most 1.0",
        ),
        (
            ("design", "quick", "--max-cost", "inf"),
            "--max-cost = 'inf': give a finite number of at least 0.0",
        ),
        (("design", "quick", "--zone", "nan", "20"), "--zone = 'nan': give a finite number"),
        (("simulate", "quick", "--station", "inf"), "--station = 'inf': give a finite number"),
        (
            ("train", "--model", "value", "--simulate", "3"),
            "--algorithm, --simulate, --compare and --verify are for --model policy",
        ),
        (("train", "--model", "value", "--compare", "6"), "are for --model policy"),
        (("train", "--model", "corridor", "--verify", "200"), "are for --model policy"),
        (("train", "--model", "corridor", "--algorithm", "gradient"), "are for --model policy"),
        (("train", "--compare", "100000"), "--compare = 100000: give a whole number of at least 0"),
        (
            ("design", "quick", "--ground-samples", "0", "--posterior", "posterior.csv"),
            "--posterior is for the comparison on other grounds: leave it out",
        ),
    ],
)
def test_an_option_outside_its_range_says_which_numbers_are_accepted(
    arguments: tuple[str, ...], line: str, tmp_path: Path
) -> None:
    assert line in refused(*arguments, folder=tmp_path)
    assert list(tmp_path.iterdir()) == []
