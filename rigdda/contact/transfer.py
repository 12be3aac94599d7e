"""Memory of contacts from step to step: normal and shear force, stiffness.

Keyed by the vertex (its owner included) and both bodies; the normals must agree, so that a corner
in a notch keeps the memories of its two contacts apart.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.constants import OPEN, SAME_NORMAL, TERRAIN
from rigdda.kernel import kernel
from rigdda.records import Contacts


@kernel
def index_by_body(c: Contacts, count: int, first: NDArray, bodies: int) -> None:
    """Set first[a] : first[a + 1] to the contacts of body a; contacts come in order of a."""
    k = 0
    for a in range(bodies):
        first[a] = k
        while k < count and c.a[k] == a:
            k += 1
    first[bodies] = k


@kernel
def recall_from(
    c: Contacts, k: int, old: Contacts, low: int, high: int, b: int, sign: float
) -> bool:
    """Give contact k the memory of the same closed contact among old[low:high], if there is one."""
    for m in range(low, high):
        if old.b[m] != b or old.key[m] != c.key[k] or old.state[m] == OPEN:
            continue
        if sign * (c.nx[k] * old.nx[m] + c.ny[k] * old.ny[m]) < SAME_NORMAL:
            continue
        c.state[k] = old.state[m]
        c.memory_normal[k] = old.memory_normal[m]
        c.memory_shear[k] = old.memory_shear[m]
        c.stiffness[k] = old.stiffness[m]
        return True
    return False


@kernel
def recall(c: Contacts, low: int, high: int, old: Contacts, first: NDArray) -> None:
    """Give each new contact in low:high its memory; without one it starts OPEN.

    Bodies change sides (a, b) when one of them falls asleep or wakes, so a pair is looked up both
    ways; its forces keep their sign, since normal and shear turn round together.
    """
    for k in range(low, high):
        c.state[k] = OPEN
        c.memory_normal[k] = c.memory_shear[k] = c.stiffness[k] = 0.0
        a, b = c.a[k], c.b[k]
        found = recall_from(c, k, old, first[a], first[a + 1], b, 1.0)
        if not found and b != TERRAIN:
            recall_from(c, k, old, first[b], first[b + 1], a, -1.0)


@kernel
def copy_contact(c: Contacts, k: int, old: Contacts, m: int) -> None:
    """Keep contact m of the last step as contact k: between sleeping bodies nothing changes."""
    c.a[k], c.b[k], c.key[k], c.owner[k] = old.a[m], old.b[m], old.key[m], old.owner[m]
    c.other[k], c.x[k], c.y[k], c.nx[k], c.ny[k] = old.other[m], old.x[m], old.y[m], old.nx[m], old.ny[m]
    c.gap[k], c.state[k], c.kind[k] = old.gap[m], old.state[m], old.kind[m]
    c.memory_normal[k], c.memory_shear[k] = old.memory_normal[m], old.memory_shear[m]
    c.stiffness[k], c.normal[k], c.shear[k] = old.stiffness[m], old.normal[m], old.shear[m]
