"""The forces of an island: apply them, account for their work, carry on what lasts."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Islands, Matrix, Monitors, Motion
from rigdda.dynamics.assembly.island import assemble_blocks, damping_of, load_moment
from rigdda.dynamics.assembly.springs import add_force, along, normal_row, shear_row
from rigdda.dynamics.constants import (
    BOLT,
    IMPACT,
    LATELY,
    OPEN,
    PIN,
    PLASTIC,
    PLASTIC_SPEED,
    REST,
)
from rigdda.dynamics.islands import root
from rigdda.dynamics.monitors import barrier_contact
from rigdda.dynamics.motion import top_speed
from rigdda.dynamics.records import Bodies, Body, Contact, Contacts, Parameters
from rigdda.kernel import inlined


@inlined
def add_contact_force(c: Contact, motion: Motion, i: int, of_a: bool) -> None:
    """Add the force of a contact to slot i, in `motion.correction`, and its share if an impact.

    An impact that another one forestalls counts, too: its corner stops no later.
    """
    if c.kind == IMPACT:
        motion.share[i] = max(motion.share[i], c.share)
    if c.state != OPEN:
        add_force(motion.correction[i], c.normal, normal_row(c, of_a))
        add_force(motion.correction[i], c.shear, shear_row(c, of_a))


@inlined
def pass_on_shares(
    bodies: Bodies, contacts: Contacts, share: NDArray, islands: Islands, island: int, dt: float
) -> None:
    """Let the time of an impact be that of the blows it sends through an island.

    Blocks that are struck through others would else move on for a while, into those that stopped.
    """
    n = islands.block_start[island + 1] - islands.block_start[island]
    struck, parent, slot = False, islands.parent, islands.slot
    for s in range(n):
        parent[s] = s
        struck = struck or share[s] > 0.0
    if not struck:
        return
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        if c.pair < 0 or c.state == OPEN:
            continue
        lighter = min(bodies[c.a].mass, bodies[c.b].mass)
        if c.normal * dt > PLASTIC_SPEED * lighter:
            i, j = root(parent, slot[c.a]), root(parent, slot[c.b])
            first = min(i, j)
            parent[max(i, j)] = first
            share[first] = max(share[i], share[j])
    for s in range(n):
        share[s] = share[root(parent, s)]


@inlined
def apply_forces(
    bodies: Bodies, contacts: Contacts, m: Matrix, motion: Motion, islands: Islands, island: int,
    relaxed: bool, p: Parameters,
) -> bool:  # fmt: skip
    """Set the displacements of an island and its impact correction.

    Forces are applied equal and opposite here, once more and exactly, so that momentum is kept to
    rounding whatever the residual of the solver. A constant force over the step displaces a block
    by dt^2 F / 2M; an impulse that acts for the share s of the step displaces it by s dt^2 F / M.
    The first impact sets the share of all, or the corner that hits first would go on until then.
    `relaxed` is what `open_close` returns: if True, relaxation has found the correction.

    Returns whether an impact acted on the island.
    """
    struck = False
    b0, b1 = islands.block_start[island], islands.block_start[island + 1]
    assemble_blocks(bodies, m, islands, b0, b1, p)
    for s in range(b1 - b0):
        for j in range(3):
            motion.correction[s, j] = 0.0
        motion.share[s] = 0.0
    for item in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c = contacts[islands.contact_item[item]]
        blow = c.kind == IMPACT or c.kind == PLASTIC
        struck = struck or (blow and c.normal > 0.0)
        add_contact_force(c, motion, islands.slot[c.a], True)
        if c.pair >= 0:
            add_contact_force(c, motion, islands.slot[c.b], False)
    if not relaxed:
        pass_on_shares(bodies, contacts, motion.share, islands, island, p.dt)
    for s in range(b1 - b0):
        body = bodies[islands.block_item[b0 + s]]
        share = motion.share[s]
        late = (share - 0.5) * p.dt * p.dt if share > 0.0 else 0.0
        for j in range(3):
            force = motion.correction[s, j]
            motion.d[s, j] = (m.rhs[s, j] + force) / m.diagonal[s, j, j]
            inertia = body.inertia if j == 2 else body.mass
            motion.correction[s, j] = motion.relaxed[s, j] if relaxed else force * late / inertia
    return struck


@inlined
def account_block(body: Body, motion: Motion, s: int, p: Parameters, ledger: NDArray) -> None:
    """Add the work of damping, loads, ground motion and late impulses on slot s to the ledger."""
    d, correction = motion.d[s], motion.correction[s]
    slow = body.mass * (d[0] ** 2 + d[1] ** 2) + body.inertia * d[2] ** 2
    ledger[2] -= damping_of(body, p) * slow / p.dt
    ledger[3] += body.force_x * d[0] + body.force_y * d[1]
    ledger[3] += load_moment(body) * d[2]
    ledger[3] += body.mass * (p.field_x - p.gravity_x) * d[0]
    ledger[3] += body.mass * (p.field_y - p.gravity_y) * d[1]
    # an impulse that acts early or late in the step lifts or lowers the block
    lift = p.gravity_x * correction[0] + p.gravity_y * correction[1]
    ledger[1] -= body.mass * lift


@inlined
def account_contact(
    c: Contact, d: NDArray, islands: Islands, ledger: NDArray, monitors: Monitors
) -> None:
    """Add the work of a closed contact to the ledger."""
    i = islands.slot[c.a]
    dn = along(normal_row(c, True), d[i])
    ds = along(shear_row(c, True), d[i])
    block, barrier = barrier_contact(monitors, c.a, c.b)
    if barrier >= 0 and monitors.target[barrier].capacity < math.inf:
        barrier = -1  # a fence is charged otherwise
    if barrier >= 0 and block == c.a:
        monitors.target[barrier].absorbed -= c.normal * dn + c.shear * ds
    if c.pair >= 0:
        j = islands.slot[c.b]
        en = along(normal_row(c, False), d[j])
        es = along(shear_row(c, False), d[j])
        if barrier >= 0 and block != c.a:
            monitors.target[barrier].absorbed -= c.normal * en + c.shear * es
        dn += en
        ds += es
    if c.kind == BOLT or c.kind == PIN:
        ledger[4] += c.normal * dn + c.shear * ds
    else:
        ledger[0] += c.shear * ds
        ledger[1] += c.normal * dn


@inlined
def move_block(body: Body, motion: Motion, s: int, dt: float) -> None:
    """Move a block, slot s, by its displacement; the velocity is that of constant acceleration."""
    d, correction = motion.d[s], motion.correction[s]
    body.lately = LATELY * max(top_speed(body), body.lately)
    body.vx = 2.0 * d[0] / dt - body.vx
    body.vy = 2.0 * d[1] / dt - body.vy
    body.omega = 2.0 * d[2] / dt - body.omega
    body.x += d[0] + correction[0]
    body.y += d[1] + correction[1]
    body.theta += d[2] + correction[2]


@inlined
def accumulate_forces(c: Contact, struck: bool, relaxed: bool) -> None:
    """Carry the forces of a contact to the next step; an impulse does not last.

    `relaxed` is what `open_close` returns. Where it is False and the island was struck, every force
    may be part of an impulse: accumulated forces stay as they were. Where it is True, relaxation
    has set the forces from which the next step starts, and only those of impacts are left out.
    """
    if c.state == OPEN:
        c.accumulated_normal = c.accumulated_shear = 0.0
        c.start_normal = c.start_shear = 0.0
        return
    if not struck or (relaxed and c.kind != IMPACT):
        elastic = c.stiffness / c.kappa if c.kind == REST else 1.0
        c.accumulated_normal += elastic * (c.normal - c.accumulated_normal)
        c.accumulated_shear += elastic * (c.shear - c.accumulated_shear)
    if not relaxed:
        c.start_normal, c.start_shear = c.normal, c.shear
