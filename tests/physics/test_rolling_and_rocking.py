"""Blocks that roll from corner to corner, or rock, lose what an impact takes and no more.

What bears a block until its next corner strikes must do so up to that moment, wherever in the step
it is: else the block falls freely for a part of each step with an impact.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from physics.helpers import FLAT, GRAVITY, polygon, rock
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.validation.case import Lab
from rigdda.validation.single_block import roll, wheel


def steady_roll(sides: int, share: float) -> tuple[float, float]:
    """Return slope [rad] and first rate [rad/s] at which a wheel of radius 1 m rolls steadily.

    `share` is the square of its rate before an impact over that at which it would lift off.
    """
    half = math.pi / sides
    k2 = (1.0 + 2.0 * math.cos(half) ** 2) / 6.0
    kept = (k2 + math.cos(2.0 * half)) / (k2 + 1.0)

    def squared(slope: float) -> float:
        gained = 4.0 * GRAVITY * math.sin(half) * math.sin(slope) / (k2 + 1.0)
        return gained / (1.0 - kept**2)

    def surplus(slope: float) -> float:
        return squared(slope) - share * GRAVITY * math.cos(half + slope)

    slope = brentq(surplus, 1e-4, 1.2)
    return slope, kept * math.sqrt(squared(slope))


@pytest.mark.parametrize("dt", [2e-3, 5e-3, 1e-2])
@pytest.mark.parametrize(
    ("sides", "share"), [(5, 0.85), (6, 0.85), (8, 0.85), (12, 0.6), (16, 0.3), (20, 0.3)]
)
def test_a_wheel_rolls_as_fast_as_mcgeer_says(sides, share, dt):
    wanted = (sides, 1.0, *steady_roll(sides, share), 3.0)
    assert roll(Lab(dt), *wanted) == pytest.approx(wheel(*wanted), rel=5e-3)


def faces_passed(sides: int, rate: float) -> tuple[int, float]:
    """Return how many faces a wheel of radius 1 m passes on level ground, and its least margin.

    It passes a corner if w^2 (k^2 + r^2)/2 exceeds g r (1 - cos(pi/n)), and every impact reduces w
    as McGeer (1990) says. The margin is that of w^2, as a share of the least w^2.
    """
    half = math.pi / sides
    k2 = (1.0 + 2.0 * math.cos(half) ** 2) / 6.0
    kept = (k2 + math.cos(2.0 * half)) / (k2 + 1.0)
    least = 2.0 * GRAVITY * (1.0 - math.cos(half)) / (k2 + 1.0)
    passed, squared, margin = 0, rate**2, math.inf
    while True:
        margin = min(margin, abs(squared / least - 1.0))
        if squared < least:
            return passed, margin
        passed, squared = passed + 1, kept**2 * squared


@pytest.mark.parametrize("dt", [2e-3, 5e-3, 1e-2])
def test_a_wheel_stops_on_the_face_that_its_energy_allows(dt):
    """In 60 rolls on level ground; rates within 2 % of a limit are left out."""
    rng, rolls = np.random.default_rng(3), 0
    while rolls < 60:
        sides = int(rng.integers(5, 13))
        half = math.pi / sides
        slowest = math.sqrt(GRAVITY * (1.0 - math.cos(half)))
        rate = rng.uniform(slowest, math.sqrt(GRAVITY * math.cos(half)))
        passed, margin = faces_passed(sides, rate)
        if margin > 0.02:
            rolls += 1
            way = roll(Lab(dt), sides, 1.0, 0.0, rate, 30.0)
            assert way / (2.0 * math.sin(half)) == pytest.approx(passed, abs=0.02), (sides, rate)


def tilts_of_rocking(height: float, dt: float, impacts: int) -> list[float]:
    """Return the greatest tilts [rad] of a block 1 m wide that rocks, one more than its impacts."""
    first = 0.5 * math.atan2(1.0, height)
    corners = polygon([(0.0, 0.0), (1.0, 0.0), (1.0, height), (0.0, height)], angle=first)
    scene = Scene(Terrain(FLAT), (Block(corners),), rock(60.0))
    sim = Simulation(scene, Settings(dt=dt, sleeping=False))
    tilts, tilt, side = [first], first, -1.0
    while len(tilts) <= impacts and sim.time < 60.0:
        before = tilt
        sim.step()
        tilt = first + float(sim.poses[0, 2])
        if side * tilt > 0.0 and side * sim.velocities[0, 2] < 0.0:
            tilts.append(max(abs(tilt), abs(before)))
            side = -side
    return tilts


@pytest.mark.parametrize("height", [2.0, 3.0, 4.0, 5.0, 6.0, 8.0])
@pytest.mark.parametrize("dt", [2e-3, 5e-3, 1e-2])
def test_a_block_that_rocks_keeps_what_housner_says(height, dt):
    """In each of six impacts, within 2 %."""
    half = math.atan2(1.0, height)
    rates = [
        math.sqrt(math.cos(half - tilt) - math.cos(half))
        for tilt in tilts_of_rocking(height, dt, 6)
    ]
    assert len(rates) == 7
    for before, after in pairwise(rates):
        assert after / before == pytest.approx(1.0 - 1.5 * math.sin(half) ** 2, rel=2e-2)
