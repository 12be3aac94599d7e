"""Transfer of accumulated normal and shear force and stiffness of contacts between steps.

Contacts are identified by the vertex, its owner and both bodies. Their normals must agree as well,
so that the two contacts of a corner in a notch remain separate.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.constants import OPEN, SAME_FACE, SAME_NORMAL, TERRAIN
from rigdda.dynamics.contact.narrow_phase import copy_geometry
from rigdda.dynamics.records import Contact, Contacts
from rigdda.kernel import inlined, kernel


@kernel
def fits_another(contacts: Contacts, k: int, low: int, high: int, was: Contact) -> bool:
    """Return whether another new contact low:high of the corner of k matches `was` better."""
    c = contacts[k]
    cosine = abs(c.nx * was.nx + c.ny * was.ny)
    for j in range(low, high):
        other = contacts[j]
        if j == k or other.key != c.key or other.b != c.b:
            continue
        if abs(other.nx * was.nx + other.ny * was.ny) > cosine:
            return True
    return False


@inlined
def recall_from(
    contacts: Contacts, k: int, new_low: int, new_high: int, old: Contacts, low: int, high: int,
    place: int, b: int, sign: float,
) -> int:  # fmt: skip
    """Transfer the data of the same closed contact among old[low:high] to contact k, if any.

    The search starts at entry `place`, because contacts mostly keep their order. Returns the entry
    of the contact, or -1.
    """
    c = contacts[k]
    for tried in range(high - low):
        m = place + tried if place + tried < high else place + tried - (high - low)
        was = old[m]
        if was.b != b or was.key != c.key or was.state == OPEN:
            continue
        cosine = sign * (c.nx * was.nx + c.ny * was.ny)
        if cosine < SAME_NORMAL:
            continue
        # when a corner slides into a concave corner, the face ahead is a new contact
        if cosine < SAME_FACE and fits_another(contacts, k, new_low, new_high, was):
            continue
        c.state = was.state
        c.accumulated_normal, c.accumulated_shear = was.accumulated_normal, was.accumulated_shear
        c.accumulated_roll = was.accumulated_roll
        c.stiffness, c.bond = was.stiffness, was.bond
        return m
    return -1


@inlined
def recall(
    contacts: Contacts, low: int, high: int, old: Contacts, first: NDArray, margin: float
) -> None:
    """Transfer data of the last step to each contact in low:high; others start OPEN.

    A contact that has opened by more than `margin` also starts OPEN, so that it closes by an
    impact.

    Bodies exchange their roles (a, b) when one of them falls asleep or wakes, so a pair is looked
    up both ways. Its forces keep their signs, because the normal and shear directions both reverse.
    """
    place = first[contacts[low].a] if high > low else 0
    for k in range(low, high):
        c = contacts[k]
        c.state = OPEN
        c.accumulated_normal = c.accumulated_shear = c.accumulated_roll = 0.0
        c.stiffness = 0.0
        c.bond = 0.0
        if c.gap > margin:
            continue
        a, b = c.a, c.b
        start, end = first[a], first[a + 1]
        place = place if place < end else start
        found = recall_from(contacts, k, low, high, old, start, end, place, b, 1.0)
        if found >= 0:
            place = found + 1
        elif b != TERRAIN:
            recall_from(contacts, k, low, high, old, first[b], first[b + 1], first[b], a, -1.0)


@kernel
def copy_contact(c: Contact, was: Contact) -> None:
    """Copy a contact of the last step, as contacts of sleeping bodies do not change."""
    copy_geometry(c, was)
    c.state, c.kind = was.state, was.kind
    c.accumulated_normal, c.accumulated_shear = was.accumulated_normal, was.accumulated_shear
    c.accumulated_roll, c.roll = was.accumulated_roll, was.roll
    c.stiffness, c.normal, c.shear = was.stiffness, was.normal, was.shear
    c.bond, c.struck = was.bond, was.struck
