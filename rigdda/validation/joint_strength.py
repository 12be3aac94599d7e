"""A joint breaks where a linear traction along it exceeds its strength.

It is loaded in tension, pulled with an eccentricity e, which it resists up to N = sigma_t L / (1 +
6 e / L); and in shear, pushed at its level or above it, up to S = c L + N tan phi.
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
"""Friction angle of the joint [deg]."""

STRENGTH = 1e5
"""Tensile strength of the joint; its cohesion is a tenth of it [Pa]."""

ECCENTRICITIES = (0.0, 0.1, 0.25, 0.5)
"""Eccentricities of the pull over the joint length of 1 m [-]."""

ARMS = (0.0, 0.5, 1.0)
"""Heights of the push above the joint of a block 2 m high [m]."""

TIME = 0.3
"""Time after which a broken joint has visibly separated [s]."""

HALVINGS = 6


def breaking(lab: Lab, scene: Scene, dt: float) -> bool:
    """Return whether the block of a scene moves."""
    sim = lab.simulate(scene, dt)
    start = sim.poses
    sim.step(round(TIME / dt))
    return bool(np.abs(sim.poses - start).max() > 1e-3)


def pulled(eccentricity: float, share: float) -> Scene:
    """Return a block on a joint, pulled upwards with a fraction of the breaking force."""
    block = box(0.0, 0.5)
    weight = GRAVITY * float(masses(Scene(None, (block,)))[0][0])
    pull = share * STRENGTH / (1.0 + 6.0 * eccentricity)
    # pull and compensation of the weight, combined into one eccentric force
    load = PointLoad(0, (pull * eccentricity / (pull + weight), 1.0), (0.0, pull + weight))
    surface = Surface(FRICTION, cohesion=100.0 * STRENGTH, tension=STRENGTH)
    return Scene(Terrain(FLAT), (block,), {"rock": surface}, loads=(load,))


def pushed(arm: float, share: float) -> Scene:
    """Return a block of 1 by 2 m on a joint, pushed by a fraction of the breaking force."""
    block = box(0.0, 1.0, 1.0, 2.0)
    weight = GRAVITY * float(masses(Scene(None, (block,)))[0][0])
    push = share * (0.1 * STRENGTH + weight * math.tan(math.radians(FRICTION)))
    surface = Surface(FRICTION, cohesion=0.1 * STRENGTH, tension=10.0 * STRENGTH)
    load = PointLoad(0, (0.0, arm), (push, 0.0))
    return Scene(Terrain(FLAT), (block,), {"rock": surface}, loads=(load,))


def strength(lab: Lab, build: Callable[[float], Scene], dt: float) -> float:
    """Return the breaking force of a joint over the closed form, by bisection."""
    low, high = 0.25, 4.0
    for _ in range(HALVINGS):
        share = math.sqrt(low * high)
        low, high = (low, share) if breaking(lab, build(share), dt) else (share, high)
    return math.sqrt(low * high)


def measure(
    lab: Lab, build: Callable[[float, float], Scene], places: tuple[float, ...]
) -> tuple[Measured]:
    """Break joints with all steps."""
    found = [strength(lab, partial(build, x), dt) for x in places for dt in STEPS]
    return (Measured(found, 1.0),)


TENSION = Check("pull, e 0-0.5 L", "sigma_t L / (1 + 6 e / L)", "-", 0.04, "relative")
SHEAR = Check("push, height 0-1 m", "c L + N tan phi", "-", 0.04, "relative")
CASES = (
    Case("joint-tension", (TENSION,), lambda lab: measure(lab, pulled, ECCENTRICITIES)),
    Case("joint-shear", (SHEAR,), lambda lab: measure(lab, pushed, ARMS)),
)
