"""Scenes that break contact mechanics hold, or are refused; nothing is ever lost."""

from __future__ import annotations

import pytest

from experiments.hard_cases.case import FAILS, HOLDS, REFUSES, Case
from experiments.hard_cases.suite import CASES
from experiments.hard_cases.trial import trial
from rigdda import Settings

SLOW = {"hopper-1000", "stack-100"}


def marked(case: Case):
    """Return a case with its marks."""
    marks = [pytest.mark.slow] if case.name in SLOW else []
    return pytest.param(case, id=case.name, marks=marks)


@pytest.mark.parametrize("case", [marked(case) for case in CASES])
def test_at_the_default_step(case):
    result = trial(case, Settings().dt)
    assert result.verdict == (REFUSES if case.refused else HOLDS), result.note


@pytest.mark.parametrize("name", ["arch-below-limit", "pebbles-below-boulders", "stairs"])
def test_what_stands_stands_in_short_steps(name):
    case = next(case for case in CASES if case.name == name)
    result = trial(case, 5e-4)
    assert result.verdict == HOLDS, result.note


@pytest.mark.slow
@pytest.mark.parametrize("dt", [1e-3, 1e-2, 5e-2])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_no_step_loses_anything(case, dt):
    result = trial(case, dt)
    assert result.verdict != FAILS, result.note
