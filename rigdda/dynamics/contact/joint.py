r"""Joints that hold by cohesion and tensile strength until they break, once and for good.

A joint is what is closed at the start of a simulation. Each of its contacts stands for a share of
its length L, but they are judged together. Here, unlike elsewhere, pulling is positive. The forces
N_1 and N_2 of a joint's two ends, of sum N and moment M about its middle, are those of a traction
that is linear along it, and at its end 1 that is

.. math:: \sigma_1 = \frac{N}{L} + \frac{6 M}{L^2} = \frac{2 (2 N_1 - N_2)}{L} .

Where it exceeds the tensile strength the joint opens, all along if the joint is pulled as a whole:
the traction grows as the joint becomes shorter. Pressed as a whole, it opens at that end. In shear
it bears what cohesion and friction give in sum.
"""

from __future__ import annotations

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.constants import SAME_FACE
from rigdda.dynamics.records import Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


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


@inlined
def of_one_joint(c: Contact, other: Contact) -> bool:
    """Return whether two contacts are on one joint, and the other one still holds."""
    same = c.a == other.a and c.b == other.b and c.nx * other.nx + c.ny * other.ny > SAME_FACE
    return same and other.bond > 0.0


@kernel
def break_joint(c: Contact) -> None:
    """Take the strength from a contact."""
    c.bond = c.cohesion = c.tension = 0.0


@kernel
def joint_breaks(contacts: Contacts, islands: Islands, low: int, high: int, item: int) -> bool:
    """Break the joint of a contact, one of low:high of an island, if it must; returns whether.

    The forces that the contacts of the joint would bear are in `normal` and `shear`.
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
