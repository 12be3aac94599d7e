"""How certain one slope is: the parts of the variance are told apart, and chance has most of it."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from experiments import one_slope

RECORDED = Path(__file__).parents[2] / "experiments" / "results" / "one_slope.csv"


def test_the_variance_between_surveys_is_told_from_that_between_copies():
    rng = np.random.default_rng(0)
    found = rng.normal(0.0, 0.3, (400, 1)) + rng.normal(0.0, 0.1, (400, 30))
    between, within = one_slope.variances(found)
    assert within == pytest.approx(0.01, rel=0.05) and between == pytest.approx(0.09, rel=0.2)
    alike = rng.normal(0.0, 0.1, (400, 30))
    assert one_slope.variances(alike)[0] < 3e-4


def test_copies_of_a_survey_come_to_other_ends():
    found = one_slope.shares(1e-4, 2, 4)
    assert found.shape == (2, 4) and all(len(set(copies)) > 1 for copies in found)
    assert np.array_equal(one_slope.shares(1e-4, 2, 4), found)


def test_the_record_says_that_most_is_chance():
    rows = list(csv.DictReader(RECORDED.read_text().splitlines()))
    chance = {float(row["disturbance_m_s"]): float(row["chance"]) for row in rows}
    assert set(chance) == set(one_slope.DISTURBANCES)
    assert chance[one_slope.JUDGED] > 0.5
