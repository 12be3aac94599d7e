"""A polygon rolls over flush fixed blocks, and over terrain, as the rimless wheel of McGeer."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import ngon, polygon, rock
from physics.steps import STEPS, each
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.validation.single_block import wheel

SLOPE, RATE, TIME = math.radians(10.0), 2.0, 4.0
"""Slope [rad], first rate of rotation [rad/s] and time [s]."""


def rolled(sides: int, dt: float, width: float | None = None) -> float:
    """Return how far [m] a polygon of radius 1 m rolls over blocks of a width [m], or terrain."""
    half = math.pi / sides
    centre = np.array([0.0, math.cos(half)])
    arm = centre - (math.sin(half), 0.0)  # from the lower corner, about which it starts to turn
    corners = polygon(ngon(sides, 1.0, centre, half - math.pi / 2.0), angle=-SLOPE)
    (velocity,) = polygon([(RATE * arm[1], -RATE * arm[0])], angle=-SLOPE)
    blocks = [Block(corners, velocity=(*velocity, -RATE))]
    terrain = None
    if width is None:
        terrain = Terrain(polygon([(-5.0, 0.0), (60.0, 0.0)], angle=-SLOPE))
    else:
        lefts = np.arange(-2.0, 13.0, width)
        plan = [[(x, -1.0), (x + width, -1.0), (x + width, 0.0), (x, 0.0)] for x in lefts]
        blocks += [Block(polygon(one, angle=-SLOPE), fixed=True) for one in plan]
    sim = Simulation(Scene(terrain, tuple(blocks), rock(80.0)), Settings(dt=dt, sleeping=False))
    start = sim.poses[0, :2]
    sim.step(round(TIME / dt))
    return float(np.hypot(*(sim.poses[0, :2] - start)))


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("sides", [6, 9, 12])
def test_a_polygon_rolls_over_fixed_blocks_as_mcgeer_says(sides, dt):
    exact = wheel(sides, 1.0, SLOPE, RATE, TIME)
    for width in (None, 0.63):
        assert rolled(sides, dt, width) == pytest.approx(exact, rel=5e-3 if dt <= 1e-2 else 1e-2)
