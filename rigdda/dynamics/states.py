"""States of contacts: open, stick, slip, from the forces of the current iterate.

A closed contact must press, an open one must not overlap, a sticking one must stay within its
friction limit, a slipping one must slip against its friction.
"""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.assembly.springs import relative_displacement
from rigdda.dynamics.constants import BOLT, OPEN, PIN, SETTLED, SLIP, STICK
from rigdda.dynamics.contact.joint import joint_breaks
from rigdda.dynamics.records import Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


@inlined
def spring_forces(c: Contact, d: NDArray, i: int, j: int, dt: float) -> tuple[float, float]:
    """Return the normal force of a contact, and its shear force if it stuck [N]."""
    dn, ds = relative_displacement(c, d, i, j)
    normal = c.kappa * (c.bias - (2.0 * dn - dt * c.un))
    shear = c.accumulated_shear - c.kappa * (2.0 * ds - dt * c.us)
    return normal, shear


@kernel
def next_state_of_link(c: Contact, normal: float, shear: float) -> bool:
    """Let a bolt yield, or no more: SLIP stands for yielding; a pin holds whatever its force."""
    c.normal, c.shear = max(normal, -c.tension), 0.0 if c.kind == BOLT else shear
    before = c.state
    c.state = SLIP if normal < -c.tension else STICK
    return c.state != before


@kernel
def next_friction(c: Contact, shear: float) -> bool:
    """Let a closed contact whose normal force is set stick or slip: a return mapping."""
    state, limit = c.state, c.friction * c.normal
    c.shear = min(max(shear, -limit), limit)
    if abs(shear) <= limit:
        c.state = STICK
        return state != STICK
    change = abs(c.shear - c.lag) if state == SLIP else math.inf
    c.state = SLIP
    c.lag = c.shear
    return change > SETTLED * limit


@inlined
def next_state(c: Contact, normal: float, shear: float, breaks: bool) -> bool:
    """Move a contact to the state that its forces ask for; returns whether it changed.

    `breaks` tells whether these forces have broken the joint that it is on.
    """
    if c.kind == BOLT or c.kind == PIN:
        return next_state_of_link(c, normal, shear)
    if c.state == OPEN:
        if normal > 0.0:
            c.state = STICK
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
    return next_friction(c, shear)


@inlined
def update_states(
    contacts: Contacts, d: NDArray, islands: Islands, low: int, high: int, p: Parameters
) -> bool:
    """Move every contact of an island to its next state; returns whether one changed."""
    changed = False
    for item in range(low, high if p.bonded else low):
        c = contacts[islands.contact_item[item]]
        if c.bond > 0.0:
            j = islands.slot[c.b] if c.pair >= 0 else -1
            c.normal, c.shear = spring_forces(c, d, islands.slot[c.a], j, p.dt)
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        i = islands.slot[c.a]
        j = islands.slot[c.b] if c.pair >= 0 else -1
        normal, shear = spring_forces(c, d, i, j, p.dt)
        breaks = c.bond > 0.0 and joint_breaks(contacts, islands, low, high, item)
        changed = next_state(c, normal, shear, breaks) or changed
    return changed
