"""Flight without contacts: free fall, and fall with mass-proportional damping."""

from __future__ import annotations

import math

from rigdda.model.scene import Scene
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY, box, rock

DURATION = 3.0
"""Duration of the falls [s]."""


def fall(damping: float, time: float) -> tuple[float, float]:
    """Return distance [m] and speed [m/s] after `time` [s] from rest: v' = g - a v.

    v = g/a (1 - exp(-a t)), s = g/a (t - (1 - exp(-a t))/a); without damping g t and g t^2/2.
    """
    if damping == 0.0:
        return 0.5 * GRAVITY * time * time, GRAVITY * time
    lost = (1.0 - math.exp(-damping * time)) / damping
    return GRAVITY / damping * (time - lost), GRAVITY * lost


def measure(lab: Lab, damping: float) -> tuple[Measured, Measured]:
    """Simulate the fall of a block."""
    sim = lab.simulate(Scene(None, (box(),), rock(), damping=damping))
    sim.step(lab.steps(DURATION))
    way, speed = fall(damping, DURATION)
    return Measured(-sim.poses[0, 1], way), Measured(-sim.velocities[0, 1], speed)


def checks(equations: tuple[str, str], bar: float) -> tuple[Check, Check]:
    """Return the checks of a fall."""
    return (
        Check("way", equations[0], "m", bar, "relative"),
        Check("speed", equations[1], "m/s", bar, "relative"),
    )


CASES = (
    Case("free-fall", checks(("g t^2/2", "g t"), 1e-12), lambda lab: measure(lab, 0.0)),
    Case(
        "damped-fall",
        checks(("g/a (t - (1 - exp(-a t))/a)", "g/a (1 - exp(-a t))"), 1e-5),
        lambda lab: measure(lab, 0.6),
        smooth=True,
    ),
)
