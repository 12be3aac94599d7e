"""What the command line says and keeps when a job fails on the way or a viewer is asked for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import rigdda
from rigdda import BadInput, Diverged, Run, Site
from rigdda.app import cli
from rigdda.app.terminal import Stopped, folder_for, recorded_run
from rigdda.files import atomic


@pytest.fixture
def chute(site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A site file in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    site.save("chute.toml")
    return Path("chute.toml")


def test_a_diverged_release_leaves_its_run(
    chute: Path, site: Site, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run, _ = rigdda.release(site, (), 0)

    def diverge(*_: Any, **__: Any) -> None:
        raise Diverged("step 7: block 3 moves at nan", run)

    monkeypatch.setattr(rigdda, "release", diverge)
    assert cli.main(["simulate", str(chute), "--releases", "1", "--out", "o"]) == 1
    out, err = capsys.readouterr()
    assert err == "rigdda: step 7: block 3 moves at nan; kept in o: diverged.npz\n" and out == ""
    kept = Run.load("o/diverged.npz")
    assert (kept.poses == run.poses).all()


@pytest.mark.parametrize("error, code", [(Diverged("gone"), 1), (KeyboardInterrupt(), 130)])
def test_a_design_that_stops_keeps_its_evaluations_and_goes_on(
    error: BaseException,
    code: int,
    chute: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from rigdda.envs import DesignProblem

    options = ["--designer", "random", "--budget", "40", "--verify", "12"]
    options += ["--ground-samples", "0", "--checks", "reported"]
    arguments = ["design", "chute.toml", *options, "--out", "o"]
    whole, left = DesignProblem.evaluate, [3]

    def stop(*given: Any, **named: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise error
        return whole(*given, **named)

    monkeypatch.setattr(DesignProblem, "evaluate", stop)
    assert cli.main(arguments) == code
    err = capsys.readouterr().err
    err = err.splitlines()[-1]  # a slow machine shows progress before
    assert err.startswith("rigdda: ") and "kept in o: evaluations.csv, evaluations.jsonl" in err
    lines = Path("o/evaluations.jsonl").read_text().splitlines()
    assert len(lines) == 3 + 3  # the parts of the first answer come before the search
    assert len(Path("o/evaluations.csv").read_text().splitlines()) == 4
    left[0] = 1000
    assert cli.main(arguments) == 0
    assert "from an earlier run" in capsys.readouterr().out


def test_a_fault_of_the_programme_is_not_called_bad_input(
    chute: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(rigdda, "load_layout", fail)
    with pytest.raises(ZeroDivisionError):
        cli.main(["simulate", str(chute), "--layout", "x"])


@pytest.mark.parametrize("out", ["chute.toml/o", f"{os.devnull}/o", "long" * 100])
def test_a_folder_that_cannot_be_written_is_one_line(
    out: str, chute: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["simulate", str(chute), "--out", out]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "--out = " in err and "name a folder" in err


@pytest.mark.parametrize(
    "command, file",
    [
        (("simulate", "chute.toml"), "outcomes.csv"),
        (("simulate", "chute.toml"), "run.npz"),
        (("simulate", "chute.toml"), "section.png"),
        (("design", "chute.toml"), "layout.toml"),
        (("design", "chute.toml"), "cost.png"),
        (("design", "chute.toml"), "problem.json"),
        (("design", "chute.toml"), "run.json"),
        (("simulate", "chute.toml"), "run.json"),
        (("validate",), "run.json"),
        (("fidelity", "chute.toml"), "fidelity.csv"),
        (("replay", "chute.toml"), "episode.rrd"),
        (("study", "study.toml"), "study.csv"),
        (("train",), "policy.safetensors"),
        (("evaluate",), "evaluations.jsonl"),
        (("validate",), "validate.csv"),
    ],
)
def test_what_is_in_the_way_of_a_file_is_said_before_any_computing(
    command: tuple[str, ...],
    file: str,
    chute: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("study.toml").write_text('site = "chute.toml"\n[[layouts]]\nname = "nothing"\n')
    (Path("o") / file).mkdir(parents=True)
    for name in ("release", "release_many"):
        monkeypatch.delattr(rigdda, name)
    assert cli.main([*command, "--out", "o"]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and f"--out = 'o/{file}'" in err and "another folder" in err
    assert [path.name for path in Path("o").iterdir()] == [file]


LONG = "long" * 80


@pytest.mark.parametrize(
    ("command", "field"),
    [
        (("simulate", "chute.toml", "--layout", LONG), "layout"),
        (("design", "chute.toml", "--posterior", LONG), "--posterior"),
        (("report", LONG), "RESULTS"),
        (("replay", f"{LONG}.npz"), "run file"),
        (("replay", f"{LONG}.rrd"), "replay file"),
        (("repeat", f"{LONG}.rrd"), "replay file"),
        (("open", f"{LONG}.toml"), "SITE"),
        (("study", f"{LONG}.toml"), "study"),
    ],
)
def test_a_name_that_no_file_can_have_is_named(
    command: tuple[str, ...], field: str, chute: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(list(command)) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"rigdda: {field} = 'longlong") and err.count("\n") == 1
    assert "name " in err and "Errno" not in err
    assert list(Path().iterdir()) == [chute]


def test_a_path_that_cannot_be_used_is_named_with_its_remedy(
    chute: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: Any) -> None:
        raise NotADirectoryError(20, "Not a directory", "chute.toml/x")

    monkeypatch.setattr(rigdda, "load_layout", fail)
    assert cli.main(["simulate", "chute.toml", "--layout", "x"]) == 2
    said = (
        "path = 'chute.toml/x': name a file or folder that exists and that you may read or write "
    )
    said += "(Not a directory)"
    assert capsys.readouterr().err == f"rigdda: {said}\n"


@pytest.mark.parametrize(
    "name, folder",
    [
        ("a plain one-2 (größer)", "replay-a plain one-2 (größer)"),
        ("../../evil/x", "replay-..-..-evil-x"),
        ("a\0b\nc\\d", "replay-a-b-c-d"),
        (300 * "ö", "replay-" + 96 * "ö"),
    ],
)
def test_the_folder_of_a_site_is_in_runs_whatever_its_name(
    name: str, folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert folder_for(None, f"replay-{name}") == Path("runs") / folder
    assert [path.name for path in Path("runs").iterdir()] == [folder]


def test_only_what_a_run_has_written_is_said_to_be_kept(tmp_path: Path) -> None:
    for name in ("outcomes.csv", "evaluations.jsonl", "same.csv"):
        (tmp_path / name).write_text("former\n")
    with pytest.raises(Stopped, match=r"kept in .*: evaluations\.jsonl, new\.csv, same\.csv$"):
        with recorded_run(tmp_path):
            (tmp_path / "new.csv").touch()
            with (tmp_path / "evaluations.jsonl").open("a") as file:
                file.write("more\n")
            with atomic(tmp_path / "same.csv") as part:
                part.write_text("former\n")
            raise KeyboardInterrupt


def test_a_folder_is_written_by_one_run_at_a_time(tmp_path: Path) -> None:
    with recorded_run(tmp_path):
        with (
            pytest.raises(BadInput, match="another run is writing into it"),
            recorded_run(tmp_path),
        ):
            pass
    with recorded_run(tmp_path):
        pass


def test_temporary_files_of_a_killed_run_are_removed(tmp_path: Path) -> None:
    script = (
        "import os, sys\nfrom rigdda.files import atomic\n"
        "with atomic(sys.argv[1]) as part:\n    part.write_text('half')\n    os._exit(9)\n"
    )
    for name in ("gain.svg", "layouts/km 1.toml"):
        subprocess.run([sys.executable, "-c", script, tmp_path / name], check=False)
    (tmp_path / ".notes.personal").write_text("mine")
    assert len([*tmp_path.rglob(".*")]) == 3
    with recorded_run(tmp_path):
        pass
    assert [path.name for path in tmp_path.rglob(".*")] == [".notes.personal"]


def test_replay_opens_recordings_and_converts_runs(
    chute: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[Path] = []
    monkeypatch.setattr("rigdda.replay.viewer.open_viewer", opened.append)
    rigdda.release(site, (), 1)[0].save("one.npz")
    assert cli.main(["replay", "one.npz"]) == 0
    assert cli.main(["replay", "one.rrd"]) == 0
    assert opened == [Path("one.rrd"), Path("one.rrd")]
    assert Path("one.rrd").read_bytes().startswith(b"RRF")
