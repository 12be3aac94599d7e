"""A rock leans on a gravity wall, which slides or overturns at its static limit load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rigdda.barriers import GravityWall
from rigdda.geometry import polygon_properties
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY, Floats

RAMP = math.tan(math.radians(30.0))
"""Slope of the ramp on which the rock rests [-]."""

FACE = 0.5
"""Chainage of the face of the wall, beyond the foot of the ramp [m]."""

DURATION, MOVED, BISECTIONS = 2.0, 1e-3, 14
"""Duration of a push [s], displacement above which a wall counts as moved [m], and number of
bisections.

A load a thousandth above the limit moves each of the walls by at least 3 mm in that time.
"""


class Push(NamedTuple):
    """A wall on level ground, its friction angle [deg] and the height of the push on it [m]."""

    wall: GravityWall
    friction_deg: float
    height: float

    def limit(self) -> float:
        """Return the limit load [N]: the lesser of W tan phi (slides) and W b/(2 h) (overturns)."""
        weight = self.wall.density * GRAVITY * self.wall.thickness * self.wall.height
        sliding = math.tan(math.radians(self.friction_deg))
        return weight * min(sliding, 0.5 * self.wall.thickness / self.height)

    def scene(self, force: float) -> Scene:
        """Return the wall at the foot of a ramp of ice, pushed by a smooth rock with `force` [N].

        The rock touches the face of the wall with its nose. Without friction, it rests on the ramp
        under the horizontal force W tan(slope), which determines its density.
        """
        low, high = 0.6, 6.0
        corners = np.array(
            [
                *[(-high, high * RAMP), (-low, low * RAMP), (FACE, self.height)],
                *[(-low, low * RAMP + 3.0), (-high, high * RAMP + 3.0)],
            ]
        )
        density = force / (GRAVITY * RAMP * polygon_properties(corners)[0])
        terrain = Terrain([(-40.0, 40.0 * RAMP), (0.0, 0.0), (60.0, 0.0)], ["ice", "rock"])
        surfaces = {"rock": Surface(self.friction_deg), "ice": Surface(0.0)}
        block = Block(corners, density, surface="ice")
        return Scene(terrain, (block,), surfaces, barriers=(self.wall,))


def displacement(lab: Lab, scene: Scene) -> Floats:
    """Return the displacement and rotation of the first barrier, (3,) [m, m, rad]."""
    sim = lab.simulate(scene, sleeping=False)
    start = sim.barrier_poses
    sim.step(lab.steps(DURATION))
    moved: Floats = (sim.barrier_poses - start)[0]
    return moved


def limit_load(lab: Lab, push: Push) -> float:
    """Return the force above which the wall moves [N], bisected from 0.5 to 1.4 of the limit."""
    low, high = 0.5 * push.limit(), 1.4 * push.limit()
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if np.hypot(*displacement(lab, push.scene(middle))[:2]) < MOVED:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def limit_loads(lab: Lab, pushes: Sequence[Push]) -> Measured:
    """Compare limit loads with statics."""
    return Measured([limit_load(lab, push) for push in pushes], [push.limit() for push in pushes])


def turns(lab: Lab, pushes: Sequence[Push]) -> Floats:
    """Return the rotations of walls at 1.02 of their limit loads [rad], negative downhill."""
    return np.array([displacement(lab, push.scene(1.02 * push.limit()))[2] for push in pushes])


SLIDES = (
    Push(GravityWall(FACE, 2.0, 1.0), 20.0, 1.0),
    Push(GravityWall(FACE, 2.0, 2.0), 30.0, 1.2),
)
OVERTURNS = (
    Push(GravityWall(FACE, 2.0, 1.0), 60.0, 1.5),
    Push(GravityWall(FACE, 2.0, 1.0), 60.0, 1.9),
)

CASES = (
    Case(
        "wall-slides",
        (
            Check("limit load", "W tan phi", "N", 2e-2, "relative"),
            Check("turn at 1.02", "none: it slides", "rad", 1e-3, "bound"),
        ),
        lambda lab: (limit_loads(lab, SLIDES), Measured(np.abs(turns(lab, SLIDES)))),
    ),
    Case(
        "wall-overturns",
        (
            Check("limit load", "W b/(2 h)", "N", 2e-2, "relative"),
            Check("overturns at 1.02", "yes: W b/(2 h)", "-", 0.0, "absolute"),
        ),
        lambda lab: (limit_loads(lab, OVERTURNS), Measured(turns(lab, OVERTURNS) < -0.05, True)),
    ),
)
