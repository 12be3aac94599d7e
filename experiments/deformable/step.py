"""One step of deformable blocks: detect contacts, compute their forces, move."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from experiments.deformable.compiled import entry
from experiments.deformable.equations import Solid, assemble, forces, solve_pcg
from experiments.deformable.states import next_state
from experiments.deformable.submatrices import UNKNOWNS
from rigdda.dynamics.arrays import Matrix, Monitors, Outlines, Totals, Work, World
from rigdda.dynamics.contact.law import set_law
from rigdda.dynamics.detection import copy_index, detect
from rigdda.dynamics.island_step import accumulate_force
from rigdda.dynamics.islands import find_islands, pair_blocks
from rigdda.dynamics.post_correction import place_edges
from rigdda.dynamics.records import (
    CONTACT_TOTAL,
    CONTACTS,
    ITERATIONS,
    SOLVER_ITERATIONS,
    SOLVES,
    STEPS,
    Bodies,
    Contacts,
    Floats,
    Parameters,
)
from rigdda.kernel import kernel


@kernel
def settle(
    bodies: Bodies, outlines: Outlines, contacts: Contacts, count: int, s: Solid, m: Matrix, n: int,
    pairs: int, p: Parameters, counters: NDArray,
) -> None:  # fmt: skip
    """Iterate until no contact changes its state."""
    for k in range(count):
        set_law(bodies, contacts[k], counters[STEPS] == 0, p)
    for i in range(n):
        for a in range(UNKNOWNS):
            s.d[i, a] = p.dt * s.velocity[i, a]
    for _ in range(p.iterations):
        assemble(bodies, outlines, contacts, count, s, n, pairs, p)
        counters[ITERATIONS] += 1
        counters[SOLVES] += 1
        counters[SOLVER_ITERATIONS] += solve_pcg(s, m, n, pairs, p.tolerance)
        moved = 0
        for k in range(count):
            c = contacts[k]
            normal, shear = forces(c, s)
            moved += next_state(c, normal, shear, bodies[c.a].mass * p.gravity)
        if moved == 0:
            return


@kernel
def move_block(bodies: Bodies, outlines: Outlines, s: Solid, i: int, dt: float) -> None:
    """Move and strain block i by T D, without post-correction; V1 = 2 D / dt - V0."""
    for a in range(UNKNOWNS):
        s.velocity[i, a] = 2.0 * s.d[i, a] / dt - s.velocity[i, a]
    for a in range(3):
        for b in range(3):
            s.stress[i, a] += s.elasticity[a, b] * s.d[i, 3 + b]
    u, v, r, ex, ey, g = s.d[i, 0], s.d[i, 1], s.d[i, 2], s.d[i, 3], s.d[i, 4], s.d[i, 5]
    radius = 0.0
    body = bodies[i]
    for k in range(body.count):
        corner = outlines.corner[i, k]
        x, y = corner.x - body.x, corner.y - body.y
        moved_x, moved_y = x - y * r + x * ex + 0.5 * y * g, y + x * r + y * ey + 0.5 * x * g
        corner.x, corner.y = body.x + u + moved_x, body.y + v + moved_y
        radius = max(radius, math.hypot(moved_x, moved_y))
    place_edges(outlines, i)
    body.radius = radius
    body.x += u
    body.y += v
    body.theta += r
    body.vx, body.vy, body.omega = s.velocity[i, 0], s.velocity[i, 1], s.velocity[i, 2]


@kernel
def rest_all(bodies: Bodies, velocity: Floats) -> None:
    """Set all velocities to zero, for static mode."""
    velocity[:] = 0.0
    for i in range(len(velocity)):
        bodies[i].vx = bodies[i].vy = bodies[i].omega = 0.0


@entry
def advance(
    world: World, now: Contacts, before: Contacts, work: Work, monitors: Monitors, levels: NDArray,
    totals: Totals, s: Solid, steps: int,
) -> tuple[bool, bool]:  # fmt: skip
    """Take steps with the contact detection of the core.

    Returns
    -------
    fits, swapped : bool
        Whether all contacts fitted; whether `now` and `before` have exchanged roles.
    """
    n, swapped, p = len(s.d), False, levels[0]
    bodies, outlines, m, counters = world.bodies, world.outlines, work.matrix, totals.counters
    for _ in range(steps):
        start = counters[STEPS] * p.dt
        if p.static:
            rest_all(bodies, s.velocity)
        copy_index(work.begin, work.first)
        count = detect(world, before, now, work, monitors, start + p.dt, p, totals)
        if count < 0:
            return False, swapped
        now, before = before, now
        swapped = not swapped
        counters[CONTACTS] = count
        counters[CONTACT_TOTAL] += count
        find_islands(bodies, now, work.begin, work.islands, p.blocks, False)
        pairs = pair_blocks(bodies, now, m, work.islands, 0, count)
        settle(bodies, outlines, now, count, s, m, n, pairs, p, counters)
        for k in range(count):
            accumulate_force(now[k])
        for i in range(n):
            move_block(bodies, outlines, s, i, p.dt)
        counters[STEPS] += 1
    return True, swapped
