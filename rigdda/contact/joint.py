"""Joints that hold by cohesion and tensile strength until they break, once and for good.

A joint is what is closed at the start of a simulation. Each of its contacts stands for a share of
its length; a contact that bears more than its strength loses all of it.
"""

from __future__ import annotations

from rigdda.constants import SAME_FACE
from rigdda.kernel import kernel
from rigdda.records import Contacts, Parameters


@kernel
def bond_joints(c: Contacts, low: int, high: int, p: Parameters) -> None:
    """Share the length of each joint of one block among the contacts low:high that are on it."""
    for k in range(low, high):
        c[k].bond = 0.0
        if c[k].gap > p.penetration:
            continue
        count, least, most = 0, 0.0, 0.0
        for j in range(low, high):
            same = c[j].nx * c[k].nx + c[j].ny * c[k].ny > SAME_FACE
            if c[j].b == c[k].b and same and c[j].gap <= p.penetration:
                along = c[k].nx * (c[j].y - c[k].y) - c[k].ny * (c[j].x - c[k].x)
                least, most = min(least, along), max(most, along)
                count += 1
        c[k].bond = (most - least) / count


@kernel
def break_joint(c: Contacts, k: int) -> None:
    """Take the strength from contact k."""
    c[k].bond = c[k].cohesion = c[k].tension = 0.0
