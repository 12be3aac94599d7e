"""A spinning block keeps its area; without post-correction it expands as predicted."""

from __future__ import annotations

import math

import numpy as np

from rigdda.geometry import polygon_properties
from rigdda.model.scene import Block, Scene
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import ngon, rock

TURNS = 1000
RATE = 2.0 * math.pi * 20.0
"""Rate of rotation [rad/s]."""

ROTATIONS = (1e-3, 1e-2, 5e-2)
"""Rotations per step of the linear displacement function [rad]."""


def spinning(rate: float) -> Scene:
    """Return a heptagon that spins at `rate` [rad/s] in free space."""
    return Scene(None, (Block(ngon(7), velocity=(0.0, 0.0, rate)),), rock(), gravity=0.0)


def measure_spin(lab: Lab) -> tuple[Measured, Measured]:
    """Rotate a block many times."""
    sim = lab.simulate(spinning(RATE))
    before = polygon_properties(sim.vertices(0))[0]
    steps = lab.steps(TURNS * 2.0 * math.pi / RATE)
    sim.step(steps)
    area = polygon_properties(sim.vertices(0))[0]
    return Measured(area, before), Measured(sim.poses[0, 2], RATE * steps * lab.dt)


def growth(rotation: float) -> float:
    """Return the growth of area per turn [-] by the linear displacement function.

    Each step of dr [rad] maps x to x + dr k x, which multiplies areas by 1 + dr^2 and rotates by
    atan dr: (1 + dr^2)^(2 pi/atan dr) - 1, about 2 pi dr.
    """
    return math.exp(2.0 * math.pi * math.log1p(rotation**2) / math.atan(rotation)) - 1.0


def measure_growth(lab: Lab) -> tuple[Measured]:
    """Rotate a block once without post-correction, with several rotations per step."""
    found = []
    for rotation in ROTATIONS:
        sim = lab.simulate(spinning(rotation / lab.dt), post_correction=False)
        before = polygon_properties(sim.vertices(0))[0]
        sim.step(round(2.0 * math.pi / math.atan(rotation)))
        found.append(polygon_properties(sim.vertices(0))[0] / before - 1.0)
    return (Measured(found, np.array([growth(rotation) for rotation in ROTATIONS])),)


CASES = (
    Case(
        "spin-1000",
        (
            Check("area", "that at the start", "m2", 1e-12, "relative"),
            Check("angle", "w t", "rad", 1e-9, "relative"),
        ),
        measure_spin,
    ),
    Case(
        "spin-linear",
        (Check("growth in a turn", "(1 + dr^2)^(2 pi/atan dr) - 1", "-", 5e-2, "relative"),),
        measure_growth,
    ),
)
