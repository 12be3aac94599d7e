"""The acceptance table of policies: paired differences over sites."""

from __future__ import annotations

import pytest

from experiments import policy_table


def test_differences_are_paired_over_the_sites() -> None:
    z = {"policy": (20.0, 90.0), "rule": (30.0, 100.0), "constant": (20.0, 90.0)}
    rows = [
        {"method": method, "z": value, "z_nothing": 100.0}
        for method, values in z.items()
        for value in values
    ]
    found = policy_table.differences(rows, ("rule", "constant"))
    assert found["rule"] == pytest.approx((0.1, 0.0), abs=1e-12)
    assert found["constant"] == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_forecast_that_is_too_low_is_too_good() -> None:
    row = {"method": policy_table.LEAST, "z": 30.0, "z_forecast": 20.0, "z_nothing": 100.0}
    assert policy_table.optimism([row, row | {"method": "policy"}]) == pytest.approx([0.1])
