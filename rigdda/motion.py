"""Speed and energy of one body."""

from __future__ import annotations

import math

from rigdda.kernel import kernel
from rigdda.records import Bodies


@kernel
def top_speed(bodies: Bodies, i: int) -> float:
    """Return a bound on the speed of any point of body i [m/s]."""
    spin = abs(bodies[i].omega) * bodies[i].radius
    return math.sqrt(bodies[i].vx ** 2 + bodies[i].vy ** 2) + spin


@kernel
def kinetic_energy(bodies: Bodies, i: int) -> float:
    """Return the energy of translation and rotation of body i [J]."""
    speed = bodies[i].vx ** 2 + bodies[i].vy ** 2
    return 0.5 * bodies[i].mass * speed + 0.5 * bodies[i].inertia * bodies[i].omega ** 2
