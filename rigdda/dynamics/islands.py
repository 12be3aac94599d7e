"""Islands: clusters of free blocks connected by contacts, including open ones, or by bolts.

Fixed and sleeping bodies and the terrain have no unknowns and do not connect blocks.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Matrix
from rigdda.dynamics.constants import AWAKE
from rigdda.dynamics.records import Bodies, Contact, Contacts, Ints
from rigdda.kernel import kernel, variable


@kernel
def root(parent: NDArray, i: int) -> int:
    """Return the representative of i, with path halving."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@kernel
def joins(bodies: Bodies, c: Contact) -> bool:
    """Return whether a contact couples two bodies with unknowns."""
    return c.b >= 0 and bodies[c.a].status == AWAKE and bodies[c.b].status == AWAKE


@kernel
def join_blocks(
    bodies: Bodies, contacts: Contacts, count: int, parent: NDArray, blocks: int, apart: bool
) -> None:
    """Build the union-find forest of blocks coupled by contacts; a root is the smallest index.

    With `apart` False, all awake blocks form one island.
    """
    for i in range(blocks):
        parent[i] = i
    if not apart:
        first = -1
        for i in range(blocks):
            if bodies[i].status == AWAKE:
                first = i if first < 0 else first
                parent[i] = first
    for k in range(count):
        c = contacts[k]
        if joins(bodies, c):
            i, j = root(parent, c.a), root(parent, c.b)
            parent[max(i, j)] = min(i, j)


@kernel
def find_islands(
    bodies: Bodies, contacts: Contacts, begin: Ints, islands: Islands, blocks: int, apart: bool
) -> int:
    """List blocks and contacts island by island.

    The contacts are ordered by first body, those of body a starting at begin[a], so that one pass
    suffices.

    Returns
    -------
    int
        Number of islands.
    """
    parent, slot = islands.parent, islands.slot
    block_start, contact_start = islands.block_start, islands.contact_start
    join_blocks(bodies, contacts, begin[blocks], parent, blocks, apart)
    count = variable(0)
    for s in range(len(block_start)):
        block_start[s] = contact_start[s] = 0
    # until `_fill`, slot holds the island number of each root
    for i in range(blocks):
        if bodies[i].status == AWAKE and root(parent, i) == i:
            slot[i] = count
            count += 1
    for i in range(blocks):
        if bodies[i].status == AWAKE:
            s = slot[root(parent, i)]
            block_start[s + 1] += 1
            contact_start[s + 1] += begin[i + 1] - begin[i]
    for s in range(count):
        block_start[s + 1] += block_start[s]
        contact_start[s + 1] += contact_start[s]
    _fill(bodies, begin, islands, blocks, count)
    return count


@kernel
def _fill(bodies: Bodies, begin: Ints, islands: Islands, blocks: int, count: int) -> None:
    """Write the items of each island in ascending order, then the slots of the blocks."""
    parent, slot = islands.parent, islands.slot
    block_start, contact_start = islands.block_start, islands.contact_start
    for i in range(blocks):
        if bodies[i].status == AWAKE:
            s = slot[root(parent, i)]
            for k in range(begin[i], begin[i + 1]):
                islands.contact_item[contact_start[s]] = k
                contact_start[s] += 1
    for s in range(count, 0, -1):
        contact_start[s] = contact_start[s - 1]
    contact_start[0] = 0
    for i in range(blocks):
        if bodies[i].status == AWAKE:
            s = slot[root(parent, i)]
            islands.block_item[block_start[s]] = i
            block_start[s] += 1
    for s in range(count, 0, -1):
        block_start[s] = block_start[s - 1]
    block_start[0] = 0
    for s in range(count):
        for place in range(block_start[s], block_start[s + 1]):
            slot[islands.block_item[place]] = place - block_start[s]


@kernel
def pair_blocks(
    bodies: Bodies, contacts: Contacts, m: Matrix, islands: Islands, low: int, high: int
) -> int:
    """Assign the off-diagonal blocks of an island; return the number of pairs of bodies.

    The contacts of a pair must be consecutive.
    """
    pairs, last_a, last_b = 0, -1, -1
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        c.pair = -1
        if not joins(bodies, c):
            continue
        if c.a != last_a or c.b != last_b:
            last_a, last_b = c.a, c.b
            m.pair_i[pairs], m.pair_j[pairs] = islands.slot[last_a], islands.slot[last_b]
            pairs += 1
        c.pair = pairs - 1
    return pairs
