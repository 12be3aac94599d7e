"""Supports as contacts that may pull: bolts act along their line, pins in both directions.

They enter the system of equations, the exchange of forces and the ledger like any closed contact,
and follow the same law on the end velocity (`contact.law`).
"""

from __future__ import annotations

import math

from rigdda.constants import BOLT, PIN, PIN_RECOVERY, STICK
from rigdda.contact.law import (
    effective_mass,
    impact_stiffness,
    point_velocity,
    set_velocities,
)
from rigdda.kernel import entry_kernel, kernel
from rigdda.records import Bodies, Body, Contact, Link, Links, Parameters


@kernel
def anchor(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the place now of a point given in body coordinates, of the ground if i < 0 [m]."""
    if i < 0:
        return x, y
    body = bodies[i]
    cos, sin = math.cos(body.theta), math.sin(body.theta)
    return body.x + cos * x - sin * y, body.y + sin * x + cos * y


@kernel
def arm(body: Body, x: float, y: float, time: float) -> tuple[float, float]:
    """Return the arm from the centroid after `time` of a point given in body coordinates [m]."""
    theta = body.theta + time * body.omega
    cos, sin = math.cos(theta), math.sin(theta)
    return cos * x - sin * y, sin * x + cos * y


@kernel
def tension(link: Link, length: float) -> float:
    """Return the tension of a bolt at a length [N]."""
    return link.prestress + link.stiffness * (length - link.length)


@entry_kernel
def bolt_energy(bodies: Bodies, links: Links) -> float:
    """Return the energy stored in the bolts now [J]."""
    total = 0.0
    for q in range(len(links)):
        link = links[q]
        if link.kind == BOLT:
            ax, ay = anchor(bodies, link.a, link.ax, link.ay)
            bx, by = anchor(bodies, link.b, link.bx, link.by)
            force = tension(link, math.hypot(ax - bx, ay - by))
            total += 0.5 * force * force / link.stiffness
    return total


@kernel
def add_link(bodies: Bodies, links: Links, q: int, c: Contact, p: Parameters) -> None:
    """Write support q as a contact."""
    link = links[q]
    a, b = link.a, link.b
    ax, ay = anchor(bodies, a, link.ax, link.ay)
    bx, by = anchor(bodies, b, link.bx, link.by)
    c.a, c.b, c.key, c.owner, c.kind = a, b, -1 - q, 1, link.kind
    c.other, c.gap, c.flips = 0, 0.0, 0
    c.x, c.y, c.share, c.state = ax, ay, 0.5, STICK
    c.memory_normal = c.memory_shear = c.start_normal = c.start_shear = 0.0
    c.friction = c.restitution = c.bond = c.cohesion = 0.0
    c.ra_x, c.ra_y = arm(bodies[a], link.ax, link.ay, 0.5 * p.dt)
    if b >= 0:
        c.rb_x, c.rb_y = arm(bodies[b], link.bx, link.by, 0.5 * p.dt)
    if link.kind == BOLT:
        length = math.hypot(ax - bx, ay - by)
        c.nx, c.ny = (ax - bx) / length, (ay - by) / length
        c.kappa = c.stiffness = link.stiffness
        c.bias = -tension(link, length) / link.stiffness
        c.tension = link.yielding
    else:
        c.nx, c.ny = 1.0, 0.0
        c.kappa = c.stiffness = impact_stiffness(effective_mass(bodies, c), p.dt)
        c.tension = math.inf
        c.bias = -PIN_RECOVERY * (ax - bx)
        c.memory_shear = -PIN_RECOVERY * (ay - by) * c.kappa
    set_velocities(bodies, c)
    if link.kind == PIN:
        c.un, c.us = point_velocity(bodies, a, ax, ay)


@kernel
def yield_bolts(bodies: Bodies, links: Links) -> None:
    """Lengthen the bolts whose tension is above yield now: perfectly plastic."""
    for q in range(len(links)):
        link = links[q]
        if link.kind != BOLT:
            continue
        ax, ay = anchor(bodies, link.a, link.ax, link.ay)
        bx, by = anchor(bodies, link.b, link.bx, link.by)
        excess = tension(link, math.hypot(ax - bx, ay - by)) - link.yielding
        link.length += max(excess, 0.0) / link.stiffness
