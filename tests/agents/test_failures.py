"""What the command line says and keeps when a job fails on the way or a viewer is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import rigdda
from agents import cli
from rigdda import Diverged, Run, Site


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
    from envs import DesignProblem

    arguments = ["design", str(chute), "--simulations", "24", "--verify", "2", "--out", "o"]
    whole, left = DesignProblem.evaluate, [3]

    def stop(*given: Any, **named: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise error
        return whole(*given, **named)

    monkeypatch.setattr(DesignProblem, "evaluate", stop)
    assert cli.main(arguments) == code
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "kept in o: evaluations.csv, evaluations.jsonl" in err
    assert len(Path("o/evaluations.jsonl").read_text().splitlines()) == 3
    assert len(Path("o/evaluations.csv").read_text().splitlines()) == 4
    left[0] = 1000
    assert cli.main(arguments) == 0
    assert "3 taken from a former run" in capsys.readouterr().out


def test_a_fault_of_the_programme_is_not_called_bad_input(
    chute: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(rigdda, "load_layout", fail)
    with pytest.raises(ZeroDivisionError):
        cli.main(["simulate", str(chute), "--layout", "x"])


def test_a_folder_that_cannot_be_written_is_one_line(
    chute: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["simulate", str(chute), "--out", "chute.toml/o"]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "chute.toml" in err


def test_replay_opens_recordings_and_converts_runs(
    chute: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[Path] = []
    monkeypatch.setattr("rigdda.replay.open_viewer", opened.append)
    rigdda.release(site, (), 1)[0].save("one.npz")
    assert cli.main(["replay", "one.npz"]) == 0
    assert cli.main(["replay", "one.rrd"]) == 0
    assert opened == [Path("one.rrd"), Path("one.rrd")]
    assert Path("one.rrd").read_bytes().startswith(b"RRF")
