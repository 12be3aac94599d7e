"""Memory of contacts from step to step: normal and shear force, stiffness.

Keyed by the vertex (its owner included) and both bodies; the normals must agree, so that a corner
in a notch keeps the memories of its two contacts apart.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.constants import NEW, OPEN, SAME_FACE, SAME_NORMAL, TERRAIN
from rigdda.kernel import inlined, kernel
from rigdda.records import Contacts


@kernel
def fits_another(
    c: Contacts, k: int, new_low: int, new_high: int, old: Contacts, m: int, cosine: float
) -> bool:
    """Return whether another of the new contacts of the corner of k has the normal of old[m]."""
    for j in range(new_low, new_high):
        if j == k or c[j].key != c[k].key or c[j].b != c[k].b:
            continue
        if abs(c[j].nx * old[m].nx + c[j].ny * old[m].ny) > cosine:
            return True
    return False


@inlined
def recall_from(
    c: Contacts, k: int, new_low: int, new_high: int, old: Contacts, low: int, high: int, b: int,
    sign: float,
) -> bool:  # fmt: skip
    """Give contact k the memory of the same closed contact among old[low:high], if there is one."""
    for m in range(low, high):
        if old[m].b != b or old[m].key != c[k].key or old[m].state == OPEN:
            continue
        cosine = sign * (c[k].nx * old[m].nx + c[k].ny * old[m].ny)
        if cosine < SAME_NORMAL:
            continue
        # where a corner slides into a concave corner, the face ahead is not the one it comes from
        if cosine < SAME_FACE and fits_another(c, k, new_low, new_high, old, m, cosine):
            continue
        c[k].state, c[k].kind = old[m].state, old[m].kind
        c[k].memory_normal = old[m].memory_normal
        c[k].memory_shear = old[m].memory_shear
        c[k].start_normal, c[k].start_shear = old[m].start_normal, old[m].start_shear
        c[k].stiffness, c[k].bond = old[m].stiffness, old[m].bond
        return True
    return False


@inlined
def recall(c: Contacts, low: int, high: int, old: Contacts, first: NDArray, slack: float) -> None:
    """Give each new contact in low:high its memory; without one it starts OPEN.

    A contact that has come apart by more than `slack` starts OPEN, too: it closes by an impact.

    Bodies change sides (a, b) when one of them falls asleep or wakes, so a pair is looked up both
    ways; its forces keep their sign, since normal and shear turn round together.
    """
    for k in range(low, high):
        c[k].state, c[k].kind = OPEN, NEW
        c[k].memory_normal = c[k].memory_shear = c[k].stiffness = 0.0
        c[k].start_normal = c[k].start_shear = c[k].bond = 0.0
        if c[k].gap > slack:
            continue
        a, b = c[k].a, c[k].b
        found = recall_from(c, k, low, high, old, first[a], first[a + 1], b, 1.0)
        if not found and b != TERRAIN:
            recall_from(c, k, low, high, old, first[b], first[b + 1], a, -1.0)


@kernel
def copy_contact(c: Contacts, k: int, old: Contacts, m: int) -> None:
    """Keep contact m of the last step as contact k: between sleeping bodies nothing changes."""
    c[k].a, c[k].b, c[k].key, c[k].owner = old[m].a, old[m].b, old[m].key, old[m].owner
    c[k].other, c[k].x, c[k].y, c[k].nx, c[k].ny = (
        old[m].other,
        old[m].x,
        old[m].y,
        old[m].nx,
        old[m].ny,
    )
    c[k].gap, c[k].state, c[k].kind = old[m].gap, old[m].state, old[m].kind
    c[k].memory_normal, c[k].memory_shear = old[m].memory_normal, old[m].memory_shear
    c[k].start_normal, c[k].start_shear = old[m].start_normal, old[m].start_shear
    c[k].stiffness, c[k].normal, c[k].shear = old[m].stiffness, old[m].normal, old[m].shear
    c[k].bond = old[m].bond
