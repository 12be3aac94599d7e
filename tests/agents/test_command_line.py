"""The command line as users meet it: real processes, real files."""

from __future__ import annotations

import csv
import json
import os
import pty
import re
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

import rigdda
from agents import DESIGNERS
from rigdda import Site
from rigdda.barriers import to_tables

TINY = ("--simulations", "24", "--verify", "4")
COMMANDS = ("sites", "simulate", "design", "study", "train", "evaluate", "validate", "replay")


def rig(*arguments: object, folder: Path, stderr: int = subprocess.PIPE) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "agents.cli", *map(str, arguments)]
    root = Path(rigdda.__file__).parents[1]
    path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    env = os.environ | {"PYTHONPATH": path, "PYTHONWARNINGS": "error", "COLUMNS": "80"}
    return subprocess.Popen(
        command, cwd=folder, env=env, stdout=subprocess.PIPE, stderr=stderr, text=True
    )


def run(*arguments: object, folder: Path) -> str:
    """Run to success; return standard output. In a pipe nothing else is said."""
    process = rig(*arguments, folder=folder)
    out, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (0, "")
    return out


def refused(*arguments: object, folder: Path) -> str:
    """Run to exit code 2; return the one line on standard error."""
    process = rig(*arguments, folder=folder)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 2, err
    assert out == "" and err.count("\n") == 1 and "Traceback" not in err
    return err


def png_size(file: Path) -> tuple[int, int]:
    head = file.read_bytes()[:24]
    assert head.startswith(b"\x89PNG")
    return struct.unpack(">II", head[16:24])


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as lines:
        return list(csv.DictReader(lines))


