"""Restitution of the impacts of an island: what they ask for, and less where that gives energy."""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.assembly.springs import relative_displacement
from rigdda.dynamics.constants import BOLT, IMPACT, PIN, SAME_NORMAL, STICK
from rigdda.dynamics.records import Contacts
from rigdda.kernel import kernel


@kernel
def ask_rebound(contacts: Contacts, islands: Islands, low: int, high: int) -> bool:
    """Let the impacts among the contacts low:high ask for their restitution; whether one does.

    In a step in which a fence fails they are settled more than once. Its own contacts ask for none:
    b < 0 lets blocks pass.
    """
    asked = False
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.kind == IMPACT and c.bias >= 0.0:
            c.bias, c.state = c.rebound, STICK
            asked = asked or c.rebound > 0.0
    return asked


@kernel
def set_rebound(contacts: Contacts, islands: Islands, low: int, high: int, share: float) -> None:
    """Let the impacts among the contacts low:high rebound with a share of what was asked."""
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.kind == IMPACT and c.bias >= 0.0:
            c.bias = share * c.rebound
            c.state = STICK


@kernel
def impact_work(contacts: Contacts, d: NDArray, islands: Islands, low: int, high: int) -> float:
    """Return the work of the contact forces of an island in this step [J], supports left out.

    Where contacts press in different directions, friction that gives energy counts twice: to
    rebound out of a wedge a block would be pressed against its sides with any force, which friction
    there would have to yield.
    """
    total = given = nx = ny = 0.0
    wedged = False
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.kind == BOLT or c.kind == PIN:
            continue
        i = islands.slot[c.a]
        j = islands.slot[c.b] if c.pair >= 0 else -1
        dn, ds = relative_displacement(c, d, i, j)
        total += c.normal * dn + c.shear * ds
        given += max(c.shear * ds, 0.0)
        if c.normal > 0.0:
            wedged = wedged or nx * c.nx + ny * c.ny < SAME_NORMAL * (nx * nx + ny * ny)
            nx, ny = c.nx, c.ny
    return total + given if wedged else total
