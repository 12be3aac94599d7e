"""Outcomes are compared with a record, and tables are carried over only where none differs."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from experiments import outcomes, script
from experiments.made_by import KERNELS, made_by
from rigdda import MECHANICS

NUMBERS = {"one": 1.0, "two": 2.0}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder of results by other kernels, whose outcomes are recorded."""
    values = dict(NUMBERS)
    monkeypatch.setattr(
        outcomes,
        "computed",
        lambda: iter([(k, lambda v=v: outcomes.digest(np.array([v]))) for k, v in values.items()]),
    )
    with monkeypatch.context() as patch:
        patch.setattr(script, "kernels_hash", lambda: "0ld")
        told = CliRunner().invoke(outcomes.main, ["--record", "--out", str(tmp_path)])
        script.write(tmp_path / "table.csv", [{"a": 1.0}])
    assert told.exit_code == 0
    with monkeypatch.context() as patch:
        patch.setattr(script, "kernels_hash", lambda: "0lder")
        script.write(tmp_path / "stale.csv", [{"a": 1.0}])
    monkeypatch.setattr(outcomes, "kernels_hash", kernels_hash)
    return tmp_path, values


def test_tables_are_carried_over_where_nothing_differs(folder):
    out, _ = folder
    told = CliRunner().invoke(outcomes.main, ["--carry", "--out", str(out)])
    assert told.exit_code == 0 and "0 of 2 differ" in told.output
    assert made_by(out) == {"table.csv": MECHANICS, "stale.csv": "0lder"}


def test_nothing_is_carried_over_where_an_outcome_differs(folder):
    out, values = folder
    before = (out / KERNELS).read_text()
    values["two"] = np.nextafter(2.0, 3.0)
    told = CliRunner().invoke(outcomes.main, ["--carry", "--out", str(out)])
    assert told.exit_code == 1 and "1 of 2 differ" in told.output
    assert (out / KERNELS).read_text() == before
    assert "two: differs" in told.output + (told.stderr if told.stderr_bytes else "")


@pytest.mark.slow
def test_two_computations_are_alike():
    one = {what: call() for what, call in outcomes.computed() if not what.startswith("case")}
    two = {what: call() for what, call in outcomes.computed() if not what.startswith("case")}
    assert one == two and len(set(one.values())) > 0.9 * len(one)
