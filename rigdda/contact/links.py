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
from rigdda.records import Bodies, Contacts, Links, Parameters


@kernel
def anchor(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the place now of a point given in body coordinates, of the ground if i < 0 [m]."""
    if i < 0:
        return x, y
    cos, sin = math.cos(bodies[i].theta), math.sin(bodies[i].theta)
    return bodies[i].x + cos * x - sin * y, bodies[i].y + sin * x + cos * y


@kernel
def arm(bodies: Bodies, i: int, x: float, y: float, time: float) -> tuple[float, float]:
    """Return the arm from the centroid after `time` of a point given in body coordinates [m]."""
    theta = bodies[i].theta + time * bodies[i].omega
    cos, sin = math.cos(theta), math.sin(theta)
    return cos * x - sin * y, sin * x + cos * y


@kernel
def tension(links: Links, q: int, length: float) -> float:
    """Return the tension of bolt q at a length [N]."""
    return links[q].prestress + links[q].stiffness * (length - links[q].length)


@entry_kernel
def bolt_energy(bodies: Bodies, links: Links) -> float:
    """Return the energy stored in the bolts now [J]."""
    total = 0.0
    for q in range(len(links)):
        if links[q].kind == BOLT:
            ax, ay = anchor(bodies, links[q].a, links[q].ax, links[q].ay)
            bx, by = anchor(bodies, links[q].b, links[q].bx, links[q].by)
            force = tension(links, q, math.hypot(ax - bx, ay - by))
            total += 0.5 * force * force / links[q].stiffness
    return total


@kernel
def add_link(bodies: Bodies, links: Links, q: int, c: Contacts, k: int, p: Parameters) -> None:
    """Write support q as contact k."""
    a, b = links[q].a, links[q].b
    ax, ay = anchor(bodies, a, links[q].ax, links[q].ay)
    bx, by = anchor(bodies, b, links[q].bx, links[q].by)
    c[k].a, c[k].b, c[k].key, c[k].owner, c[k].kind = a, b, -1 - q, 1, links[q].kind
    c[k].other, c[k].gap, c[k].flips = 0, 0.0, 0
    c[k].x, c[k].y, c[k].share, c[k].state = ax, ay, 0.5, STICK
    c[k].memory_normal = c[k].memory_shear = c[k].start_normal = c[k].start_shear = 0.0
    c[k].friction = c[k].restitution = c[k].passing = c[k].bond = c[k].cohesion = 0.0
    c[k].ra_x, c[k].ra_y = arm(bodies, a, links[q].ax, links[q].ay, 0.5 * p.dt)
    if b >= 0:
        c[k].rb_x, c[k].rb_y = arm(bodies, b, links[q].bx, links[q].by, 0.5 * p.dt)
    if links[q].kind == BOLT:
        length = math.hypot(ax - bx, ay - by)
        c[k].nx, c[k].ny = (ax - bx) / length, (ay - by) / length
        c[k].kappa = c[k].stiffness = links[q].stiffness
        c[k].bias = -tension(links, q, length) / links[q].stiffness
        c[k].tension = links[q].yielding
    else:
        c[k].nx, c[k].ny = 1.0, 0.0
        c[k].kappa = c[k].stiffness = impact_stiffness(effective_mass(bodies, c, k), p.dt)
        c[k].tension = math.inf
        c[k].bias = -PIN_RECOVERY * (ax - bx)
        c[k].memory_shear = -PIN_RECOVERY * (ay - by) * c[k].kappa
    set_velocities(bodies, c, k)
    if links[q].kind == PIN:
        c[k].un, c[k].us = point_velocity(bodies, a, ax, ay)


@kernel
def yield_bolts(bodies: Bodies, links: Links) -> None:
    """Lengthen the bolts whose tension is above yield now: perfectly plastic."""
    for q in range(len(links)):
        if links[q].kind != BOLT:
            continue
        ax, ay = anchor(bodies, links[q].a, links[q].ax, links[q].ay)
        bx, by = anchor(bodies, links[q].b, links[q].bx, links[q].by)
        excess = tension(links, q, math.hypot(ax - bx, ay - by)) - links[q].yielding
        links[q].length += max(excess, 0.0) / links[q].stiffness
