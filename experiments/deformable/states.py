"""States of the plain contact: open, sticking, slipping."""

from __future__ import annotations

from rigdda.constants import FLIPS, FRICTION_TOLERANCE, OPEN, OPENING_TOLERANCE, SLIP, STICK
from rigdda.kernel import kernel
from rigdda.records import Contacts


@kernel
def next_state(c: Contacts, k: int, normal: float, shear: float, weight: float) -> bool:
    """Move contact k to the state that its forces [N] ask for; returns whether it changed.

    Tension opens it, and overlap closes it; it slips where |S| > N tan phi, with the friction of
    the last iteration. One that flipped too often keeps its state.
    """
    state, tolerance, worn = c[k].state, OPENING_TOLERANCE * weight, c[k].flips >= FLIPS
    if state == OPEN:
        if normal <= tolerance or worn:
            return False
        c[k].state = STICK
        return True
    if normal < -tolerance:
        c[k].state = OPEN
        c[k].flips += 1
        return True
    c[k].normal = max(normal, 0.0)
    limit = c[k].friction * c[k].normal
    c[k].shear = min(max(shear, -limit), limit)
    if abs(shear) <= limit:
        if state == STICK or worn:
            return False
        c[k].state = STICK
        c[k].flips += 1
        return True
    settled = abs(c[k].shear - c[k].lag) <= FRICTION_TOLERANCE * (limit + tolerance)
    c[k].state, c[k].lag = SLIP, c[k].shear
    return state == STICK or not settled
