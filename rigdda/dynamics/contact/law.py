r"""Contact law over one step, for islands that are solved as a whole.

Every closed contact is a penalty spring on the *end* velocity of the step,

.. math:: N = \kappa\,(b - \Delta t\,w_1), \qquad w_1 = 2 d_n / \Delta t - w_0,

where d_n is the relative normal displacement of the step and w_0, w_1 are the relative normal
velocities at its start and end (positive separates). A stiff spring on d_n itself (plain DDA) turns
w_0 into -w_0, which makes resting contacts chatter. A spring on the end velocity dissipates energy
at any stiffness. The kinds of contact differ in the bias b:

=======  ====================================================================================
at rest  b = N_0 / kappa, with N_0 the force of the last step and kappa = k_n. An open gap has
         b = -g: a contact that would close within the step is slowed to close one step later.
new      As at rest with N_0 = 0, but stiff in its first step: it finds the force that stops the
         bodies, and continues with it as if they had always been in contact.
plain    b = -2 g with w_0 taken as 0: a penalty spring on the gap, the paper's contact.
=======  ====================================================================================

The shear spring acts in the same way on the shear velocity, starting from the shear force of the
last step. Its force is limited by Coulomb friction in a return mapping. A rolling spring acts on R
times the relative rate of rotation. Its force is limited by rolling resistance, and its moment is R
times the force. Islands in motion, and at first also islands at rest, are relaxed instead, with
rigid contacts (`rigdda.dynamics.relaxation`). Restitution acts only there (`rebound.rebound`).

Coulomb friction is applied in `open_close.next_friction` to islands that are solved as a whole, and
in `sweeps.drag_row` within the substeps of relaxation.
"""

from __future__ import annotations

import math

from rigdda.dynamics.constants import (
    AWAKE,
    FIXED,
    NEW,
    NEW_SHARE,
    OPEN,
    PLAIN,
    PLAIN_CONTACT,
    REST,
    RIGID,
    STICK,
)
from rigdda.dynamics.records import Bodies, Contact, Interfaces, Parameters
from rigdda.kernel import inlined, kernel


@kernel
def effective_mass(bodies: Bodies, c: Contact) -> float:
    """Return the effective mass [kg] for a normal impulse at a contact."""
    a, b = bodies[c.a], bodies[c.b]  # b is not read if it is the terrain
    arm = c.ra_x * c.ny - c.ra_y * c.nx
    inverse = 1.0 / a.mass + arm * arm / a.inertia
    if c.b >= 0 and b.status == AWAKE:
        arm = c.rb_x * c.ny - c.rb_y * c.nx
        inverse += 1.0 / b.mass + arm * arm / b.inertia
    return 1.0 / inverse


