"""A joint breaks where a traction that is linear along it exceeds its strength.

In tension, pulled at its middle or beside it, by N = sigma_t L / (1 + 6 e / L), and in shear,
pushed at its level or above it, by S = c L + N tan phi.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from rigdda.model.loads import PointLoad
from rigdda.model.scene import Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, GRAVITY, box, masses

STEPS = (1e-3, 5e-3, 1e-2)
FRICTION = 30.0
"""Of the joint [deg]."""

STRENGTH = 1e5
"""Of the joint, in tension and, a tenth of it, in shear [Pa]."""

ECCENTRICITIES = (0.0, 0.1, 0.25, 0.5)
"""Of the pull, over the length of the joint of 1 m."""

ARMS = (0.0, 0.5, 1.0)
"""Heights of the push above the joint of a block 2 m high [m]."""

TIME = 0.3
"""Time after which what is to break has come apart [s]."""

HALVINGS = 6


def breaking(lab: Lab, scene: Scene, dt: float) -> bool:
    """Return whether the block of a scene moves."""
    sim = lab.simulate(scene, dt)
    start = sim.poses
    sim.step(round(TIME / dt))
    return bool(np.abs(sim.poses - start).max() > 1e-3)


def pulled(eccentricity: float, share: float) -> Scene:
    """Return a block on a joint that is pulled up with a share of what breaks it."""
    block = box(0.0, 0.5)
    weight = GRAVITY * float(masses(Scene(None, (block,)))[0][0])
    pull = share * STRENGTH / (1.0 + 6.0 * eccentricity)
    # the pull and the weight are one force beside the middle
    load = PointLoad(0, (pull * eccentricity / (pull + weight), 1.0), (0.0, pull + weight))
    surface = Surface(FRICTION, cohesion=100.0 * STRENGTH, tension=STRENGTH)
    return Scene(Terrain(FLAT), (block,), {"rock": surface}, loads=(load,))


def pushed(arm: float, share: float) -> Scene:
    """Return a block of 1 by 2 m on a joint that is pushed aside with a share of what breaks it."""
    block = box(0.0, 1.0, 1.0, 2.0)
    weight = GRAVITY * float(masses(Scene(None, (block,)))[0][0])
    push = share * (0.1 * STRENGTH + weight * math.tan(math.radians(FRICTION)))
    surface = Surface(FRICTION, cohesion=0.1 * STRENGTH, tension=10.0 * STRENGTH)
    load = PointLoad(0, (0.0, arm), (push, 0.0))
    return Scene(Terrain(FLAT), (block,), {"rock": surface}, loads=(load,))


def strength(lab: Lab, build: Callable[[float], Scene], dt: float) -> float:
    """Return the share of the closed form at which a joint breaks, by bisection."""
    low, high = 0.25, 4.0
    for _ in range(HALVINGS):
        share = math.sqrt(low * high)
        low, high = (low, share) if breaking(lab, build(share), dt) else (share, high)
    return math.sqrt(low * high)


def measure(
    lab: Lab, build: Callable[[float, float], Scene], places: tuple[float, ...]
) -> tuple[Measured]:
    """Break joints at all steps."""
    found = [strength(lab, partial(build, x), dt) for x in places for dt in STEPS]
    return (Measured(found, 1.0),)


TENSION = Check("pull, e 0-0.5 L", "sigma_t L / (1 + 6 e / L)", "-", 0.04, "relative")
SHEAR = Check("push, height 0-1 m", "c L + N tan phi", "-", 0.04, "relative")
CASES = (
    Case("joint-tension", (TENSION,), lambda lab: measure(lab, pulled, ECCENTRICITIES)),
    Case("joint-shear", (SHEAR,), lambda lab: measure(lab, pushed, ARMS)),
)
