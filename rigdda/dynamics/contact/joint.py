r"""Joints with cohesion and tensile strength, which hold until they break irreversibly.

A joint consists of the contacts that are closed at the start of a simulation. Each contact
represents a share of its length L, but the strength is checked for the joint as a whole. In this
module, unlike elsewhere, tension is positive. The forces N_1 and N_2 at the two ends of a joint,
with sum N and moment M about its middle, are those of a traction that is linear along the joint,
with the value at end 1

.. math:: \sigma_1 = \frac{N}{L} + \frac{6 M}{L^2} = \frac{2 (2 N_1 - N_2)}{L} .

A joint opens where the traction exceeds the tensile strength. If N is tensile, it opens along its
whole length, because the traction increases as the joint becomes shorter. If N is compressive, it
opens at that end only. The shear strength is the sum of cohesion and friction.
"""

from __future__ import annotations

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.constants import SAME_FACE
from rigdda.dynamics.records import Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


@kernel
def bond_joints(contacts: Contacts, low: int, high: int, p: Parameters) -> None:
    """Distribute the length of each joint of a block over those of the contacts low:high on it."""
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


@inlined
def of_one_joint(c: Contact, other: Contact) -> bool:
    """Return whether two contacts belong to the same joint and the other one is unbroken."""
    same = c.a == other.a and c.b == other.b and c.nx * other.nx + c.ny * other.ny > SAME_FACE
    return same and other.bond > 0.0


@kernel
def break_joint(c: Contact) -> None:
    """Remove the strength of a contact."""
    c.bond = c.cohesion = c.tension = 0.0


@kernel
def joint_breaks(contacts: Contacts, islands: Islands, low: int, high: int, item: int) -> bool:
    """Break the joint of a contact if its strength is exceeded; return whether it breaks.

    The contact is item `item` of the contacts low:high of an island. `normal` and `shear` of all
    contacts of the joint must hold the forces of the unbroken joint.
    """
    c = contacts[islands.contact_item[item]]
    first = last = item
    while first > low and of_one_joint(c, contacts[islands.contact_item[first - 1]]):
        first -= 1
    while last + 1 < high and of_one_joint(c, contacts[islands.contact_item[last + 1]]):
        last += 1
    normal = shear = cohesion = 0.0
    for q in range(first, last + 1):
        other = contacts[islands.contact_item[q]]
        normal += other.normal
        shear += other.shear
        cohesion += other.cohesion
    strength, others = cohesion + c.friction * max(normal, 0.0), last - first
    here = everywhere = abs(shear) > 0.0 and abs(shear) >= strength
    for q in range(first, last + 1):
        other = contacts[islands.contact_item[q]]
        end = other.normal
        if others > 0:
            end += other.normal - (normal - other.normal) / others
        opens = end < -other.tension
        here = here or (opens and q == item)
        everywhere = everywhere or (opens and normal < 0.0)
    for q in range(first, last + 1):
        if everywhere or (here and q == item):
            break_joint(contacts[islands.contact_item[q]])
    return here or everywhere
