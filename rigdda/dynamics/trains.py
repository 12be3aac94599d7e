"""Trains: blocks that come on as one, and strike another block or a fence with all their mass.

See `blows` for what that charges a fence with.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands
from rigdda.dynamics.blows import is_hit, momentum_towards, strength, strikes
from rigdda.dynamics.constants import CHAIN, OPEN
from rigdda.dynamics.islands import root
from rigdda.dynamics.records import Bodies, Contacts
from rigdda.kernel import kernel

STRIKES, HITS, COUNTED = 1.0, 2.0, 3.0
"""Marks of blocks in a train that strikes another block, or that hits the fence, and of a train
whose momentum is in the sum."""


@kernel
def follow(
    bodies: Bodies, contacts: Contacts, islands: Islands, low: int, high: int, ways: NDArray,
    trains: NDArray,
) -> bool:  # fmt: skip
    """Let what comes on behind a block that strikes be of its train; returns whether any is new.

    Behind one that hits the fence what is faster than both would go on strikes it itself: a blow.
    """
    more = False
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        if c.pair < 0 or c.state == OPEN:
            continue
        a, b = islands.slot[c.a], islands.slot[c.b]
        behind, ahead = (b, a) if strength(ways[a]) >= strength(ways[b]) else (a, b)
        last, first = (bodies[c.b], bodies[c.a]) if behind == b else (bodies[c.a], bodies[c.b])
        coming = momentum_towards(last, ways[behind])
        together = momentum_towards(first, ways[ahead]) * (1.0 + last.mass / first.mass)
        mark = trains[ahead, 2]
        if (mark == STRIKES and coming > 0.0) or (mark == HITS and 0.0 < coming <= together):
            i, j = root(islands.parent, a), root(islands.parent, b)
            more = more or i != j
            islands.parent[max(i, j)] = min(i, j)
            trains[behind, 2] = mark
    return more


@kernel
def find_trains(
    bodies: Bodies, contacts: Contacts, islands: Islands, island: int, fence: int, ways: NDArray,
    trains: NDArray,
) -> float:  # fmt: skip
    """Gather the blocks of an island that come on as one; returns what hits the fence [N s].

    `trains`, (n, 3), gets their mass [kg] and their momentum towards the fence [N s] where their
    root in islands.parent is, and whether a block strikes another one or the fence.
    """
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    first = islands.block_start[island]
    n, parent = islands.block_start[island + 1] - first, islands.parent
    for s in range(n):
        parent[s] = s
        trains[s, 0] = trains[s, 1] = trains[s, 2] = 0.0
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        hit = is_hit(c, fence)
        striker = islands.slot[c.a] if hit else strikes(c, islands, ways)[0]
        if striker >= 0:
            trains[striker, 2] = max(trains[striker, 2], HITS if hit else STRIKES)
    for _ in range(CHAIN):
        if not follow(bodies, contacts, islands, low, high, ways, trains):
            break
    for s in range(n):
        body, train = bodies[islands.block_item[first + s]], trains[root(parent, s)]
        train[0] += body.mass
        train[1] += momentum_towards(body, ways[s])
    momentum = 0.0
    for item in range(low, high):
        c = contacts[islands.contact_item[item]]
        train = root(parent, islands.slot[c.a])
        if is_hit(c, fence) and trains[train, 2] != COUNTED:
            momentum += trains[train, 1]
            trains[train, 2] = COUNTED
    return momentum
