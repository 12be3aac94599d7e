r"""The law that a contact follows over one step.

Every closed contact is a penalty spring on the *end* velocity of the step,

.. math:: N = \kappa\,(b - \Delta t\,u_1), \qquad u_1 = 2 d_n / \Delta t - u_0,

with d_n the relative normal displacement of the step and u_0, u_1 the normal relative velocities
at its ends (positive separates). A spring on d_n itself (plain DDA) turns u_0 into -u_0 when it is
stiff, which makes resting contacts chatter; on the end velocity it loses energy at any stiffness.
What differs is the bias b:

=======  ====================================================================================
at rest  b = N_0 / kappa, the force carried over from the last step; kappa = k_n, or in steps
         shorter than the retardation time tau k_n tau / dt, of which k_n is elastic and carried
         on, the rest viscous (Kelvin and Voigt's solid). Penetration beyond what N_0 explains is
         pushed out slowly, a small gap closed so. u_0 is that of the points that touch at the
         start of the step, see `set_velocities_at_start`. What an open gap gives: see `closing`.
impact   b = dt e u_c, so that u_1 = e u_c for closing speed u_c; the spring is stiff and the
         impulse acts from the time at which the bodies touch.
new      as at rest with N_0 = 0, but stiff for its first step: it finds the force that stops the
         blocks, and carries on with it as if they had always touched.
shock    b = 0: a closed contact that the rest of its island drives together, a plastic impact.
plain    b = -2 g and u_0 taken as 0: a penalty spring on the gap, the paper's contact.
=======  ====================================================================================

The shear spring is the same on the shear velocity, from the shear force of the last step, limited
by Coulomb friction: a return mapping.
"""

from __future__ import annotations

import math

from rigdda.constants import (
    AWAKE,
    BLOW_SPEED,
    GREATEST_LOAD,
    IMPACT,
    IMPACT_SPEED,
    IMPACT_STEPS,
    IMPACT_STIFFNESS,
    MOVING,
    NEW,
    OPEN,
    PLAIN,
    PLAIN_CONTACT,
    PUSHED,
    RECOVERY_SPEED,
    RECOVERY_TIME,
    REST,
    RETARDATION_TIME,
    SHOCK,
    START_STIFFNESS,
    STICK,
    STIFFNESS_CHANGE,
    TERRAIN,
    TOUCHING,
    UNLOADED,
)
from rigdda.kernel import inlined, kernel
from rigdda.records import Bodies, Contacts, Interfaces, Parameters


@kernel
def carried_weight(mass_a: float, mass_b: float, p: Parameters) -> float:
    """Return the weight [N] of the heavier free body of a contact, the least load it may carry."""
    return max(mass_a, mass_b) * (p.gravity if p.gravity > 0.0 else 9.81)


@kernel
def rest_stiffness(weight: float, c: Contacts, k: int, p: Parameters) -> float:
    """Return k_n [N/m] for the wanted penetration under the load that contact k carries.

    At least for `weight` [N]. It grows with the load unless that comes from pushing out
    penetration, which in a wedged block would go on for ever. It falls only when most of the load
    has gone: stiffness that fell with the load would feed the sway of a stack.
    """
    least = weight / p.penetration
    before, load = c[k].stiffness, c[k].memory_normal
    if c[k].kind == MOVING:
        load = min(load, STIFFNESS_CHANGE * before * p.penetration)
    if load < UNLOADED * before * p.penetration:
        return max(least, before / STIFFNESS_CHANGE)
    if -c[k].gap * before > load:
        return max(least, before)
    return max(least, before, load / p.penetration)


@kernel
def effective_mass(bodies: Bodies, c: Contacts, k: int) -> float:
    """Return the mass [kg] that resists a normal impulse at contact k."""
    a, b = c[k].a, c[k].b
    arm = c[k].ra_x * c[k].ny - c[k].ra_y * c[k].nx
    inverse = 1.0 / bodies[a].mass + arm * arm / bodies[a].inertia
    if b >= 0 and bodies[b].status == AWAKE:
        arm = c[k].rb_x * c[k].ny - c[k].rb_y * c[k].nx
        inverse += 1.0 / bodies[b].mass + arm * arm / bodies[b].inertia
    return 1.0 / inverse


