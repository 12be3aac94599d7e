"""Position correction: penetration beyond what the load explains is pushed out, without force.

What contacts have sunk too far, while a pile came to rest or as they turned within a step, is no
elastic compression. To push it out by forces would lift the pile against the friction of its
walls, and drive what cannot give way. So blocks are displaced by lambda M^-1 e^t along the normals
alone at the end of a step, and get no velocity from it: projected Gauss-Seidel sweeps, lambda >= 0.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Motion, Rows
from rigdda.dynamics.assembly.springs import normal_row, relative_displacement
from rigdda.dynamics.constants import IMPACT, RECOVERY_SWEEPS
from rigdda.dynamics.linear.rows import (
    AIM,
    FORCE,
    GAIN,
    NORMAL,
    NOW,
    along_six,
    is_elastic,
    product,
    write_row,
)
from rigdda.dynamics.records import Bodies, Contact, Contacts, Parameters
from rigdda.kernel import inlined, kernel


@inlined
def excess_gap(c: Contact, motion: Motion, i: int, j: int, most: float) -> float:
    """Return the gap after the step plus the compression that accumulated force explains [m].

    Negative: too deep. The compression counts up to `most` [m].
    """
    dn, _ = relative_displacement(c, motion.d, i, j)
    correction, _ = relative_displacement(c, motion.correction, i, j)
    explained = min(max(c.accumulated_normal, 0.0) / c.stiffness, most)
    return c.gap + dn + correction + explained


@kernel
def part_bodies(rows: Rows, count: int) -> None:
    """Sweep once over the listed contacts: part their bodies as far as they are to."""
    for place in range(count):
        r, i, j = rows.row[place], rows.row_i[place], rows.row_j[place]
        a, b = rows.motion[i], rows.motion[j]
        parted = along_six(r[NORMAL : NORMAL + 6], a, b, NOW)
        before = r[FORCE]
        r[FORCE] = max(before + (r[AIM] - parted) * r[GAIN], 0.0)
        change = r[FORCE] - before
        for q in range(3):
            a[NOW + q] += change * r[NORMAL + q]
            b[NOW + q] += change * r[NORMAL + 3 + q]


@inlined
def find_deepest(
    contacts: Contacts, motion: Motion, islands: Islands, rows: Rows, low: int, high: int,
    most: float,
) -> float:  # fmt: skip
    """Set rows.height to the excess gaps of the contacts low:high; returns the deepest [m].

    Springs whose stiffness is given are as deep as they are to be, and what comes through a fence
    as it will. A cluster in flight is left as it is: to displace its blocks would change its
    angular momentum.
    """
    deepest, grounded = 0.0, False
    for q in range(low, high):
        c = contacts[islands.contact_item[q]]
        grounded = grounded or c.pair < 0
        j = islands.slot[c.b] if c.pair >= 0 else -1
        rows.height[q] = math.inf
        if not is_elastic(c) and not (c.kind == IMPACT and c.bias < 0.0):
            rows.height[q] = excess_gap(c, motion, islands.slot[c.a], j, most)
        deepest = max(deepest, -rows.height[q])
    return deepest if grounded else 0.0


@inlined
def list_rows(
    contacts: Contacts, islands: Islands, rows: Rows, low: int, high: int, n: int, reach: float
) -> int:
    """Write the rows of those of the contacts low:high that may be closed; returns how many.

    What is not too deep may close until it is; what is open by more than `reach` [m] will not.
    """
    count = 0
    for q in range(low, high):
        if rows.height[q] > reach:
            continue
        c, r = contacts[islands.contact_item[q]], rows.row[count]
        i = islands.slot[c.a]
        j = islands.slot[c.b] if c.pair >= 0 else n
        write_row(r, NORMAL, normal_row(c, True), rows.scale[i])
        write_row(r, NORMAL + 3, normal_row(c, False), rows.scale[j])
        r[GAIN], r[FORCE] = 1.0 / product(r, NORMAL, NORMAL), 0.0
        r[AIM] = -rows.height[q]
        rows.row_i[count], rows.row_j[count] = i, j
        count += 1
    return count


@inlined
def push_out(
    bodies: Bodies, contacts: Contacts, motion: Motion, islands: Islands, rows: Rows, island: int,
    struck: bool, p: Parameters,
) -> None:  # fmt: skip
    """Add to `motion.correction` what pushes out the penetration of an island in this step.

    In an island that was struck a force may be an impulse, which explains no lasting penetration
    beyond the wanted one.
    """
    low, high = islands.contact_start[island], islands.contact_start[island + 1]
    first = islands.block_start[island]
    n = islands.block_start[island + 1] - first
    deepest = find_deepest(
        contacts, motion, islands, rows, low, high, p.penetration if struck else math.inf
    )
    if deepest <= 0.0:
        return
    for s in range(n + 1):
        for q in range(3):
            rows.scale[s, q] = rows.motion[s, NOW + q] = 0.0
    for s in range(n):
        body = bodies[islands.block_item[first + s]]
        rows.scale[s, 0] = rows.scale[s, 1] = 1.0 / math.sqrt(body.mass)
        rows.scale[s, 2] = 1.0 / math.sqrt(body.inertia)
    count = list_rows(contacts, islands, rows, low, high, n, 2.0 * deepest)
    for _ in range(RECOVERY_SWEEPS):
        part_bodies(rows, count)
    for s in range(n):
        for q in range(3):
            motion.correction[s, q] += rows.motion[s, NOW + q] * rows.scale[s, q]
