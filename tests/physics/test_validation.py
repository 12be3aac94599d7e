"""Every case of the accuracy suite holds its bars."""

from __future__ import annotations

import math

import pytest

from rigdda.validation import CASES, Case, Check, Measured, evaluate, motion, single_block
from rigdda.validation.case import Convergence


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(
            case,
            id=case.name,
            marks=pytest.mark.slow if case.slow or case.name in ("silo", "collisions") else (),
        )
        for case in CASES
    ],
)
def test_case(case):
    missed = [str(result) for result in evaluate(case) if not result.passed]
    assert not missed, "\n".join(missed)


@pytest.mark.parametrize(
    ("kind", "computed", "exact", "error"),
    [
        ("relative", [2.0, 4.0], [2.0, 5.0], 0.2),
        ("absolute", [1.0, 3.0], 1.5, 1.5),
        ("bound", [-1.0, 0.3], 0.0, 0.3),
        ("relative", float("nan"), 1.0, float("inf")),
    ],
)
def test_worst_value_counts(kind, computed, exact, error):
    case = Case("one", (Check("x", "x", "m", 0.1, kind),), lambda lab: [Measured(computed, exact)])
    (result,) = evaluate(case)
    assert result.error == pytest.approx(error)
    assert not result.passed


def test_order_of_convergence():
    assert Convergence("", "", (4e-3, 1e-3, 2.5e-4, 6.25e-5)).order == pytest.approx(2.0)
    assert Convergence("", "", (1e-3, 5e-4, 1e-14, 0.0)).order == pytest.approx(1.0)
    assert Convergence("", "", (0.0,) * 4).order != Convergence("", "", (0.0,) * 4).order


def test_exact_time_of_the_rocking_block():
    """0.69834 s from half the critical tilt, computed elsewhere for half sides of 0.5 and 2 m."""
    time = single_block.time_to_turn(0.5 * single_block.DIAGONAL_ANGLE, single_block.DIAGONAL_ANGLE)
    assert time == pytest.approx(0.69834, abs=5e-6)


def test_small_tilts_agree_with_housner():
    """His linear solution, acosh(1/(1 - th0/al))/p, holds for slender blocks."""
    linear = math.acosh(2.0) / math.sqrt(single_block.PULL)
    assert single_block.time_to_turn(
        0.5 * single_block.DIAGONAL_ANGLE, single_block.DIAGONAL_ANGLE
    ) == pytest.approx(linear, rel=1e-2)


def test_growth_law_is_near_its_short_form():
    for angle in (1e-4, 1e-3, 1e-2):
        assert motion.growth(angle) == pytest.approx(math.expm1(2.0 * math.pi * angle), rel=1e-3)


def test_newmark_pulse():
    assert single_block.newmark(0.5, 0.2, 0.3) == pytest.approx(0.3311, abs=5e-5)
