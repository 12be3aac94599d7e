"""Outcomes are compared with a record; if they change, the version of the mechanics has to."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from experiments import outcomes, script, short_outcomes
from experiments.made_by import made_by
from experiments.script import RESULTS
from rigdda import MECHANICS


def test_outcomes_are_those_recorded_for_this_version_of_the_mechanics():
    """`MECHANICS` stands for results: whoever changes these, changes it, too."""
    changed = short_outcomes.changed(RESULTS)
    made = made_by((RESULTS / short_outcomes.TABLE).parent)[short_outcomes.TABLE.name]
    record = "run python -m experiments.outcomes --record"
    assert not changed or made != MECHANICS, f"set another rigdda.MECHANICS and {record}: {changed}"
    assert made == MECHANICS, f"outcomes are recorded for the mechanics {made!r}: {record}"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with recorded outcomes, and the numbers that are computed next."""
    values = {"one": 1.0, "two": 2.0}
    monkeypatch.setattr(
        outcomes,
        "computed",
        lambda: iter([(k, lambda v=v: outcomes.digest(np.array([v]))) for k, v in values.items()]),
    )
    monkeypatch.setattr(short_outcomes, "computed", lambda: ((k, [v]) for k, v in values.items()))
    told = CliRunner().invoke(outcomes.main, ["--record", "--out", str(tmp_path)])
    assert told.exit_code == 0
    return tmp_path, values


def test_a_difference_is_found_to_the_last_bit(folder):
    out, values = folder
    assert CliRunner().invoke(outcomes.main, ["--out", str(out)]).exit_code == 0
    values["two"] = np.nextafter(2.0, 3.0)
    told = CliRunner().invoke(outcomes.main, ["--out", str(out)])
    assert told.exit_code == 1 and "1 of 2 differ" in told.output
    assert "two: differs" in told.output + (told.stderr if told.stderr_bytes else "")


def test_other_outcomes_are_recorded_only_with_another_version(folder, monkeypatch):
    out, values = folder
    before = outcomes.recorded(out)
    values |= {"two": 3.0, "three": 3.0}
    told = CliRunner().invoke(outcomes.main, ["--record", "--out", str(out)])
    assert told.exit_code == 1 and "change rigdda.MECHANICS" in told.output
    assert outcomes.recorded(out) == before
    for module in (outcomes, script):
        monkeypatch.setattr(module, "MECHANICS", "other")
    told = CliRunner().invoke(outcomes.main, ["--record", "--out", str(out)])
    assert told.exit_code == 0 and outcomes.recorded(out).keys() == values.keys()
    assert {*made_by((out / outcomes.TABLE).parent).values()} == {"other"}


def test_further_outcomes_need_no_other_version(folder):
    out, values = folder
    values["three"] = 3.0
    told = CliRunner().invoke(outcomes.main, ["--record", "--out", str(out)])
    assert told.exit_code == 0 and len(short_outcomes.recorded(out)) == 3


@pytest.mark.parametrize(
    ("value", "changed"), [(2.0 + 1e-12, []), (2.0 + 1e-7, ["two"]), (None, ["two"])]
)
def test_a_difference_of_short_outcomes_is_found_beyond_the_tolerance(folder, value, changed):
    out, values = folder
    if value is None:
        del values["two"]
    else:
        values["two"] = value
    assert short_outcomes.changed(out) == changed


@pytest.mark.slow
def test_two_computations_are_alike():
    one = {what: call() for what, call in outcomes.computed() if not what.startswith("case")}
    two = {what: call() for what, call in outcomes.computed() if not what.startswith("case")}
    assert one == two and len(set(one.values())) > 0.9 * len(one)
