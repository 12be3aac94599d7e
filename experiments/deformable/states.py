"""States of the plain contact: open, sticking, slipping."""

from __future__ import annotations

from rigdda.dynamics.constants import (
    FLIPS,
    FRICTION_TOLERANCE,
    OPEN,
    OPENING_TOLERANCE,
    SLIP,
    STICK,
)
from rigdda.dynamics.records import Contact
from rigdda.kernel import kernel


@kernel
def next_state(c: Contact, normal: float, shear: float, weight: float) -> bool:
    """Move a contact to the state that its forces [N] ask for; returns whether it changed.

    Tension opens it, and overlap closes it; it slips where |S| > N tan phi, with the friction of
    the last iteration. One that flipped too often keeps its state.
    """
    state, tolerance, worn = c.state, OPENING_TOLERANCE * weight, c.flips >= FLIPS
    if state == OPEN:
        if normal <= tolerance or worn:
            return False
        c.state = STICK
        return True
    if normal < -tolerance:
        c.state = OPEN
        c.flips += 1
        return True
    c.normal = max(normal, 0.0)
    limit = c.friction * c.normal
    c.shear = min(max(shear, -limit), limit)
    if abs(shear) <= limit:
        if state == STICK or worn:
            return False
        c.state = STICK
        c.flips += 1
        return True
    settled = abs(c.shear - c.lag) <= FRICTION_TOLERANCE * (limit + tolerance)
    c.state, c.lag = SLIP, c.shear
    return state == STICK or not settled
