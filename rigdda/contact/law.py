r"""The law that a contact follows over one step.

Every closed contact is a penalty spring on the *end* velocity of the step,

.. math:: N = \kappa\,(b - \Delta t\,u_1), \qquad u_1 = 2 d_n / \Delta t - u_0,

with d_n the relative normal displacement of the step and u_0, u_1 the normal relative velocities
at its ends (positive separates). A spring on d_n itself (plain DDA) turns u_0 into -u_0 when it is
stiff, which makes resting contacts chatter; on the end velocity it loses energy at any stiffness.
What differs is the bias b:

=======  ====================================================================================
at rest  b = N_0 / k_n, the force carried over from the last step. Penetration beyond what N_0
         explains is pushed out slowly. An open gap g gives b = -g: the contact closes within
         the step, at most.
impact   b = dt e u_c, so that u_1 = e u_c for closing speed u_c; the spring is stiff and the
         impulse acts from the time at which the bodies touch.
new      as at rest with N_0 = 0, but stiff for its first step: it finds the force that stops the
         blocks, and carries on with it as if they had always touched.
shock    b = 0: a closed contact that the rest of its island drives together, a plastic impact.
=======  ====================================================================================

The shear spring is the same on the shear velocity, from the shear force of the last step, limited
by Coulomb friction: a return mapping.
"""

from __future__ import annotations

from rigdda.constants import (
    AWAKE,
    IMPACT,
    IMPACT_SPEED,
    IMPACT_STEPS,
    IMPACT_STIFFNESS,
    NEW,
    OPEN,
    RECOVERY_SPEED,
    RECOVERY_TIME,
    REST,
    SHOCK,
    STICK,
)
from rigdda.kernel import kernel
from rigdda.records import Bodies, Contacts, Parameters


@kernel
def rest_stiffness(
    mass_a: float, mass_b: float, load: float, before: float, p: Parameters
) -> float:
    """Return k_n [N/m] for the wanted penetration under the load that the contact carries.

    At least the weight of the heavier free body; it follows a growing load and stays as long as
    the contact does: stiffness that fell with the load would feed the sway of a stack.
    """
    gravity = p.gravity if p.gravity > 0.0 else 9.81
    least = max(mass_a, mass_b) * gravity / p.penetration
    return max(least, load / p.penetration, before)


@kernel
def effective_mass(bodies: Bodies, c: Contacts, k: int) -> float:
    """Return the mass [kg] that resists a normal impulse at contact k."""
    a, b = c.a[k], c.b[k]
    arm = c.ra_x[k] * c.ny[k] - c.ra_y[k] * c.nx[k]
    inverse = 1.0 / bodies.mass[a] + arm * arm / bodies.inertia[a]
    if b >= 0 and bodies.status[b] == AWAKE:
        arm = c.rb_x[k] * c.ny[k] - c.rb_y[k] * c.nx[k]
        inverse += 1.0 / bodies.mass[b] + arm * arm / bodies.inertia[b]
    return 1.0 / inverse