@kernel
def point_velocity(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the velocity [m/s] of the point (x, y) of body i; fixed and sleeping bodies rest."""
    if i < 0 or bodies[i].status != AWAKE:
        return 0.0, 0.0
    vx = bodies[i].vx - bodies[i].omega * (y - bodies[i].y)
    vy = bodies[i].vy + bodies[i].omega * (x - bodies[i].x)
    return vx, vy


@kernel
def set_arms(bodies: Bodies, c: Contacts, k: int, time: float) -> None:
    """Set the arms where the bodies will be after `time` [s]; so angular momentum is kept."""
    a, b = c[k].a, c[k].b
    vx, vy = point_velocity(bodies, a if c[k].owner == 1 else b, c[k].x, c[k].y)
    x, y = c[k].x + time * vx, c[k].y + time * vy
    c[k].ra_x = x - bodies[a].x - time * bodies[a].vx
    c[k].ra_y = y - bodies[a].y - time * bodies[a].vy
    if b >= 0:
        moving = 1.0 if bodies[b].status == AWAKE else 0.0
        c[k].rb_x = x - bodies[b].x - time * bodies[b].vx * moving
        c[k].rb_y = y - bodies[b].y - time * bodies[b].vy * moving


@kernel
def set_velocities(bodies: Bodies, c: Contacts, k: int) -> None:
    """Set the normal and shear relative velocities, at the arms, of bodies as they move now."""
    a, b = c[k].a, c[k].b
    vx = bodies[a].vx - bodies[a].omega * c[k].ra_y
    vy = bodies[a].vy + bodies[a].omega * c[k].ra_x
    if b >= 0 and bodies[b].status == AWAKE:
        vx -= bodies[b].vx - bodies[b].omega * c[k].rb_y
        vy -= bodies[b].vy + bodies[b].omega * c[k].rb_x
    c[k].un = c[k].nx * vx + c[k].ny * vy
    c[k].us = -c[k].ny * vx + c[k].nx * vy


@kernel
def set_velocities_at_start(bodies: Bodies, c: Contacts, k: int, dt: float) -> None:
    """Set the velocities from the places at the start, after those with the arms of mid-step.

    Points of a turning body do not go straight, and a face that turns comes nearer to what slides
    along it. With the displacement along the rows of mid-step u_1 then is the velocity at the end,
    to second order: a block that rocks on a corner neither lifts nor sinks it. But u_0 is at most
    that along the rows: greater, it would let the contact give energy.
    """
    ax, ay = point_velocity(bodies, c[k].a, c[k].x, c[k].y)
    bx, by = point_velocity(bodies, c[k].b, c[k].x, c[k].y)
    opening = c[k].nx * (ax - bx) + c[k].ny * (ay - by)
    c[k].us = -c[k].ny * (ax - bx) + c[k].nx * (ay - by)
    face = c[k].a if c[k].owner == 0 else c[k].b
    if face >= 0 and bodies[face].status == AWAKE:
        opening -= bodies[face].omega * c[k].us * dt
    c[k].un = min(c[k].un, opening)


@kernel
def impact_stiffness(mass: float, dt: float) -> float:
    """Return the stiffness [N/m] that gives an effective mass its velocity within a step."""
    return IMPACT_STIFFNESS * mass / (dt * dt)


@kernel
def set_impact(c: Contacts, k: int, closing: float, mass: float, p: Parameters) -> None:
    """Make contact k an impact with closing speed `closing` [m/s]."""
    c[k].kind = IMPACT
    c[k].kappa = impact_stiffness(mass, p.dt)
    c[k].bias = p.dt * c[k].restitution * closing
    c[k].memory_normal = c[k].memory_shear = c[k].start_normal = c[k].start_shear = 0.0


@kernel
def set_shock(bodies: Bodies, c: Contacts, k: int, p: Parameters) -> None:
    """Make the closed contact k a plastic impact within the step."""
    c[k].kind = SHOCK
    c[k].kappa = max(impact_stiffness(effective_mass(bodies, c, k), p.dt), c[k].kappa)
    c[k].bias = 0.0


@kernel
def recovery(surplus: float, dt: float) -> float:
    """Return the part of a surplus penetration that is pushed out in a step [m]."""
    return max(min(surplus / RECOVERY_TIME, RECOVERY_SPEED), -RECOVERY_SPEED) * dt


@kernel
def closing(c: Contacts, k: int, p: Parameters) -> float:
    """Return the bias with which an open contact closes at the end of the step, or stops [m].

    It bears force if it would close within the step, u_0 + u_1 < -2 g / dt, and where that would
    send it back, u_1 > 0, only what stops it: b = -2 g - dt u_0, at most 0. In fine steps, in which
    nothing watches what sinks in next, and between blocks, of which many strike at a time, it is
    slowed down before, to the speed that would close it in one more step: b = -g.
    """
    if p.sinking_limit == math.inf or c[k].b != TERRAIN:
        return -c[k].gap
    return min(-2.0 * c[k].gap - p.dt * c[k].un, 0.0)


@kernel
def set_rest(c: Contacts, k: int, weight: float, most: float, p: Parameters) -> None:
    """Make contact k a spring that carries on with the force of the last step.

    Penetration is not pushed out under more than `most` [N], which leaves a wedged block in peace,
    nor under next to no load, where blocks that collide would gain energy.
    """
    c[k].kind = REST
    c[k].kappa = c[k].stiffness * max(1.0, RETARDATION_TIME / p.dt)
    elastic = c[k].memory_normal / c[k].stiffness
    if c[k].gap > p.penetration and c[k].bond == 0.0:
        c[k].memory_normal = c[k].start_normal = 0.0
        c[k].bias = closing(c, k, p)
    else:
        c[k].bias = c[k].memory_normal / c[k].kappa
        if PUSHED * weight < c[k].memory_normal < most:
            surplus = max(-c[k].gap - elastic, 0.0) - max(c[k].gap, 0.0)
            c[k].bias += recovery(surplus, p.dt)


@kernel
def set_new(bodies: Bodies, c: Contacts, k: int, start: bool, p: Parameters) -> None:
    """Make contact k one that closes now, or may close, without an impact."""
    c[k].kind = NEW
    stiffness = impact_stiffness(effective_mass(bodies, c, k), p.dt)
    c[k].kappa = max(START_STIFFNESS * stiffness if start else stiffness, c[k].stiffness)
    # a gap of rounding would be a force in so stiff a spring
    c[k].bias = closing(c, k, p) if c[k].gap > TOUCHING * p.penetration else 0.0


@kernel
def set_plain(c: Contacts, k: int, p: Parameters) -> None:
    """Make contact k the paper's penalty spring on the displacement of the step.

    N = k_n (-gap - d_n) and S = S_0 - k_n d_s: the law above with u_0 = 0, and one k_n for all
    contacts. It has no memory of speed, so its rebound is what step and stiffness make of it.
    """
    c[k].kind = PLAIN
    c[k].stiffness = p.block_weight / p.penetration
    c[k].kappa = 0.5 * c[k].stiffness
    c[k].bias = -2.0 * c[k].gap
    c[k].un = c[k].us = 0.0
    if c[k].gap <= 0.0 and c[k].state == OPEN:
        c[k].state = STICK


@inlined
def strike(bodies: Bodies, c: Contacts, k: int, time: float, pull: float, p: Parameters) -> float:
    """Set arms and velocities of contact k at `time` in the step; returns the closing speed."""
    set_arms(bodies, c, k, time)
    set_velocities(bodies, c, k)
    c[k].share = 1.0 - time / p.dt
    return -c[k].un + pull * time


@inlined
def strike_at_once(bodies: Bodies, c: Contacts, low: int, high: int, p: Parameters) -> None:
    """Let all contacts of two blocks that collide act at the time of the first impact.

    Impulses at different times would act on arms that the earlier one has changed, and angular
    momentum would not be kept.
    """
    first = low
    for k in range(low, high):
        if k + 1 < high and c[k + 1].b == c[first].b:
            continue
        b, share = c[first].b, 0.0
        for j in range(first, k + 1):
            if c[j].kind == IMPACT:
                share = max(share, c[j].share)
        if share > 0.0 and b >= 0 and bodies[b].status == AWAKE:
            for j in range(first, k + 1):
                closing = strike(bodies, c, j, (1.0 - share) * p.dt, 0.0, p)
                if c[j].kind == IMPACT:
                    set_impact(c, j, max(closing, 0.0), effective_mass(bodies, c, j), p)
        first = k + 1


@inlined
def prepare(
    bodies: Bodies, c: Contacts, k: int, interfaces: Interfaces, start: bool, p: Parameters
) -> None:
    """Set the law of contact k from its geometry and memory; `start` is the very first step."""
    a, b = c[k].a, c[k].b
    # free relative acceleration along the normal is that of gravity
    pull = -(p.field_x * c[k].nx + p.field_y * c[k].ny)
    mass_b = 0.0
    if b >= 0 and bodies[b].status == AWAKE:
        pull, mass_b = 0.0, bodies[b].mass
    weight = carried_weight(bodies[a].mass, mass_b, p)
    most = GREATEST_LOAD * max(weight, p.block_weight)
    c[k].memory_shear *= most / max(c[k].memory_normal, most)
    c[k].memory_normal = min(c[k].memory_normal, most)
    c[k].start_normal = min(c[k].start_normal, most)
    c[k].stiffness = rest_stiffness(weight, c, k, p)
    interface = interfaces[bodies[a].surface, c[k].other]
    c[k].friction, c[k].restitution = interface.friction, interface.restitution
    c[k].flips = 0
    c[k].lag = c[k].start_shear
    c[k].cohesion = c[k].bond * interface.cohesion
    c[k].tension = c[k].bond * interface.tension
    if c[k].cohesion == 0.0 and c[k].tension == 0.0:
        c[k].bond = 0.0
    strike(bodies, c, k, 0.5 * p.dt, pull, p)
    if c[k].lag == 0.0:
        c[k].lag = math.copysign(0.0, -c[k].us)  # the direction of friction once it slips
    if c[k].restitution == PLAIN_CONTACT:
        set_plain(c, k, p)
        return
    threshold = max(IMPACT_SPEED, IMPACT_STEPS * p.gravity * p.dt)
    gap = max(c[k].gap, 0.0)
    mean = -c[k].un + 0.5 * pull * p.dt
    # what was foreseen may still come fast when it is closed already; but bodies that are in one
    # another are held apart by the force of the last step, from which an impact would not start
    least = threshold if c[k].state == OPEN else max(threshold, BLOW_SPEED)
    sunk = c[k].state != OPEN and c[k].gap < -p.slack
    if mean > least and gap < mean * p.dt and not sunk:
        closing = strike(bodies, c, k, gap / mean, pull, p)
        if closing > threshold:
            set_impact(c, k, closing, effective_mass(bodies, c, k), p)
            c[k].state = STICK
            return
        strike(bodies, c, k, 0.5 * p.dt, pull, p)
    set_velocities_at_start(bodies, c, k, p.dt)
    if c[k].state != OPEN:
        set_rest(c, k, weight, most, p)
        return
    set_new(bodies, c, k, start, p)
    # what touches starts closed: in a stack no block moves before those below it are held, and
    # what hangs on a joint is held by it
    if c[k].bond > 0.0 or (gap < p.slack and gap - mean * p.dt < p.penetration):
        c[k].state = STICK
