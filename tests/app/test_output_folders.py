"""Results folders: files of the user and of other commands are not overwritten."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from processes import refused, run

from rigdda import Site
from rigdda.agents import run_record

LAYOUT = """[[barriers]]
kind = "ditch"
x = 29.5
depth = 1.0
width = 3.0
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    Site.load("quick").save(tmp_path / "site.toml")
    (tmp_path / "layout.toml").write_text(LAYOUT, encoding="utf-8")
    return tmp_path


def simulate(folder: Path, out: str, *more: object) -> str:
    return run("simulate", "site.toml", "--releases", 1, "--out", out, *more, folder=folder)


def test_a_folder_parts_of_the_user_is_kept(folder: Path) -> None:
    own = folder / "results/parts/fence_parts.txt"
    own.parent.mkdir(parents=True)
    own.write_text("posts", encoding="utf-8")
    simulate(folder, "results")
    assert own.read_text(encoding="utf-8") == "posts"


def test_a_command_may_be_repeated_in_its_folder(folder: Path) -> None:
    simulate(folder, "results")
    simulate(folder, "results", "--layout", "layout.toml")


def test_an_interrupted_command_may_be_repeated_and_keeps_its_files(folder: Path) -> None:
    simulate(folder, "results")
    record = run_record.read(folder / "results")
    files = record["simulate"].files
    record["simulate"].files = []  # as at the start of the first run of a command
    run_record.write_records(folder / "results", record)
    simulate(folder, "results")
    assert set(files) <= {*run_record.read(folder / "results")["simulate"].files, "run.npz"}


def test_files_without_a_record_are_not_overwritten(folder: Path) -> None:
    simulate(folder, "results")
    (folder / "results/run.json").unlink()
    line = refused("simulate", "site.toml", "--releases", 1, "--out", "results", folder=folder)
    assert "run.json does not say that `rigdda simulate` wrote this file: move it away" in line


def test_results_of_another_command_are_not_overwritten(folder: Path) -> None:
    simulate(folder, "results")
    before = (folder / "results/section.png").read_bytes()
    (folder / "results/run.json").write_text(
        (folder / "results/run.json").read_text(encoding="utf-8").replace(
            '"simulate"', '"design"'
        ), encoding="utf-8",
    )  # fmt: skip
    line = refused("simulate", "site.toml", "--releases", 1, "--out", "results", folder=folder)
    assert "`rigdda design` wrote this file: name another folder" in line
    assert (folder / "results/section.png").read_bytes() == before


def test_an_input_in_the_results_folder_is_not_overwritten(folder: Path) -> None:
    (folder / "seen.csv").write_text("event,run_out_m\nblock,30\nblock,31\nblock,33\n")
    before = (folder / "site.toml").read_bytes()
    line = refused(
        "fit", "site.toml", "seen.csv", "--parameters", "surfaces.rock.friction_deg=25:45",
        "--out", ".", folder=folder,
    )  # fmt: skip
    assert "site.toml" in line and "does not say that `rigdda fit` wrote this file" in line
    assert (folder / "site.toml").read_bytes() == before


def test_another_study_does_not_replace_the_results_of_the_first(folder: Path) -> None:
    study = 'site = "site.toml"\nreleases = 1\n[[layouts]]\nname = "ditch"\nfile = "layout.toml"\n'
    for name in ("a.toml", "b.toml"):
        (folder / name).write_text(study, encoding="utf-8")
    run("study", "a.toml", "--out", "results", folder=folder)
    before = (folder / "results/study.csv").read_bytes()
    line = refused("study", "b.toml", "--out", "results", folder=folder)
    assert "it has the results of the study a.toml: name another folder" in line
    assert (folder / "results/study.csv").read_bytes() == before
    (folder / "a.toml").write_text(study.replace("ditch", "pit"), encoding="utf-8")
    run("study", folder / "a.toml", "--out", folder / "results", folder=folder)


@pytest.mark.parametrize("name", ["risk.csv", "frontier.png", "frontier.svg", "band.csv"])
def test_files_that_a_design_writes_only_sometimes_are_not_replaced(
    name: str, folder: Path
) -> None:
    own = folder / "results" / name
    own.parent.mkdir()
    own.write_text("my own data", encoding="utf-8")
    line = refused("design", "site.toml", "--budget", 20, "--out", "results", folder=folder)
    assert name in line and "`rigdda design` wrote this file" in line
    assert own.read_text(encoding="utf-8") == "my own data"


