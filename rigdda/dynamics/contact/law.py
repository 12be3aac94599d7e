r"""The law that a contact follows over one step.

Every closed contact is a penalty spring on the *end* velocity of the step,

.. math:: N = \kappa\,(b - \Delta t\,w_1), \qquad w_1 = 2 d_n / \Delta t - w_0,

with d_n the relative normal displacement of the step and w_0, w_1 the normal relative velocities
at its ends (positive separates). A spring on d_n itself (plain DDA) turns w_0 into -w_0 when it is
stiff, which makes resting contacts chatter; on the end velocity it loses energy at any stiffness.
What differs is the bias b:

=======  ====================================================================================
at rest  b = N_0 / kappa, the force carried over from the last step; kappa = k_n, or in steps
         shorter than the retardation time tau k_n tau / dt, of which k_n is elastic and carried
         on, the rest viscous (Kelvin and Voigt's solid). w_0 is that of the points that touch at
         the start of the step, see `set_velocities_at_start`. An open gap gives b = -g: what would
         close within the step is slowed down to the speed that closes it in one more.
impact   b = dt e w_c, so that w_1 = e w_c for closing speed w_c; the spring is stiff and the
         impulse acts from the time at which the bodies touch.
new      as at rest with N_0 = 0, but stiff for its first step: it finds the force that stops the
         blocks, and carries on with it as if they had always touched.
plastic  b = 0: a closed contact that the rest of its island drives together, a plastic impact.
plain    b = -2 g and w_0 taken as 0: a penalty spring on the gap, the paper's contact.
=======  ====================================================================================

Restitution is that of Newton, of normal velocities at the point of contact. It comes out as
prescribed, at any step, where one block strikes what does not move: blow by blow, also of several
within a step, since its step is taken in parts (`lone_block`). It is less where it would give
energy (`rebound`). Where several blocks move in one island, what is struck across a gap within the
same step takes part in the blow as if it touched: in a row of three that part again with e of 0.5
or more velocities differ by up to half of the first from those of one blow after the other.

The shear spring is the same on the shear velocity, from the shear force of the last step, limited
by Coulomb friction: a return mapping.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.constants import (
    AWAKE,
    BLOW_SPEED,
    BOLT,
    IMPACT,
    IMPACT_STEPS,
    IMPACT_STIFFNESS,
    NEW,
    OPEN,
    PLAIN,
    PLAIN_CONTACT,
    PLASTIC,
    REST,
    RETARDATION_TIME,
    START_STIFFNESS,
    STICK,
)
from rigdda.dynamics.contact.approach import (
    effective_mass,
    pull_on,
    set_velocities_at_start,
    strike,
)
from rigdda.dynamics.records import Bodies, Contact, Contacts, Interfaces, Parameters
from rigdda.kernel import inlined, kernel


@kernel
def carried_weight(mass_a: float, mass_b: float, p: Parameters) -> float:
    """Return the weight [N] of the heavier free body of a contact, the least load it may carry."""
    return max(mass_a, mass_b) * (p.gravity if p.gravity > 0.0 else 9.81)


@kernel
def rest_stiffness(weight: float, c: Contact, p: Parameters) -> float:
    """Return k_n [N/m] for the wanted penetration under the load that a contact carries.

    At least for `weight` [N]. `prepare` lets it never fall: stiffness that fell with the load would
    feed the sway of a stack.
    """
    return max(weight, c.accumulated_normal) / p.penetration


@kernel
def impact_stiffness(mass: float, dt: float) -> float:
    """Return the stiffness [N/m] that gives an effective mass its velocity within a step."""
    return IMPACT_STIFFNESS * mass / (dt * dt)


@kernel
def set_impact(c: Contact, closing: float, mass: float, p: Parameters) -> None:
    """Make a contact an impact with closing speed `closing` [m/s]."""
    c.kind = IMPACT
    c.kappa = impact_stiffness(mass, p.dt)
    c.bias = c.rebound = p.dt * c.restitution * closing
    c.accumulated_normal = c.accumulated_shear = c.start_normal = c.start_shear = 0.0


@kernel
def set_plastic(bodies: Bodies, c: Contact, p: Parameters) -> None:
    """Make a closed contact a plastic impact within the step."""
    c.kind = PLASTIC
    c.kappa = max(impact_stiffness(effective_mass(bodies, c), p.dt), c.kappa)
    c.bias = 0.0


@kernel
def set_rest(c: Contact, p: Parameters) -> None:
    """Make a contact a spring that carries on with the force of the last step."""
    c.kind = REST
    c.kappa = c.stiffness * max(1.0, RETARDATION_TIME / p.dt)
    if c.gap > p.penetration and c.bond == 0.0:
        c.accumulated_normal = c.start_normal = 0.0
        c.bias = -c.gap
    else:
        c.bias = c.accumulated_normal / c.kappa


@kernel
def set_new(bodies: Bodies, c: Contact, start: bool, p: Parameters) -> None:
    """Make a contact one that closes now, or may close, without an impact."""
    c.kind = NEW
    stiffness = impact_stiffness(effective_mass(bodies, c), p.dt)
    c.kappa = max(START_STIFFNESS * stiffness if start else stiffness, c.stiffness)
    c.bias = -max(c.gap, 0.0)


@kernel
def set_plain(c: Contact, p: Parameters) -> None:
    """Make a contact the paper's penalty spring on the displacement of the step.

    N = k_n (-gap - d_n) and S = S_0 - k_n d_s: the law above with w_0 = 0, and one k_n for all
    contacts. It has no memory of speed, so its rebound is what step and stiffness make of it.
    """
    c.kind = PLAIN
    c.stiffness = p.block_weight / p.penetration
    c.kappa = 0.5 * c.stiffness
    c.bias = -2.0 * c.gap
    c.un = c.us = 0.0
    if c.gap <= 0.0 and c.state == OPEN:
        c.state = STICK


@inlined
def strike_at_once(
    bodies: Bodies, contacts: Contacts, islands: Islands, island: int, p: Parameters
) -> None:
    """Let all contacts of a cluster in flight act at the time of its first impact.

    Impulses at different times would act on arms that the earlier ones have changed, and angular
    momentum would not be kept. What may touch the ground, or a fixed body, has none to keep.
    """
    share = 0.0
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.b < 0 or bodies[c.b].status != AWAKE:
            return
        if c.kind == IMPACT:
            share = max(share, c.share)
    if share == 0.0:
        return
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.kind == BOLT or c.kind == PLAIN:  # what they ask for does not depend on velocities
            continue
        closing = strike(bodies, c, (1.0 - share) * p.dt, 0.0, p)
        if c.kind == IMPACT:
            set_impact(c, max(closing, 0.0), effective_mass(bodies, c), p)


@inlined
def time_of_impact(
    bodies: Bodies, c: Contact, pull: float, threshold: float, p: Parameters
) -> float:
    """Return when in the step a contact begins an impact [s], or -1.0 if it does not.

    On entry arms and velocities are those of mid-step; on return those of the impact, or of
    mid-step if there is none. An open contact begins an impact if it closes faster than
    `threshold` [m/s], a closed one if faster than BLOW_SPEED, too, and if it is not deeper than the
    contact margin.
    """
    gap = max(c.gap, 0.0)
    mean = -c.un + 0.5 * pull * p.dt
    # what was foreseen may still come fast when it is closed already; but bodies that are in one
    # another are held apart by the force of the last step, from which an impact would not start
    least = threshold if c.state == OPEN else max(threshold, BLOW_SPEED)
    sunk = c.state != OPEN and c.gap < -p.margin
    if sunk or mean <= least or gap >= mean * p.dt:
        return -1.0
    time = gap / mean
    if strike(bodies, c, time, pull, p) > threshold:
        return time
    strike(bodies, c, 0.5 * p.dt, pull, p)
    return -1.0


@inlined
def prepare(bodies: Bodies, c: Contact, interfaces: Interfaces, start: bool, p: Parameters) -> None:
    """Set the law of a contact from its geometry and accumulated forces.

    `start` tells whether this is the very first step.
    """
    a, b = bodies[c.a], bodies[c.b]
    pull = pull_on(bodies, c, p)
    mass_b = b.mass if c.b >= 0 and b.status == AWAKE else 0.0
    weight = carried_weight(a.mass, mass_b, p)
    c.stiffness = max(c.stiffness, rest_stiffness(weight, c, p))
    interface = interfaces[a.surface, c.other]
    c.friction, c.restitution = interface.friction, interface.restitution
    c.lag = c.start_shear
    c.cohesion = c.bond * interface.cohesion
    c.tension = c.bond * interface.tension
    if c.cohesion == 0.0 and c.tension == 0.0:
        c.bond = 0.0
    strike(bodies, c, 0.5 * p.dt, pull, p)
    if c.lag == 0.0:
        c.lag = math.copysign(0.0, -c.us)  # the direction of friction once it slips
    if c.restitution == PLAIN_CONTACT:
        set_plain(c, p)
        return
    time = time_of_impact(bodies, c, pull, IMPACT_STEPS * p.gravity * p.dt, p)
    if time >= 0.0:
        set_impact(c, -c.un + pull * time, effective_mass(bodies, c), p)
        c.state = STICK
        return
    gap, mean = max(c.gap, 0.0), 0.5 * pull * p.dt - c.un
    set_velocities_at_start(bodies, c, p.dt)
    if c.state != OPEN:
        set_rest(c, p)
        return
    set_new(bodies, c, start, p)
    # what touches starts closed: in a stack no block moves before those below it are held, and
    # what hangs on a joint is held by it
    if c.bond > 0.0 or (gap < p.margin and gap - mean * p.dt < p.penetration):
        c.state = STICK
