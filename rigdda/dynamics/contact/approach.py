"""How the bodies of a contact come together: arms, velocities, the mass that resists."""

from __future__ import annotations

from rigdda.dynamics.constants import (
    AWAKE,
)
from rigdda.dynamics.records import Bodies, Contact
from rigdda.kernel import kernel


@kernel
def effective_mass(bodies: Bodies, c: Contact) -> float:
    """Return the mass [kg] that resists a normal impulse at a contact."""
    a, b = bodies[c.a], bodies[c.b]  # b is not read where it is the terrain
    arm = c.ra_x * c.ny - c.ra_y * c.nx
    inverse = 1.0 / a.mass + arm * arm / a.inertia
    if c.b >= 0 and b.status == AWAKE:
        arm = c.rb_x * c.ny - c.rb_y * c.nx
        inverse += 1.0 / b.mass + arm * arm / b.inertia
    return 1.0 / inverse


@kernel
def point_velocity(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the velocity [m/s] of the point (x, y) of body i; fixed and sleeping bodies rest."""
    body = bodies[i]
    if i < 0 or body.status != AWAKE:
        return 0.0, 0.0
    return body.vx - body.omega * (y - body.y), body.vy + body.omega * (x - body.x)


@kernel
def set_arms(bodies: Bodies, c: Contact, time: float) -> None:
    """Set the arms where the bodies will be after `time` [s]; so angular momentum is kept."""
    a, b = bodies[c.a], bodies[c.b]
    vx, vy = point_velocity(bodies, c.a if c.owner == 1 else c.b, c.x, c.y)
    x, y = c.x + time * vx, c.y + time * vy
    c.ra_x, c.ra_y = x - a.x - time * a.vx, y - a.y - time * a.vy
    if c.b >= 0:
        moving = 1.0 if b.status == AWAKE else 0.0
        c.rb_x, c.rb_y = x - b.x - time * b.vx * moving, y - b.y - time * b.vy * moving


@kernel
def set_velocities(bodies: Bodies, c: Contact, dt: float) -> None:
    """Set the relative velocities from where the bodies are at the start of the step.

    A point of a turning body does not go straight, and a face that turns comes nearer to what
    slides along it. With both counted the law gives the true velocity at the end, to second order:
    a block that rocks on a corner neither rises nor sinks. But w_0 is at most that of mid-step:
    greater, it would let the contact give energy.
    """
    a, b = bodies[c.a], bodies[c.b]
    vx, vy = a.vx - a.omega * c.ra_y, a.vy + a.omega * c.ra_x
    if c.b >= 0 and b.status == AWAKE:
        vx -= b.vx - b.omega * c.rb_y
        vy -= b.vy + b.omega * c.rb_x
    middle = c.nx * vx + c.ny * vy
    ax, ay = point_velocity(bodies, c.a, c.x, c.y)
    bx, by = point_velocity(bodies, c.b, c.x, c.y)
    opening = c.nx * (ax - bx) + c.ny * (ay - by)
    c.us = -c.ny * (ax - bx) + c.nx * (ay - by)
    i = c.a if c.owner == 0 else c.b
    face = bodies[i]
    if i >= 0 and face.status == AWAKE:
        opening -= face.omega * c.us * dt
    c.un = min(middle, opening)
