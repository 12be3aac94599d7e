"""Cut-backs: islands that one step would take too far take it in shorter ones.

A step is too long for an island if a corner ends it far from the straight path along which its
contacts were foreseen, or goes farther than in any direction they were; or, in steps that are
coarse for the blocks, if a contact sinks in, by what stops over the step, or because contacts are
settled in linear displacements (equation 2) and what turns far enough ends elsewhere (equation 1).
Where a lone block sinks in on the ground, its blow may act early instead.
"""

from __future__ import annotations

import math

from rigdda.assembly.springs import along, normal_row
from rigdda.constants import AWAKE, BOLT, CUTS, HELD, MOVING_SINKING, PIN, PLAIN, TERRAIN
from rigdda.contact.transfer import recall
from rigdda.kernel import inlined, kernel
from rigdda.records import Bodies, Body, Contact, Contacts, Ints, Islands, Motion, Parameters


@inlined
def too_far(
    bodies: Bodies, contacts: Contacts, motion: Motion, islands: Islands, island: int, p: Parameters
) -> float:
    """Return how far an island goes in this step, over how far a step should take it [-].

    Forces are applied: motion.d and motion.besides are its displacements.
    """
    far = farthest_corner(bodies, motion, islands, island, p)
    if p.sinking_limit < math.inf:
        blocks = islands.block_start[island + 1] - islands.block_start[island]
        limit = p.sinking_limit * (MOVING_SINKING * blocks if islands.relaxed[0] == 1 else 1.0)
        far = max(far, greatest_sinking(bodies, contacts, motion, islands, island) / limit)
    return far


@inlined
def farthest_corner(
    bodies: Bodies, motion: Motion, islands: Islands, island: int, p: Parameters
) -> float:
    """Return how far a corner of an island goes, over how far a step should take it [-].

    By a bound on how far from its straight path one ends the step, and on how much farther than
    foreseen one goes.
    """
    departure = deflection = 0.0
    low = islands.block_start[island]
    for place in range(low, islands.block_start[island + 1]):
        d, body = motion.d[place - low], bodies[islands.block_item[place]]
        turn = abs(d[2]) * body.radius
        dx, dy = d[0] - p.dt * body.vx, d[1] - p.dt * body.vy
        departure = max(departure, math.sqrt(dx * dx + dy * dy) + turn)
        way = math.sqrt(d[0] * d[0] + d[1] * d[1]) + turn
        deflection = max(deflection, way - body.path)
    deflection -= p.gravity * p.dt * p.dt
    return max(departure / p.displacement_limit, deflection / p.deflection_limit)


@kernel
def point_after(
    body: Body, motion: Motion, s: int, x: float, y: float, cos: float, sin: float
) -> tuple[float, float]:
    """Return where a point of a body, in slot s, ends the step; it turns by this angle."""
    x, y = x - body.x, y - body.y
    d, besides = motion.d[s], motion.besides[s]
    u, v = d[0] + besides[0], d[1] + besides[1]
    return body.x + u + cos * x - sin * y, body.y + v + sin * x + cos * y


@kernel
def gap_after(bodies: Bodies, c: Contact, motion: Motion, islands: Islands) -> float:
    """Return the gap of a contact at the end of the step, after the post-correction [m]."""
    nx, ny = c.nx, c.ny
    # the corner, and the point of the face that it is over; the normal points to a
    side = 1.0 if c.owner == 1 else 0.0
    ax, ay = c.x + (1.0 - side) * c.gap * nx, c.y + (1.0 - side) * c.gap * ny
    bx, by = c.x - side * c.gap * nx, c.y - side * c.gap * ny
    s = islands.slot[c.a]
    turn = motion.d[s, 2] + motion.besides[s, 2]
    cos, sin = math.cos(turn), math.sin(turn)
    ax, ay = point_after(bodies[c.a], motion, s, ax, ay, cos, sin)
    if c.owner == 0:  # the face turns with a
        nx, ny = cos * nx - sin * ny, sin * nx + cos * ny
    if c.pair >= 0:
        s = islands.slot[c.b]
        turn = motion.d[s, 2] + motion.besides[s, 2]
        cos, sin = math.cos(turn), math.sin(turn)
        bx, by = point_after(bodies[c.b], motion, s, bx, by, cos, sin)
        if c.owner == 1:
            nx, ny = cos * nx - sin * ny, sin * nx + cos * ny
    return nx * (ax - bx) + ny * (ay - by)


@kernel
def greatest_sinking(
    bodies: Bodies, contacts: Contacts, motion: Motion, islands: Islands, island: int
) -> float:
    """Return by how much a contact of an island ends the step deeper than it began it [m]."""
    most = 0.0
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.kind != BOLT and c.kind != PIN and c.kind != PLAIN:
            most = max(most, min(c.gap, 0.0) - gap_after(bodies, c, motion, islands))
    return most


@kernel
def act_early(
    bodies: Bodies, contacts: Contacts, motion: Motion, islands: Islands, island: int, p: Parameters
) -> bool:
    """Let the velocity of a lone block change so early in the step that its corners do not sink.

    A force that stops a corner over a step lets it sink by half of the way that it would have gone.
    A blow stops it at once, also one too slow to pass for an impact beside what gravity adds to the
    speed in a coarse step. What changes by the share s of the step early displaces the block by
    s dt (v_1 - v_0) besides. Returns whether that is what it takes: on the ground it is, from a
    corner of another body the block may turn into what it does not touch yet.
    """
    low = islands.block_start[island]
    if islands.block_start[island + 1] - low > 1 or motion.share[0] > 0.0:
        return False
    body, share = bodies[islands.block_item[low]], 0.0
    d = motion.d[0]
    ahead = (  # dt (v_1 - v_0)
        2.0 * (d[0] - p.dt * body.vx),
        2.0 * (d[1] - p.dt * body.vy),
        2.0 * (d[2] - p.dt * body.omega),
    )
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.kind == BOLT or c.kind == PIN or c.kind == PLAIN:
            continue
        sinking = min(c.gap, 0.0) - gap_after(bodies, c, motion, islands)
        if sinking > 0.0:
            push = along(normal_row(c, True), ahead)
            if c.b != TERRAIN or c.owner != 1 or push <= 0.0:
                return False
            share = max(share, sinking / push)
    for j in range(3):  # not before the step
        motion.besides[0, j] = min(share, 0.5) * ahead[j]
    return True


@kernel
def level_for(excess: float, p: Parameters) -> int:
    """Return how often to halve a step that went too far by this factor."""
    level = p.first_cut
    while excess > 2.0**level and level < CUTS:
        level += 1
    return level


@kernel
def mark_cut(bodies: Bodies, islands: Islands, island: int) -> None:
    """Mark the blocks of an island that is to be cut back."""
    for place in range(islands.block_start[island], islands.block_start[island + 1]):
        bodies[islands.block_item[place]].cut = 1


@kernel
def hold_others(
    bodies: Bodies, now: Contacts, count: int, before: Contacts, first: Ints, p: Parameters
) -> None:
    """Begin a cut-back: all blocks but those of the islands left have taken the step and are held.

    The contacts of the islands left are as they were before the step.
    """
    for k in range(count):
        if bodies[now[k].a].cut == 1:
            recall(now, k, k + 1, before, first, p.slack)
    for i in range(p.blocks):
        body = bodies[i]
        if body.status == AWAKE and body.cut == 0:
            body.status = HELD
        body.cut = 0


@kernel
def release_all(bodies: Bodies) -> None:
    """End a cut-back."""
    for i in range(len(bodies)):
        if bodies[i].status == HELD:
            bodies[i].status = AWAKE
