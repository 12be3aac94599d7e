"""Speed and kinetic energy of a body."""

from __future__ import annotations

import math

from rigdda.dynamics.constants import RETIRED
from rigdda.dynamics.records import Body, Parameters
from rigdda.kernel import kernel


@kernel
def top_speed(body: Body) -> float:
    """Return an upper bound on the speed of any point of a body [m/s]."""
    spin = abs(body.omega) * body.radius
    return math.sqrt(body.vx**2 + body.vy**2) + spin


@kernel
def impact_speed(p: Parameters) -> float:
    """Return the closing speed above which a contact undergoes an impact [m/s].

    It is the speed of a body that has fallen by the target penetration.
    """
    return math.sqrt(2.0 * p.gravity * p.penetration)


@kernel
def kinetic_energy(body: Body) -> float:
    """Return the translational and rotational energy of a body [J]."""
    speed = body.vx**2 + body.vy**2
    return 0.5 * body.mass * speed + 0.5 * body.inertia * body.omega**2


@kernel
def retire(body: Body) -> float:
    """Remove a body that has left the site from the simulation; return its kinetic energy [J]."""
    energy = kinetic_energy(body)
    body.status = RETIRED
    body.vx = body.vy = body.omega = 0.0
    return energy
