"""States of contacts: open, stick, slip, from the forces of the current iterate.

A closed contact must press, an open one must not overlap, a sticking one must stay within its
friction limit, a slipping one must slip against its friction.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.assembly.springs import relative_displacement
from rigdda.dynamics.constants import (
    BOLT,
    FRICTION_TOLERANCE,
    OPEN,
    PIN,
    PLASTIC_SPEED,
    REST,
    SLIP,
    STICK,
)
from rigdda.dynamics.contact.joint import joint_breaks
from rigdda.dynamics.contact.law import set_plastic
from rigdda.dynamics.records import Bodies, Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


@inlined
def spring_forces(c: Contact, d: NDArray, i: int, j: int, dt: float) -> tuple[float, float, float]:
    """Return normal force, shear force if it stuck [N], and normal velocity after the step."""
    dn, ds = relative_displacement(c, d, i, j)
    after = 2.0 * dn / dt - c.un
    normal = c.kappa * (c.bias - dt * after)
    shear = c.accumulated_shear - c.kappa * (2.0 * ds - dt * c.us)
    return normal, shear, after


@kernel
def next_state_of_link(c: Contact, normal: float, shear: float) -> bool:
    """Let a bolt yield, or no more: SLIP stands for yielding; a pin holds whatever its force."""
    c.normal, c.shear = max(normal, -c.tension), 0.0 if c.kind == BOLT else shear
    before = c.state
    c.state = SLIP if normal < -c.tension else STICK
    return c.state != before


@kernel
def close(c: Contact, normal: float, shear: float, coupled: bool) -> None:
    """Close a contact that would bear these forces if it stuck.

    Where friction is coupled to the normal force it slips at once if its shear force exceeds its
    friction limit: a contact that stuck would be torn open again.
    """
    c.state = STICK
    if coupled and abs(shear) > c.friction * normal:
        c.state, c.lag = SLIP, shear


@kernel
def next_friction(c: Contact, shear: float, coupled: bool) -> bool:
    """Let a closed contact whose normal force is set stick or slip: a return mapping.

    Where friction is coupled to the normal force a slipping contact is settled if its direction
    is right.
    """
    state, limit = c.state, c.friction * c.normal
    c.shear = min(max(shear, -limit), limit)
    if abs(shear) <= limit:
        c.state = STICK
        return state != STICK
    change = abs(c.shear - c.lag) if state == SLIP else math.inf
    if coupled and state == SLIP and c.shear * math.copysign(1.0, c.lag) >= 0.0:
        change = 0.0
    c.state = SLIP
    c.lag = c.shear
    return change > FRICTION_TOLERANCE * limit


@inlined
def next_state(c: Contact, normal: float, shear: float, coupled: bool, breaks: bool) -> bool:
    """Move a contact to the state that its forces ask for; returns whether it changed.

    `breaks` tells whether these forces have broken the joint that it is on.
    """
    if c.kind == BOLT or c.kind == PIN:
        return next_state_of_link(c, normal, shear)
    if c.state == OPEN:
        if normal > 0.0:
            close(c, normal, shear, coupled)
        return normal > 0.0
    if c.bond > 0.0:
        c.normal, c.shear = normal, shear
        return False
    if breaks and normal >= 0.0:
        return True
    if normal < 0.0:
        c.state = OPEN
        return True
    c.normal = normal
    return next_friction(c, shear, coupled)


@inlined
def update_states(
    bodies: Bodies, contacts: Contacts, d: NDArray, islands: Islands, low: int, high: int,
    coupled: bool, p: Parameters,
) -> bool:  # fmt: skip
    """Move every contact of an island to its next state; returns whether one changed."""
    changed = False
    for item in range(low, high if p.bonded else low):
        c = contacts[islands.contact_item[item]]
        if c.bond > 0.0:
            j = islands.slot[c.b] if c.pair >= 0 else -1
            c.normal, c.shear, _ = spring_forces(c, d, islands.slot[c.a], j, p.dt)
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        i = islands.slot[c.a]
        j = islands.slot[c.b] if c.pair >= 0 else -1
        normal, shear, after = spring_forces(c, d, i, j, p.dt)
        breaks = c.bond > 0.0 and joint_breaks(contacts, islands, low, high, item)
        sinking = -after - max(c.gap, 0.0) / p.dt  # what closes a gap is not driven in
        if c.state != OPEN and c.kind == REST and sinking > PLASTIC_SPEED:
            set_plastic(bodies, c, p)
            changed = True
        elif next_state(c, normal, shear, coupled, breaks):
            changed = True
    return changed