@pytest.fixture(scope="module")
def toml(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("site") / "chute.toml"
    site.save(file)
    return file


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder and the words of a small design of the built-in site for tests."""
    folder = tmp_path_factory.mktemp("designed")
    return folder, run("design", "quick", *TINY, "--seed", 3, "--out", folder, folder=folder)


def test_every_file_of_a_design_is_there_and_sound(designed: tuple[Path, str]) -> None:
    folder, words = designed
    layout = rigdda.load_layout(folder / "layout.toml")
    table = rows(folder / "evaluations.csv")
    stored = [json.loads(line) for line in (folder / "evaluations.jsonl").read_text().splitlines()]
    told = [
        (json.loads(row["barriers"]), int(row["releases"]), float(row["objective"]))
        for row in table
    ]
    kept = [line["evaluation"] for line in stored]
    # what was evaluated before, with the same releases, is told again but stored once
    known = [(one["layout"], len(one["seeds"]), one["objective"]) for one in kept]
    assert [one for i, one in enumerate(told) if one not in told[:i]] == known
    assert {row["stage"] for row in table} == {"search", "final", "verification"}
    assert [row["stage"] for row in table[-3:]] == 3 * ["verification"]
    assert json.loads(table[-1]["barriers"]) == to_tables(layout)
    assert int(table[-1]["simulations"]) <= 24
    for name in ("profile.png", "search.png"):
        width, height = png_size(folder / name)
        assert 900 <= width <= 2000 and 600 <= height <= 2500
    entities = {chunk.entity_path for chunk in RrdReader(folder / "episode.rrd").stream()}
    assert {"/world/road", "/world/terrain", "/notes"} <= entities
    for name in ("no barrier", "engineering rule", "optimised (cma)", "cost", "95 %"):
        assert name in words
    assert max(map(len, words.splitlines()[:8])) <= 80


def test_a_fence_is_told_with_its_failures(designed: tuple[Path, str]) -> None:
    assert re.search(r"fence at .* kJ/m, fails in \d+ of \d+ releases", designed[1])


def test_a_design_repeats_for_its_seed(designed: tuple[Path, str], tmp_path: Path) -> None:
    folder, words = designed
    again = run("design", "quick", *TINY, "--seed", 3, "--out", tmp_path, folder=tmp_path)
    for name in ("layout.toml", "evaluations.csv", "evaluations.jsonl"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
    assert again.replace(str(tmp_path), "") == words.replace(str(folder), "")


def test_a_killed_design_goes_on(designed: tuple[Path, str], tmp_path: Path) -> None:
    folder, _ = designed
    lines = (folder / "evaluations.jsonl").read_bytes().splitlines(keepends=True)
    half = len(lines) // 2
    (tmp_path / "evaluations.jsonl").write_bytes(b"".join(lines[:half]) + lines[half][:40])
    words = run("design", "quick", *TINY, "--seed", 3, "--out", tmp_path, folder=tmp_path)
    taken = int(re.findall(r"(\d+) releases taken from a former run", words)[0])
    assert taken == sum(len(json.loads(line)["evaluation"]["seeds"]) for line in lines[:half])
    for name in ("layout.toml", "evaluations.csv", "evaluations.jsonl"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


@pytest.mark.parametrize("designer", [name for name in DESIGNERS if name != "cma"])
def test_every_designer_can_be_chosen(designer: str, toml: Path, tmp_path: Path) -> None:
    words = run("design", toml, "--designer", designer, *TINY, folder=tmp_path)
    assert ("engineering rule" if designer == "rule" else f"optimised ({designer})") in words
    folder = tmp_path / "runs/design-chute"
    assert (folder / "layout.toml").is_file()
    if designer == "pareto":
        assert png_size(folder / "front.png")[0] > 900
        costs = [float(row["cost"]) for row in rows(folder / "front.csv")]
        assert costs and costs == sorted(costs)


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
    assert png_size(tmp_path / "o/profile.png")[0] > 900
    for name in ("debris past the road's edge [%]", "95 % interval", "wall at 15.0 m"):
        assert name in words


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
    assert rigdda.Run.load(tmp_path / "o/run.npz").scene.barriers == layout
    assert png_size(tmp_path / "o/profile.png")[0] > 900
    for name in ("fence at 12.0 m", "gravity wall at", "ditch at", "embankment at", "failed"):
        assert name in words
    made = run("replay", toml, "--layout", "layout.json", "--out", "r", folder=tmp_path)
    assert (tmp_path / made.strip()).is_file()


def test_replay_makes_an_episode_and_says_where(toml: Path, tmp_path: Path) -> None:
    words = run("replay", toml, "--seed", 2, "--out", "o", folder=tmp_path)
    file = tmp_path / words.strip()
    assert file.name == "episode.rrd"
    assert any(chunk.entity_path == "/world/road" for chunk in RrdReader(file).stream())


def test_sites_lists_every_built_in_site(tmp_path: Path) -> None:
    words = run("sites", folder=tmp_path)
    assert all(name in words for name in rigdda.sites.names())


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, tmp_path: Path) -> None:
    words = run(command, "--help", folder=tmp_path)
    assert words.startswith(f"Usage: rigdda {command}")
    if command != "sites":
        assert "--seed" in words and "--out" in words
    assert list(tmp_path.iterdir()) == []


def test_without_a_command_help_is_shown(tmp_path: Path) -> None:
    words = run(folder=tmp_path)
    assert all(command in words for command in COMMANDS)
    assert run("--version", folder=tmp_path) == f"rigdda {rigdda.__version__}\n"


@pytest.mark.parametrize(
    "change, named",
    [
        (("[road]", "[road]\ncolour = 3"), ("colour",)),
        (("[1.0, 23.75]", "[9.0, 17.0]"), ("source.polygon", "untangle")),
        (("end = 31.0", "end = 310.0"), ("road.end", "310", "at most 70")),
        (("friction_deg = 22.0", "friction_deg = nan"), ("friction_deg", "nan", "finite")),
        (("[road]", "[road"), ("site file", "TOML")),
    ],
    ids=["unknown field", "self-crossing source", "road off the profile", "NaN", "TOML"],
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
        (("design", "quick", "--designer", "oracle"), ("oracle", "cma")),
        (("design", "quick", "--simulations", "1"), ("--simulations", "1", "2")),
        (("simulate", "quick", "--releases", "many"), ("--releases", "many")),
        (("simulate", "quick", "--seed", "-1"), ("--seed", "-1")),
        (("simulate", "quick", "--releases", 10**9), ("--releases", "1000000000")),
        (("design", "quick", "--simulations", 10**9), ("--simulations", "1000000000")),
        (("design", "quick", "--seed", 2**32), ("--seed", "4294967296", "4294967295")),
        (("train", "--seed", 10**22), ("--seed",)),
        (("evaluate", "--seed", 2**32), ("--seed", "4294967296")),
        (("evaluate", "--sites", 10**5), ("sites", "100000", "at most 10000")),
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


def test_a_terminal_sees_progress(toml: Path, tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    process = rig("simulate", toml, "--releases", 3, folder=tmp_path, stderr=theirs)
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
    assert b"simulating" in seen and b"3/3" in seen