@kernel
def point_velocity(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the velocity [m/s] of point (x, y) of body i; 0 for fixed and sleeping bodies."""
    body = bodies[i]
    if i < 0 or body.status != AWAKE:
        return 0.0, 0.0
    return body.vx - body.omega * (y - body.y), body.vy + body.omega * (x - body.x)


@kernel
def rolling_radius(bodies: Bodies, c: Contact) -> float:
    """Return the radius R of the pair of bodies of a contact for rolling resistance [m].

    For a block on the ground, it is that of a disc with the radius of gyration of the block, R_a =
    sqrt(2 I / m). Between two blocks, 1 / R = 1 / R_a + 1 / R_b, as between two discs.
    """
    a, b = bodies[c.a], bodies[c.b]  # b is not read if it is the terrain
    radius = math.sqrt(2.0 * a.inertia / a.mass)
    if c.b >= 0 and b.status != FIXED:
        radius = 1.0 / (1.0 / radius + 1.0 / math.sqrt(2.0 * b.inertia / b.mass))
    return radius


@kernel
def set_arms(bodies: Bodies, c: Contact, time: float) -> None:
    """Set the lever arms at the positions after `time` [s], which conserves angular momentum."""
    a, b = bodies[c.a], bodies[c.b]
    vx, vy = point_velocity(bodies, c.a if c.owner == 1 else c.b, c.x, c.y)
    x, y = c.x + time * vx, c.y + time * vy
    c.ra_x, c.ra_y = x - a.x - time * a.vx, y - a.y - time * a.vy
    if c.b >= 0:
        moving = 1.0 if b.status == AWAKE else 0.0
        c.rb_x, c.rb_y = x - b.x - time * b.vx * moving, y - b.y - time * b.vy * moving


@kernel
def set_velocities(bodies: Bodies, c: Contact, dt: float) -> None:
    """Set the relative velocities from the positions at the start of the step.

    A point of a rotating body moves along a curve, and a rotating face approaches a point that
    slides along it. With both effects, the contact law yields the true velocity at the end of the
    step to second order, so that a block that rocks on a corner neither rises nor sinks. However,
    w_0 must not exceed the velocity in mid-step, or the contact could add energy.
    """
    a, b = bodies[c.a], bodies[c.b]
    vx, vy = a.vx - a.omega * c.ra_y, a.vy + a.omega * c.ra_x
    if c.b >= 0 and b.status == AWAKE:
        vx -= b.vx - b.omega * c.rb_y
        vy -= b.vy + b.omega * c.rb_x
    c.ur = c.radius * (a.omega - (b.omega if c.b >= 0 and b.status == AWAKE else 0.0))
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


@kernel
def carried_weight(mass_a: float, mass_b: float, p: Parameters) -> float:
    """Return the weight [N] of the heavier free body, the least load assumed for a contact."""
    return max(mass_a, mass_b) * (p.gravity if p.gravity > 0.0 else 9.81)


@kernel
def rest_stiffness(weight: float, c: Contact, p: Parameters) -> float:
    """Return k_n [N/m], which gives the target penetration under the load of a contact.

    The load is at least `weight` [N]. `set_properties` never lets the stiffness decrease, because a
    stiffness that decreased with the load would amplify the sway of a stack.
    """
    return max(weight, c.accumulated_normal) / p.penetration


@kernel
def set_rest(c: Contact, p: Parameters) -> None:
    """Set up a contact at rest, a spring that continues with the force of the last step."""
    c.kind = REST
    c.kappa = c.stiffness
    if c.gap > p.penetration and c.bond == 0.0:
        c.accumulated_normal = 0.0
        c.bias = -c.gap
    else:
        c.bias = c.accumulated_normal / c.kappa


@kernel
def rigid_stiffness(mass: float, dt: float) -> float:
    """Return the stiffness [N/m] that brings an effective mass to its velocity within a step."""
    return RIGID * mass / (dt * dt)


@kernel
def set_new(bodies: Bodies, c: Contact, start: bool, p: Parameters) -> None:
    """Set up a contact that closes in this step, or may close."""
    c.kind = NEW
    stiffness = rigid_stiffness(effective_mass(bodies, c), p.dt)
    c.kappa = max(stiffness if start else NEW_SHARE * stiffness, c.stiffness)
    c.bias = -max(c.gap, 0.0)


@kernel
def set_plain(c: Contact, p: Parameters) -> None:
    """Set up the paper's contact, a penalty spring on the displacement of the step.

    N = k_n (-gap - d_n) and S = S_0 - k_n d_s: the law above with w_0 = 0 and the same k_n for all
    contacts. The law does not depend on the approach velocity, so rebound is determined by the step
    and the stiffness.
    """
    c.stiffness = p.block_weight / p.penetration
    c.kappa = 0.5 * c.stiffness
    c.bias = -2.0 * c.gap
    c.un = c.us = 0.0
    if c.gap <= 0.0 and c.state == OPEN:
        c.state = STICK


@inlined
def set_properties(bodies: Bodies, c: Contact, interfaces: Interfaces, p: Parameters) -> None:
    """Set the properties of a contact from its interface and its bodies."""
    a, b = bodies[c.a], bodies[c.b]
    mass_b = b.mass if c.b >= 0 and b.status == AWAKE else 0.0
    weight = carried_weight(a.mass, mass_b, p)
    c.stiffness = max(c.stiffness, rest_stiffness(weight, c, p))
    interface = interfaces[a.surface, c.other]
    c.friction, c.restitution = interface.friction, interface.restitution
    c.restitution_speed, c.rolling = interface.restitution_speed, interface.rolling
    c.cohesion = c.bond * interface.cohesion
    c.tension = c.bond * interface.tension
    if c.cohesion == 0.0 and c.tension == 0.0:
        c.bond = 0.0
    if c.bond > 0.0:
        c.rolling = 0.0  # the ends of an unbroken joint bear its moment
    if c.rolling == 0.0:  # the impulse may be that of a surface on which the contact was before
        c.accumulated_roll = 0.0
    c.radius = rolling_radius(bodies, c) if c.rolling > 0.0 else 0.0
    c.kind = PLAIN if c.restitution == PLAIN_CONTACT else REST


@inlined
def set_law(bodies: Bodies, c: Contact, start: bool, p: Parameters) -> None:
    """Set up the law of a contact from its geometry and accumulated forces.

    `start` is whether this is the very first step.
    """
    c.roll, c.turns, c.lag = c.accumulated_roll, 0, c.accumulated_shear
    set_arms(bodies, c, 0.5 * p.dt)
    set_velocities(bodies, c, p.dt)
    if c.lag == 0.0:
        c.lag = math.copysign(0.0, -c.us)  # the direction of friction once it slips
    if c.kind == PLAIN:
        set_plain(c, p)
    elif c.state != OPEN:
        set_rest(c, p)
    else:
        set_new(bodies, c, start, p)
        # touching contacts start closed, so that no block of a stack moves before the blocks below
        # it are supported, and hanging blocks are held by their joints
        if c.bond > 0.0 or (c.gap < p.margin and c.gap + c.un * p.dt < p.penetration):
            c.state = STICK
