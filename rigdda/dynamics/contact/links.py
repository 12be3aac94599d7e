"""Supports as contacts that can pull: bolts act along their line, pins in both directions.

Supports enter the system of equations, the exchange of forces and the ledger like closed contacts
and follow the same law (`contact.law`). A pin has b = 0. A bolt has w_0 = 0, kappa = k / 4 and b =
-T / kappa, so that N is minus its mean tension over the step, T + k d / 2. It acts along the mean
of its directions before and after the step, so that d is its change of length. Both together
conserve energy for any step length. The state of a support is decided in
`open_close.next_state_of_link`, and in relaxation by `substep.aim_row` and the limits in
`sweeps.press_row` and `sweeps.drag_row`.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.constants import BOLT, PIN, STICK
from rigdda.dynamics.contact.law import effective_mass, point_velocity, rigid_stiffness
from rigdda.dynamics.post_correction import place_corners
from rigdda.dynamics.records import Bodies, Body, Contact, Link, Links, Parameters
from rigdda.kernel import entry_kernel, kernel


@kernel
def anchor(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the current position of a point in body coordinates, or of the ground if i < 0 [m]."""
    if i < 0:
        return x, y
    body = bodies[i]
    cos, sin = math.cos(body.theta), math.sin(body.theta)
    return body.x + cos * x - sin * y, body.y + sin * x + cos * y


@kernel
def arm(body: Body, x: float, y: float, dt: float) -> tuple[float, float]:
    """Return the lever arm of a point in body coordinates, averaged over a step [m].

    It is the mean of the arms before and after the step at the current rate of rotation. A point
    that is at rest before the step and whose displacement, computed with this arm, is zero is also
    at rest after the step. This is exact for a constant rate of rotation.
    """
    half = 0.5 * dt * body.omega
    theta, mean = body.theta + half, math.cos(half)
    cos, sin = mean * math.cos(theta), mean * math.sin(theta)
    return cos * x - sin * y, sin * x + cos * y


@kernel
def mean_arm(body: Body, x: float, y: float, turn: float) -> tuple[float, float]:
    """Return the arm at which a constant force does its work as the body rotates by `turn` [m].

    The point (x, y) in body coordinates moves on an arc relative to the centroid. Its chord is
    `turn` times this arm, turned by 90 degrees.
    """
    half = 0.5 * turn
    theta, mean = body.theta + half, math.sin(half) / half if half != 0.0 else 1.0
    cos, sin = mean * math.cos(theta), mean * math.sin(theta)
    return cos * x - sin * y, sin * x + cos * y


@kernel
def bend_bolt(bodies: Bodies, link: Link, c: Contact, d: NDArray, i: int, j: int) -> float:
    """Set arms and direction of a bolt for the displacements of its blocks, slots i and j.

    The direction is (r_0 + r_1) / (l_0 + l_1), with the vectors r and lengths l between the anchors
    before and after the step. Returns the change of the direction [-].
    """
    ax, ay = anchor(bodies, link.a, link.ax, link.ay)
    bx, by = anchor(bodies, link.b, link.bx, link.by)
    x, y = ax - bx, ay - by
    c.ra_x, c.ra_y = mean_arm(bodies[link.a], link.ax, link.ay, d[i, 2])
    dx, dy = d[i, 0] - d[i, 2] * c.ra_y, d[i, 1] + d[i, 2] * c.ra_x
    if link.b >= 0:
        turn = d[j, 2] if j >= 0 else 0.0
        c.rb_x, c.rb_y = mean_arm(bodies[link.b], link.bx, link.by, turn)
        if j >= 0:
            dx -= d[j, 0] - turn * c.rb_y
            dy -= d[j, 1] + turn * c.rb_x
    length = math.hypot(x, y) + math.hypot(x + dx, y + dy)
    nx, ny = (2.0 * x + dx) / length, (2.0 * y + dy) / length
    change = abs(nx - c.nx) + abs(ny - c.ny)
    c.nx, c.ny = nx, ny
    return change


@kernel
def tension(link: Link, length: float) -> float:
    """Return the tension of a bolt at a length [N]."""
    return link.prestress + link.stiffness * (length - link.length)


@entry_kernel
def pull_of_bolts(bodies: Bodies, links: Links, out: NDArray) -> None:
    """Write the current force of each bolt on its block a, (S, 2) [N], into `out`; 0 for a pin."""
    for q in range(len(links)):
        link = links[q]
        if link.kind == BOLT:
            ax, ay = anchor(bodies, link.a, link.ax, link.ay)
            bx, by = anchor(bodies, link.b, link.bx, link.by)
            length = math.hypot(ax - bx, ay - by)
            force = tension(link, length) / length
            out[q, 0], out[q, 1] = force * (bx - ax), force * (by - ay)


@kernel
def add_link(bodies: Bodies, links: Links, q: int, c: Contact, p: Parameters) -> None:
    """Write support q as a contact."""
    link = links[q]
    a, b = link.a, link.b
    ax, ay = anchor(bodies, a, link.ax, link.ay)
    bx, by = anchor(bodies, b, link.bx, link.by)
    c.a, c.b, c.key, c.owner, c.kind = a, b, -1 - q, 1, link.kind
    c.other, c.gap = 0, 0.0
    c.x, c.y, c.state = ax, ay, STICK
    c.accumulated_normal = c.accumulated_shear = c.accumulated_roll = 0.0
    c.friction = c.restitution = c.rolling = c.bond = c.cohesion = 0.0
    c.turns = 0
    c.ra_x, c.ra_y = arm(bodies[a], link.ax, link.ay, p.dt)
    if b >= 0:
        c.rb_x, c.rb_y = arm(bodies[b], link.bx, link.by, p.dt)
    if link.kind == BOLT:
        length = math.hypot(ax - bx, ay - by)
        c.nx, c.ny, c.gap = (ax - bx) / length, (ay - by) / length, length
        c.un = c.us = 0.0
        c.stiffness, c.kappa = link.stiffness, 0.25 * link.stiffness
        c.bias = -tension(link, length) / c.kappa
        c.tension = link.yielding
    else:
        c.nx, c.ny = 1.0, 0.0
        mass = effective_mass(bodies, c)
        c.kappa = c.stiffness = rigid_stiffness(mass, p.dt)
        c.tension = math.inf
        c.un, c.us = point_velocity(bodies, a, ax, ay)
        c.bias = 0.0  # zero velocity at the end of the step


@kernel
def mend_links(bodies: Bodies, outlines: Outlines, links: Links, p: Parameters) -> float:
    """Let overstressed bolts yield, perfectly plastically, and remove the drift of pins.

    A rotating block follows the arc about its pin only to second order; without post-correction it
    is not moved back. Returns the work done against gravity by moving blocks back [J].
    """
    work = 0.0
    for q in range(len(links)):
        link = links[q]
        ax, ay = anchor(bodies, link.a, link.ax, link.ay)
        bx, by = anchor(bodies, link.b, link.bx, link.by)
        if link.kind == BOLT:
            excess = tension(link, math.hypot(ax - bx, ay - by)) - link.yielding
            link.length += max(excess, 0.0) / link.stiffness
        elif link.kind == PIN and p.post_correction and (ax != bx or ay != by):
            body = bodies[link.a]
            body.x += bx - ax
            body.y += by - ay
            work -= body.mass * (p.gravity_x * (bx - ax) + p.gravity_y * (by - ay))
            place_corners(bodies, outlines, link.a)
    return work
