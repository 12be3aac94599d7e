"""Contact detection: lists the contacts of a step, body by body."""

from __future__ import annotations

from rigdda.dynamics.arrays import Boxes, Monitors, Totals, Work, World
from rigdda.dynamics.constants import (
    ASLEEP,
    AWAKE,
    SAME_NORMAL,
    TERRAIN,
)
from rigdda.dynamics.contact.broad_phase import partners_of_bodies, sweep_and_prune
from rigdda.dynamics.contact.joint import bond_joints
from rigdda.dynamics.contact.law import set_properties
from rigdda.dynamics.contact.links import add_link
from rigdda.dynamics.contact.narrow_phase import collide_pair, copy_geometry
from rigdda.dynamics.contact.terrain_phase import collide_terrain
from rigdda.dynamics.contact.transfer import copy_contact, recall
from rigdda.dynamics.monitors import barrier_contact
from rigdda.dynamics.records import (
    Bodies,
    Contacts,
    Ints,
    Parameters,
    Polygons,
)
from rigdda.dynamics.sleep import wake_neighbours
from rigdda.kernel import kernel, stage, variable


@kernel
def candidate_pairs(bodies: Bodies, polygon: Polygons, boxes: Boxes, p: Parameters) -> bool:
    """List the bodies that each awake body may touch in this step; return whether they fit."""
    pairs = sweep_and_prune(bodies, polygon, boxes, p)
    if pairs > 0 and p.sleeping and wake_neighbours(bodies, boxes.pairs, pairs, p.blocks) > 0:
        pairs = sweep_and_prune(bodies, polygon, boxes, p)
    if pairs < 0:
        return False
    partners_of_bodies(boxes, pairs)
    return True


@kernel
def keep_asleep(
    bodies: Bodies, contacts: Contacts, count: int, old: Contacts, first: Ints, a: int,
    monitors: Monitors, time: float,
) -> int:  # fmt: skip
    """Keep the contacts of sleeping block a with bodies at rest; return the new count, or -1."""
    if count + first[a + 1] - first[a] > len(contacts):
        return -1
    for m in range(first[a], first[a + 1]):
        b = old[m].b
        if b == TERRAIN or bodies[b].status != AWAKE:
            copy_contact(contacts[count], old[m])
            count += 1
            block, barrier = barrier_contact(monitors, a, b)
            if barrier >= 0:
                monitors.last_touch[block, barrier] = time
    return count


@kernel
def keep_sideways(contacts: Contacts, low: int, high: int, most: float) -> int:
    """Keep only the contacts low:high that push sideways; return the new number of contacts.

    A net stops blocks that come against it, but not blocks that fall on its top. Blocks that are
    already in it by more than `most` [m] pass over it. This is half its thickness and the way
    along x that a corner of a turning block may cover in a step.
    """
    kept = low
    for k in range(low, high):
        c = contacts[k]
        if abs(c.nx) >= SAME_NORMAL and c.gap > -most:
            copy_geometry(contacts[kept], c)
            kept += 1
    return kept


@stage
def collide_block(
    world: World, contacts: Contacts, count: int, old: Contacts, work: Work, a: int, start: bool,
    p: Parameters, totals: Totals,
) -> int:  # fmt: skip
    """Write the contacts of awake block a with the terrain and with its candidate partners.

    Returns
    -------
    int
        The new number of contacts, or -1 if they do not fit.
    """
    bodies, outlines = world.bodies, world.outlines
    first, room, boxes = count, len(contacts) - outlines.corner.shape[1] - 4, work.boxes
    if bodies[a].brake == 0.0:
        box = boxes.swept[a]
        count = collide_terrain(bodies, outlines, world.ground, box, contacts, count, a, p)
    for q in range(boxes.partner_start[a], boxes.partner_start[a + 1]):
        if count < 0 or count > room:
            return -1
        b, before = boxes.partner[q], count
        count = collide_pair(bodies, outlines, contacts, count, a, b, p)
        if count > before and (bodies[a].brake > 0.0 or bodies[b].brake > 0.0):
            fence, block = (a, b) if bodies[a].brake > 0.0 else (b, a)
            rock = bodies[block]
            way = p.dt * (abs(rock.vx) + abs(rock.omega) * rock.radius)
            most = abs(outlines.local[fence, 0].x) + way
            count = keep_sideways(contacts, before, count, most)
    if count < 0 or count > room:
        return -1
    recall(contacts, first, count, old, work.first, p.margin)
    if p.bonded and start:
        bond_joints(contacts, first, count, p)
    for k in range(first, count):
        set_properties(bodies, contacts[k], world.interfaces, p)
        totals.deepest[0] = max(totals.deepest[0], -contacts[k].gap)
    return count


@kernel
def copy_index(index: Ints, to: Ints) -> None:
    """Copy an index of contacts by body."""
    for a in range(len(index)):
        to[a] = index[a]


@stage
def detect(
    world: World, contacts: Contacts, old: Contacts, work: Work, monitors: Monitors, time: float,
    p: Parameters, totals: Totals,
) -> int:  # fmt: skip
    """Write all contacts of the step, ordered by first body.

    Returns
    -------
    int
        The number of contacts, or -1 if they do not fit.
    """
    bodies, links = world.bodies, world.links
    if not candidate_pairs(bodies, world.outlines.polygon, work.boxes, p):
        return -1
    start = time <= 1.5 * p.dt
    count, link = variable(0), 0
    for a in range(p.blocks):
        work.begin[a] = count
        low_link = link
        while link < len(links) and links[link].a == a:
            link += 1
        if bodies[a].status == AWAKE:
            count = collide_block(world, contacts, count, old, work, a, start, p, totals)
            if count < 0 or count + link - low_link > len(contacts):
                return -1
            for q in range(low_link, link):
                add_link(bodies, links, q, contacts[count], p)
                count += 1
        elif bodies[a].status == ASLEEP:
            count = keep_asleep(bodies, contacts, count, old, work.first, a, monitors, time)
            if count < 0:
                return -1
    work.begin[p.blocks] = count
    return count
