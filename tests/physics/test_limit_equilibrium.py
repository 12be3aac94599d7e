"""The recursion of Goodman and Bray (1976) against their table, and gravity structures."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from rigdda import BadInput
from rigdda.limit_equilibrium import (
    Impact,
    columns,
    equivalent_load,
    rock_thrust,
    stability,
    toppling,
)

HEIGHTS = columns(crest=10, above=6, rise=5.0, fall=5.0, step=1.0)
SLOPE = {"width": 10.0, "step": 1.0, "dip_deg": 30.0, "unit_weight": 25e3}

TABLE = """
16,4,0.0,866.0,500.0,stable
15,10,0.0,2165.1,1250.0,stable
14,16,0.0,3464.1,2000.0,stable
13,22,292.5,4533.4,2457.5,toppling
12,28,825.7,5643.3,2966.8,toppling
11,34,1556.0,6787.6,3519.7,toppling
10,40,2826.7,7662.1,3729.2,toppling
9,36,3922.1,6933.8,3404.6,toppling
8,32,4594.8,6399.8,3327.4,toppling
7,28,4837.0,5871.9,3257.8,toppling
6,24,4637.5,5352.9,3199.5,toppling
5,20,3978.0,4848.1,3159.4,toppling
4,16,2825.5,4369.5,3152.6,toppling
3,12,1413.3,3707.3,2912.1,sliding
2,8,471.9,2471.6,1941.4,sliding
1,4,1.2,1235.8,970.7,sliding
"""
"""Block, height [m], force to the next lower one, base normal and shear force [kN], mode, for a
friction angle of 38.15 deg (Goodman and Bray 1976)."""


def limit(friction_deg):
    return toppling(HEIGHTS, friction_deg=friction_deg, **SLOPE)


def test_published_table():
    rows = list(csv.reader(TABLE.split()))[::-1]
    number = np.array([[float(x) for x in row[1:5]] for row in rows])
    found = limit(38.15)
    np.testing.assert_allclose(HEIGHTS, number[:, 0])
    for mine, theirs in zip(found[:3], number.T[1:], strict=True):
        np.testing.assert_allclose(1e-3 * mine, theirs, rtol=0.0, atol=0.06)
    assert list(found.mode) == [row[5] for row in rows]


def test_limiting_friction():
    needed = brentq(lambda phi: limit(phi).force[0] - 1.0, 37.0, 38.3)
    assert needed == pytest.approx(38.151, abs=1e-3)


def test_bolt():
    phi = math.degrees(math.atan(0.65))
    state = limit(phi)
    assert state.mode[:4] == ("sliding",) * 4
    assert state.mode[4:13] == ("toppling",) * 9
    # the tension of a horizontal bolt in the toe block, at alpha to the base (their equation)
    tan, dip = math.tan(math.radians(phi)), math.radians(30.0)
    tension = state.force[0] * (1.0 - tan * tan) / (math.cos(dip) + tan * math.sin(dip))
    assert tension == pytest.approx(2013e3, rel=1e-3)


@pytest.mark.parametrize("heights", [[], [0.5, 4.0], [[1.0, 2.0]], [math.nan]])
def test_unsound_heights(heights):
    with pytest.raises(BadInput, match="heights"):
        toppling(heights, friction_deg=38.0, **SLOPE)


def test_a_wall_on_the_verge_of_moving_has_a_factor_of_one() -> None:
    weight, width, friction = 100e3, 2.0, 0.5
    slides = stability(weight, width, friction, 1e6, friction * weight, 0.1)
    assert slides.sliding == pytest.approx(1.0)
    turns = stability(weight, width, friction, 1e6, 50e3, 2.0)  # 100 kNm against 100 kNm
    assert turns.overturning == pytest.approx(1.0)
    assert turns.bearing == 0.0 and turns.pressure == math.inf


def test_the_pressure_grows_with_the_eccentricity() -> None:
    centred = stability(100e3, 2.0, 0.5, 1e5, 0.0, 1.0)
    assert centred.pressure == pytest.approx(50e3) and centred.bearing == pytest.approx(2.0)
    assert centred.sliding == centred.overturning == math.inf
    pushed = stability(100e3, 2.0, 0.5, 1e5, 50e3, 1.0)  # e = 0.5 m, 1 m remains pressed
    assert pushed.pressure == pytest.approx(100e3) and pushed.bearing == pytest.approx(1.0)


@given(
    mass=st.floats(10.0, 1e5),
    speed=st.floats(0.1, 50.0),
    wall=st.floats(1e3, 1e6),
    way=st.floats(0.01, 1.0),
    restitution=st.floats(0.0, 1.0),
)
def test_the_equivalent_load_takes_the_energy_of_the_struck_wall(
    mass: float, speed: float, wall: float, way: float, restitution: float
) -> None:
    load = equivalent_load(Impact(mass, speed, 1.0, restitution), wall, way)
    moves = (1.0 + restitution) * mass * speed / (mass + wall)
    rebound = moves - restitution * speed
    assert mass * speed == pytest.approx(mass * rebound + wall * moves)  # momentum
    assert load * way == pytest.approx(0.5 * wall * moves**2)
    assert load * way <= 0.5 * mass * speed**2 * (1.0 + 1e-9)  # no energy from nothing


def test_rock_without_friction_presses_like_a_fluid() -> None:
    assert rock_thrust(2.0, 18e3, 0.0) == pytest.approx(0.5 * 18e3 * 4.0)
    assert rock_thrust(2.0, 18e3, 30.0) == pytest.approx(0.5 * 18e3 * 4.0 / 3.0)