STUDY = 'site = "site.toml"\nreleases = 2\n[[layouts]]\nname = "ditch"\nfile = "layout.toml"\n'


@pytest.mark.parametrize("name", ["risk.csv", "worst.csv", "worst.svg", "costs.svg"])
def test_files_that_a_study_writes_only_sometimes_are_not_replaced(name: str, folder: Path) -> None:
    (folder / "a.toml").write_text(STUDY, encoding="utf-8")
    own = folder / "results" / name
    own.parent.mkdir()
    own.write_text("my own data", encoding="utf-8")
    line = refused("study", "a.toml", "--out", "results", folder=folder)
    assert name in line and "`rigdda study` wrote this file" in line
    assert own.read_text(encoding="utf-8") == "my own data"


def test_a_repeated_study_keeps_no_worst_releases_of_an_earlier_one(folder: Path) -> None:
    (folder / "a.toml").write_text(STUDY, encoding="utf-8")
    run("study", "a.toml", "--worst", 1, "--out", "results", folder=folder)
    assert {"worst.csv", "worst.png", "worst.svg"} <= {
        f.name for f in (folder / "results").iterdir()
    }
    run("study", "a.toml", "--seed", 9, "--out", "results", folder=folder)
    left = {file.name for file in (folder / "results").iterdir()}
    assert not any(name.startswith("worst") for name in left)
    assert set(run_record.read(folder / "results")["study"].files) <= left


def test_a_repeated_simulation_keeps_no_results_of_an_earlier_one(folder: Path) -> None:
    simulate(folder, "results", "--station", 25)
    assert (folder / "results/station_25m.svg").exists()
    own = folder / "results/notes.txt"
    own.write_text("mine", encoding="utf-8")
    simulate(folder, "results", "--station", 30)
    left = {file.name for file in (folder / "results").iterdir()}
    assert {"station_30m.png", "station_30m.svg", "notes.txt"} <= left
    assert not any(name.startswith("station_25m") for name in left)
    assert set(run_record.read(folder / "results")["simulate"].files) <= left
    simulate(folder, "results", "--model", "lumped")
    left = {file.name for file in (folder / "results").iterdir()}
    assert {"points.csv", "notes.txt"} <= left
    assert not any(name.endswith((".png", ".svg", ".parquet")) for name in left)


def test_a_report_replaces_only_a_report(folder: Path) -> None:
    simulate(folder, "results")
    run("report", "results", "--out", "pages", folder=folder)
    run("report", "results", "--out", "pages", folder=folder)
    (folder / "pages/report.html").write_text("<p>mine</p>", encoding="utf-8")
    line = refused("report", "results", "--out", "pages", folder=folder)
    assert "report.html: this file is not a report of rigdda" in line.replace("'", "")
    assert (folder / "pages/report.html").read_text(encoding="utf-8") == "<p>mine</p>"
    earlier = '<!doctype html><html><head><meta name="generator" content="rigdda 0.2.0">'
    (folder / "pages/report.html").write_text(earlier, encoding="utf-8")
    run("report", "results", "--out", "pages", folder=folder)


def test_a_conversion_does_not_replace_a_replay(folder: Path) -> None:
    simulate(folder, "results")
    (folder / "results/run.rrd").write_text("mine", encoding="utf-8")
    line = refused("replay", "results/run.npz", folder=folder)
    assert "run.rrd" in line and "move it away: it is not a replay of rigdda" in line
    assert (folder / "results/run.rrd").read_text(encoding="utf-8") == "mine"


def test_a_conversion_replaces_an_earlier_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[Path] = []
    monkeypatch.setattr("rigdda.replay.viewer.open_viewer", opened.append)
    simulate(folder, "results")
    for _ in range(2):
        run("replay", "results/run.npz", folder=folder)
    assert [path.name for path in opened] == ["run.rrd"] * 2


def test_a_study_of_a_site_with_rates_of_arrivals_converts_them(folder: Path) -> None:
    site = Site.load(folder / "site.toml")
    events = tuple(msgspec.structs.replace(e, rate_of="arrival") for e in site.events)
    msgspec.structs.replace(site, events=events).save(folder / "site.toml")
    (folder / "a.toml").write_text(STUDY, encoding="utf-8")
    assert "rock arrives" in run("study", "a.toml", "--out", "results", folder=folder)
