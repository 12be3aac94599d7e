"""Bounds in texts are rounded outward, never into the interval that they bound."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigdda.app.reports import html_blocks
from rigdda.app.reports.corridor_report import thousands
from rigdda.app.reports.report_contents import EXHIBITS
from rigdda.app.reports.tables import bounded, risk_table
from rigdda.app.reports.wording import at_most, euros, figure, percent, small, span, tenth
from rigdda.envs.cost import Risk
from rigdda.envs.intervals import Mean, estimate
from rigdda.rounding import between, chainage, rounded

FORMS = (".0f", ",.0f", ".1f", ".3f", ".2g", ".3g", ".4g", ".10g")
finite = st.floats(-1e12, 1e12, allow_nan=False).filter(lambda x: x == 0.0 or abs(x) > 1e-12)


def read(text: str) -> Decimal:
    return Decimal(text.replace(",", ""))


@given(finite, st.sampled_from(FORMS))
def test_a_bound_is_rounded_outward_by_less_than_a_digit(value: float, form: str) -> None:
    exact = Decimal(repr(value))
    low, high = (read(rounded(value, form, way)) for way in ("down", "up"))
    assert low <= exact <= high
    near = read(rounded(value, form))
    assert near in (low, high)


@given(st.floats(0.0, 1.0))
def test_percentages_are_bounds(share: float) -> None:
    for way, sign in (("down", -1), ("up", 1)):
        text = percent(share, way)
        assert text.endswith(" %")
        assert sign * (read(text[:-2]) - 100 * Decimal(repr(share))) >= 0
    assert at_most(share) == percent(share, "up")


@given(finite)
def test_every_form_of_a_column_is_a_bound(value: float) -> None:
    exact = Decimal(repr(value))
    for form in (euros, figure, small, tenth, html_blocks.plain):
        assert read(form(value, "down")) <= exact <= read(form(value, "up"))
    assert read(thousands(value, "down")) <= Decimal(repr(value / 1e3))


@given(finite, finite)
def test_intervals_of_texts_contain_those_of_numbers(one: float, two: float) -> None:
    low, high = sorted((one, two))
    for text in (span((low, high)), between(low, high, ".4g")):
        least, most = text.split(" to ")
        assert read(least) <= Decimal(repr(low)) and Decimal(repr(high)) <= read(most)


@pytest.mark.parametrize(
    "share, words",
    [
        (0.104, "11 %"), (0.2215, "23 %"), (0.07, "7 %"), (0.0701, "7.1 %"), (0.0991, "10 %"),
        (0.0, "0 %"), (1.0, "100 %"), (0.9999, "100 %"), (0.00123, "0.13 %"),
    ],
)  # fmt: skip
def test_upper_bounds_of_probabilities(share: float, words: str) -> None:
    assert at_most(share) == words
    column = html_blocks.bounded("reaches", "reach")
    row = {"reach": "0.01", "reach_bound": repr(share)}
    assert column.cell(row, "chances.csv").text == f"1 % (≤ {words})"


def test_the_terminal_and_the_report_round_alike() -> None:
    chance = estimate(20, 120)
    assert 0.22 < chance.bound < 0.24
    assert bounded(chance) == f"17 % (<= {at_most(chance.bound)})"
    mean = Mean(0.00161, 0.00152, 0.001701)
    risk = Risk(*[mean] * 5)
    (cell,) = (next(iter(c.cells)) for c in risk_table([("fence", risk)]).columns[-1:])
    assert cell == "0.0016 (<= 0.0018)"
    column = next(
        c for e in EXHIBITS if e.files == "risk.csv" for c in e.columns if c.head == "vehicles hit"
    )
    row = {"hit": "0.00161", "hit_low": "0.00152", "hit_high": "0.001701"}
    assert column.cell(row, "risk.csv").text == "0.0016 (0.0015 to 0.0018)"


def test_what_is_no_number_stays() -> None:
    assert rounded(math.inf, ".3g", "up") == "inf" and rounded(math.nan, ".3g", "down") == "nan"
    assert figure(math.nan, "up") == "?"


def test_chainages_of_a_grid_keep_two_decimals() -> None:
    texts = {
        30.4: "30.4",
        9999.25: "9999.25",
        2_600_030.1: "2600030.1",
        2_600_030.456: "2600030.46",
    }
    assert {value: chainage(value) for value in texts} == texts
    assert (chainage(2_600_030.0), chainage(-12_345.678)) == ("2600030", "-12345.68")
