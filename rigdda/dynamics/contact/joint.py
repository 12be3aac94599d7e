"""Joints that hold by cohesion and tensile strength until they break, once and for good.

A joint is what is closed at the start of a simulation. Each of its contacts stands for a share of
its length; a contact that bears more than its strength loses all of it.
"""

from __future__ import annotations

from rigdda.dynamics.constants import SAME_FACE
from rigdda.dynamics.records import Contact, Contacts, Parameters
from rigdda.kernel import kernel


@kernel
def bond_joints(contacts: Contacts, low: int, high: int, p: Parameters) -> None:
    """Share the length of each joint of one block among the contacts low:high that are on it."""
    for k in range(low, high):
        c = contacts[k]
        c.bond = 0.0
        if c.gap > p.penetration:
            continue
        count, least, most = 0, 0.0, 0.0
        for j in range(low, high):
            other = contacts[j]
            same = other.nx * c.nx + other.ny * c.ny > SAME_FACE
            if other.b == c.b and same and other.gap <= p.penetration:
                along = c.nx * (other.y - c.y) - c.ny * (other.x - c.x)
                least, most = min(least, along), max(most, along)
                count += 1
        c.bond = (most - least) / count


@kernel
def break_joint(c: Contact) -> None:
    """Take the strength from a contact."""
    c.bond = c.cohesion = c.tension = 0.0
