"""Position correction: removes penetration beyond what the load explains, without forces.

Contacts may sink too far while a pile comes to rest or while bodies rotate within a step. This
penetration is not elastic compression. Removing it by forces would lift a pile against the friction
of its walls and push against bodies that cannot yield. Instead, bodies are displaced by lambda M^-1
e^t along the contact normals at the end of a step, which gives them no velocity. Projected
Gauss-Seidel sweeps with lambda >= 0 find the displacements.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Islands, Rows
from rigdda.dynamics.constants import RECOVERY_SWEEPS, SUBSTEPS
from rigdda.dynamics.records import Contacts, Parameters
from rigdda.dynamics.rows import (
    AIM,
    BRAKE,
    FREE,
    GAIN,
    GAP,
    NORMAL,
    TURN,
    X,
    Y,
    along_six,
    is_elastic,
    place_row,
    push,
)
from rigdda.kernel import inlined, kernel


@inlined
def find_deepest(
    contacts: Contacts, islands: Islands, rows: Rows, island: int, most: float
) -> float:
    """Set rows.height to the part of the gaps after the step that the load does not explain.

    The load explains a compression of up to `most` [m]. Springs of given stiffness are not
    corrected. Neither is a cluster in flight, because displacing its bodies would change its
    angular momentum. Returns the greatest excess penetration [m].
    """
    deepest, grounded = 0.0, False
    for q in range(islands.contact_start[island], islands.contact_start[island + 1]):
        c, k = contacts[islands.contact_item[q]], rows.place[q]
        i, j = rows.row_i[k], rows.row_j[k]
        grounded = grounded or c.pair < 0 or rows.slot[i, BRAKE] + rows.slot[j, BRAKE] > 0.0
        rows.height[k] = math.inf
        if is_elastic(c) or rows.idle[k] > SUBSTEPS:
            continue
        row = rows.row[k]
        a, b = rows.slot[i], rows.slot[j]
        place_row(row, rows.fact[k], rows.form[k], a, b, rows.scale[i], rows.scale[j])
        load = max(c.accumulated_normal, 0.0)
        explained = min(load / c.stiffness, most)
        rows.height[k] = row[GAP] + explained
        deepest = max(deepest, -rows.height[k])
    return deepest if grounded else 0.0


@kernel
def list_rows(rows: Rows, count: int, reach: float) -> int:
    """List the rows that are closed or may close when others are corrected; return how many."""
    listed = 0
    for k in range(count):
        if rows.height[k] <= reach:
            row, flexible = rows.row[k], 0.0
            for q in range(6):
                flexible += row[NORMAL + q] * row[NORMAL + q]
            row[GAIN], row[AIM] = 1.0 / flexible if flexible > 0.0 else 0.0, 0.0
            rows.visit[listed] = k
            listed += 1
    return listed


@kernel
def part_bodies(rows: Rows, listed: int) -> None:
    """Sweep once over the listed rows and separate their bodies as far as is still necessary."""
    for place in range(listed):
        k = rows.visit[place]
        row, a, b = rows.row[k], rows.slot[rows.row_i[k]], rows.slot[rows.row_j[k]]
        parted = along_six(row[NORMAL : NORMAL + 6], a, b, FREE)
        before = row[AIM]
        row[AIM] = max(before - (rows.height[k] + parted) * row[GAIN], 0.0)
        push(row, NORMAL, a, b, FREE, row[AIM] - before)


@inlined
def push_out(
    contacts: Contacts, islands: Islands, rows: Rows, island: int, struck: bool, p: Parameters
) -> None:
    """Displace the slots of an island at the end of its step to remove excess penetration.

    After an impact, a force may be an impulse, which explains no lasting penetration beyond the
    target penetration.
    """
    count = islands.contact_start[island + 1] - islands.contact_start[island]
    n = islands.block_start[island + 1] - islands.block_start[island]
    most = p.penetration if struck else math.inf
    deepest = find_deepest(contacts, islands, rows, island, most)
    if deepest <= 0.0:
        return
    for s in range(n + 1):
        for q in range(3):
            rows.slot[s, FREE + q] = 0.0
    listed = list_rows(rows, count, 2.0 * deepest)
    for _ in range(RECOVERY_SWEEPS):
        part_bodies(rows, listed)
    for s in range(n):
        slot = rows.slot[s]
        slot[X] += slot[FREE] * rows.scale[s, 0]
        slot[Y] += slot[FREE + 1] * rows.scale[s, 1]
        slot[TURN] += slot[FREE + 2] * rows.scale[s, 2]