@kernel
def point_velocity(bodies: Bodies, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the velocity [m/s] of the point (x, y) of body i; fixed and sleeping bodies rest."""
    if i < 0 or bodies.status[i] != AWAKE:
        return 0.0, 0.0
    vx = bodies.vx[i] - bodies.omega[i] * (y - bodies.y[i])
    vy = bodies.vy[i] + bodies.omega[i] * (x - bodies.x[i])
    return vx, vy


@kernel
def set_arms(bodies: Bodies, c: Contacts, k: int, time: float) -> None:
    """Set the arms where the bodies will be after `time` [s]; so angular momentum is kept."""
    a, b = c.a[k], c.b[k]
    vx, vy = point_velocity(bodies, a if c.owner[k] == 1 else b, c.x[k], c.y[k])
    x, y = c.x[k] + time * vx, c.y[k] + time * vy
    c.ra_x[k] = x - bodies.x[a] - time * bodies.vx[a]
    c.ra_y[k] = y - bodies.y[a] - time * bodies.vy[a]
    if b >= 0:
        moving = 1.0 if bodies.status[b] == AWAKE else 0.0
        c.rb_x[k] = x - bodies.x[b] - time * bodies.vx[b] * moving
        c.rb_y[k] = y - bodies.y[b] - time * bodies.vy[b] * moving


@kernel
def set_velocities(bodies: Bodies, c: Contacts, k: int) -> None:
    """Set the normal and shear relative velocities at the start of the step."""
    a, b = c.a[k], c.b[k]
    vx = bodies.vx[a] - bodies.omega[a] * c.ra_y[k]
    vy = bodies.vy[a] + bodies.omega[a] * c.ra_x[k]
    if b >= 0 and bodies.status[b] == AWAKE:
        vx -= bodies.vx[b] - bodies.omega[b] * c.rb_y[k]
        vy -= bodies.vy[b] + bodies.omega[b] * c.rb_x[k]
    c.un[k] = c.nx[k] * vx + c.ny[k] * vy
    c.us[k] = -c.ny[k] * vx + c.nx[k] * vy


@kernel
def impact_stiffness(mass: float, dt: float) -> float:
    """Return the stiffness [N/m] that gives an effective mass its velocity within a step."""
    return IMPACT_STIFFNESS * mass / (dt * dt)


@kernel
def set_impact(c: Contacts, k: int, closing: float, mass: float, p: Parameters) -> None:
    """Make contact k an impact with closing speed `closing` [m/s]."""
    c.kind[k] = IMPACT
    c.kappa[k] = impact_stiffness(mass, p.dt)
    c.bias[k] = p.dt * c.restitution[k] * closing
    c.memory_normal[k] = c.memory_shear[k] = 0.0


@kernel
def set_shock(bodies: Bodies, c: Contacts, k: int, p: Parameters) -> None:
    """Make the closed contact k a plastic impact within the step."""
    c.kind[k] = SHOCK
    c.kappa[k] = max(impact_stiffness(effective_mass(bodies, c, k), p.dt), c.kappa[k])
    c.bias[k] = 0.0


@kernel
def recovery(surplus: float, dt: float) -> float:
    """Return the part of a surplus penetration that is pushed out in a step [m]."""
    return max(min(surplus / RECOVERY_TIME, RECOVERY_SPEED), -RECOVERY_SPEED) * dt


@kernel
def set_rest(c: Contacts, k: int, p: Parameters) -> None:
    """Make contact k a spring that carries on with the force of the last step."""
    c.kind[k] = REST
    c.kappa[k] = c.stiffness[k]
    elastic = c.memory_normal[k] / c.stiffness[k]
    if c.gap[k] > p.penetration:
        c.bias[k] = -c.gap[k]
    else:
        c.bias[k] = elastic + recovery(-c.gap[k] - elastic, p.dt)


@kernel
def set_new(bodies: Bodies, c: Contacts, k: int, p: Parameters) -> None:
    """Make contact k one that closes now, or may close, without an impact."""
    c.kind[k] = NEW
    c.kappa[k] = max(impact_stiffness(effective_mass(bodies, c, k), p.dt), c.stiffness[k])
    c.bias[k] = -c.gap[k] if c.gap[k] > 0.0 else recovery(-c.gap[k], p.dt)


@kernel
def prepare(bodies: Bodies, c: Contacts, k: int, p: Parameters) -> None:
    """Set the law of contact k for this step from its geometry and memory."""
    a, b = c.a[k], c.b[k]
    gravity = p.gravity
    mass_b = 0.0
    if b >= 0 and bodies.status[b] == AWAKE:
        gravity, mass_b = 0.0, bodies.mass[b]
    c.stiffness[k] = rest_stiffness(bodies.mass[a], mass_b, c.memory_normal[k], c.stiffness[k], p)
    surface = bodies.surface[a]
    c.friction[k] = p.friction[surface, c.other[k]]
    c.restitution[k] = p.restitution[surface, c.other[k]]
    c.flips[k] = 0
    c.share[k] = 0.5
    set_arms(bodies, c, k, 0.5 * p.dt)
    set_velocities(bodies, c, k)
    # free relative acceleration along the normal is that of gravity
    pull = gravity * c.ny[k]
    threshold = max(IMPACT_SPEED, IMPACT_STEPS * p.gravity * p.dt)
    gap = max(c.gap[k], 0.0)
    mean = -c.un[k] + 0.5 * pull * p.dt
    if c.state[k] == OPEN and mean > threshold and gap < mean * p.dt:
        time = gap / mean
        set_arms(bodies, c, k, time)
        set_velocities(bodies, c, k)
        closing = -c.un[k] + pull * time
        if closing > threshold:
            c.share[k] = 1.0 - time / p.dt
            set_impact(c, k, closing, effective_mass(bodies, c, k), p)
            c.state[k] = STICK
            return
        set_arms(bodies, c, k, 0.5 * p.dt)
        set_velocities(bodies, c, k)
    if c.state[k] != OPEN:
        set_rest(c, k, p)
        return
    set_new(bodies, c, k, p)
    if mean * p.dt > gap:
        c.state[k] = STICK
