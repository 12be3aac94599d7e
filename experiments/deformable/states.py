"""States of the plain contact: open, sticking, slipping."""

from __future__ import annotations

from rigdda.dynamics.constants import (
    OPEN,
    SETTLED,
    SLIP,
    STICK,
)
from rigdda.dynamics.records import Contact
from rigdda.kernel import kernel


@kernel
def next_state(c: Contact, normal: float, shear: float, weight: float) -> bool:
    """Update the state of a contact from its forces [N]; return whether it changed.

    Tension opens it and overlap closes it. It slips if |S| > N tan phi, with the friction of the
    last iteration.
    """
    state = c.state
    if state == OPEN:
        c.state = STICK if normal > 0.0 else OPEN
        return normal > 0.0
    if normal < 0.0:
        c.state = OPEN
        return True
    c.normal = normal
    limit = c.friction * c.normal
    c.shear = min(max(shear, -limit), limit)
    if abs(shear) <= limit:
        c.state = STICK
        return state != STICK
    settled = abs(c.shear - c.lag) <= SETTLED * limit
    c.state, c.lag = SLIP, c.shear
    return state == STICK or not settled
