"""Speed and energy of one body."""

from __future__ import annotations

import math

from rigdda.kernel import kernel
from rigdda.records import Bodies


@kernel
def top_speed(bodies: Bodies, i: int) -> float:
    """Return a bound on the speed of any point of body i [m/s]."""
    spin = abs(bodies.omega[i]) * bodies.radius[i]
    return math.hypot(bodies.vx[i], bodies.vy[i]) + spin


@kernel
def kinetic_energy(bodies: Bodies, i: int) -> float:
    """Return the energy of translation and rotation of body i [J]."""
    speed = bodies.vx[i] ** 2 + bodies.vy[i] ** 2
    return 0.5 * bodies.mass[i] * speed + 0.5 * bodies.inertia[i] * bodies.omega[i] ** 2
