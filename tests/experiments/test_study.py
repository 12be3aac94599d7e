"""The runner of studies: order, what is kept, and how a study goes on."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from experiments import study
from experiments.made_by import made_by
from experiments.study import tabulate
from rigdda import MECHANICS

CASES = [{"name": name, "dt": dt} for name in ("a", "b") for dt in (0.1, 0.2)]


class Measure:
    """A measurement that can be stopped, and that keeps what it was asked for."""

    def __init__(self, stops: int = 99):
        self.asked: list[tuple[str, float]] = []
        self.stops = stops

    def __call__(self, name: str, dt: float) -> study.Row:
        if len(self.asked) == self.stops:
            raise KeyboardInterrupt
        self.asked.append((name, dt))
        return {"double": np.float64(2.0 * dt), "times": np.int64(3), "none": math.nan, "word": ""}


def told(row: study.Row) -> str:
    return str(row["name"])


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_table_holds_a_row_a_case_in_their_order(tmp_path: Path) -> None:
    rows = tabulate(tmp_path / "t.csv", CASES, Measure(), told)
    assert [(r["name"], r["dt"], r["double"]) for r in rows] == [
        (c["name"], c["dt"], 2.0 * c["dt"]) for c in CASES
    ]
    assert table(tmp_path / "t.csv")[1] == {
        "name": "a", "dt": "0.2", "double": "0.4", "times": "3", "none": "", "word": "",
    }  # fmt: skip
    assert made_by(tmp_path) == {"t.csv": MECHANICS}
    assert not list(tmp_path.glob("*.part*"))


def test_what_was_stopped_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(KeyboardInterrupt):
        tabulate(tmp_path / "t.csv", CASES, Measure(stops=3), told)
    assert not (tmp_path / "t.csv").exists()
    rest = Measure()
    rows = tabulate(tmp_path / "t.csv", CASES[::-1], rest, told)
    assert rest.asked == [("b", 0.2)]
    assert "resuming with 1 of 4" in capsys.readouterr().err
    assert [r["double"] for r in rows] == [0.4, 0.2, 0.4, 0.2]


def test_what_is_complete_is_computed_anew(tmp_path: Path) -> None:
    tabulate(tmp_path / "t.csv", CASES, Measure(), told)
    again = Measure()
    tabulate(tmp_path / "t.csv", CASES, again, told)
    assert len(again.asked) == len(CASES)


def test_other_mechanics_begin_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(KeyboardInterrupt):
        tabulate(tmp_path / "t.csv", CASES, Measure(stops=3), told)
    monkeypatch.setattr(study, "MECHANICS", "other")
    anew = Measure()
    tabulate(tmp_path / "t.csv", CASES, anew, told)
    assert len(anew.asked) == len(CASES)


def test_two_at_once_keep_the_order(tmp_path: Path) -> None:
    rows = tabulate(tmp_path / "t.csv", CASES, Measure(), told, processes=2)
    assert [(r["name"], r["dt"]) for r in rows] == [tuple(c.values()) for c in CASES]
