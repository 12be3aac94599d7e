"""Readings of a simulation: contacts, support forces, energies and diagnostics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.constants import (
    BOLT,
    FIXED,
    MARGIN_RATIO,
    OPEN,
    PIN,
    PLAIN,
    REST,
    SLEEP_SPEED,
)
from rigdda.dynamics.contact.links import pull_of_bolts
from rigdda.dynamics.packing import Arrays
from rigdda.dynamics.records import (
    CONTACT_TOTAL,
    ITERATIONS,
    LEDGER,
    RELAXED,
    SOLVER_ITERATIONS,
    SOLVES,
    STEPS,
    SWEEPS,
    Contacts,
    Floats,
    Ints,
)
from rigdda.model.scene import Scene

CONTACT_TABLE = np.dtype(
    [
        ("block_a", "i4"),
        ("block_b", "i4"),
        ("x", "f8"),
        ("y", "f8"),
        ("nx", "f8"),
        ("ny", "f8"),
        ("normal_force", "f8"),
        ("shear_force", "f8"),
        ("state", "U5"),
        ("penetration", "f8"),
    ]
)
"""Fields of a contact. block_b is -1 for the terrain and N + i for barrier i; block_a may be N + i
for a gravity wall. The normal points from b to a; shear is positive along the normal turned by +90
degrees. Forces act on a [N]; penetration is in m."""

STATES = np.array(["open", "stick", "slip"])


class Energy(NamedTuple):
    """Current energies of all blocks and gravity walls, and the work done on them so far [J].

    `elastic` is the energy stored in bolts and plain contacts. `friction`, `damping` and `impact`
    are the work of shear forces, of damping, and of the normal forces of contacts less the stored
    energy; they are negative where they dissipate energy. The kinetic energy of a block that leaves
    the site counts as lost in `impact`, and so does the energy that stems of a forest take.
    `external` is the work of loads and of the ground motion. The change of kinetic + potential +
    elastic equals the sum of these four.
    """

    kinetic: float
    potential: float
    elastic: float
    friction: float
    damping: float
    impact: float
    external: float


class Diagnostics(NamedTuple):
    """Cost and accuracy of the computation so far.

    `penetration` is the greatest depth of a vertex inside another polygon or the terrain [m].
    `relaxed` counts islands whose contact forces were found by relaxation, because they move or
    because open-close iteration did not converge. `compression` is the current compression of
    contacts at rest over the mean block size: the median, or if larger the greatest of plain
    contacts [-]. `seconds` is the processor time of all steps so far [s].
    """

    steps: int
    open_close_iterations: int
    relaxed: int
    sweeps: int
    solves: int
    solver_iterations: int
    contacts: int
    penetration: float
    compression: float
    seconds: float


def contact_table(scene: Scene, c: Contacts) -> NDArray[np.void]:
    """Return the contacts of a step as a structured array, see `CONTACT_TABLE`."""
    c = c[(c["kind"] != BOLT) & (c["kind"] != PIN)]
    out = np.zeros(len(c), dtype=CONTACT_TABLE)
    blocks = len(scene.blocks)
    number = np.array([*range(blocks), *(blocks + i for i in scene.bodies), -1])
    out["block_a"], out["block_b"] = number[c["a"]], number[c["b"]]
    for name in ("x", "y", "nx", "ny"):
        out[name] = c[name]
    closed = c["state"] != OPEN
    out["normal_force"] = np.where(closed, c["normal"], 0.0)
    out["shear_force"] = np.where(closed, c["shear"], 0.0)
    out["state"] = STATES[c["state"]]
    out["penetration"] = np.maximum(-c["gap"], 0.0)
    return out


def support_forces(arrays: Arrays, c: Contacts) -> Floats:
    """Return the force of each support on its (first) block, (S, 2) [N]."""
    c = c[c["kind"] == PIN]
    out = bolt_forces(arrays)
    fx = c["normal"] * c["nx"] - c["shear"] * c["ny"]
    fy = c["normal"] * c["ny"] + c["shear"] * c["nx"]
    out[-1 - c["key"]] = np.stack([fx, fy], axis=1)
    return out[np.argsort(arrays.links["number"])]


def bolt_forces(arrays: Arrays) -> Floats:
    """Return the force of each bolt on its first block, (S, 2) [N], in the order of the links.

    The force is 0 for pins.
    """
    out = np.zeros((len(arrays.links), 2))
    pull_of_bolts(arrays.bodies, arrays.links, out)
    return out * arrays.links["sign"][:, None]


def elastic_energy(arrays: Arrays, c: Contacts) -> float:
    """Return the energy currently stored in bolts and plain contacts [J]."""
    links = arrays.links
    if len(links) + len(c) == 0:
        return 0.0
    bolts = links["kind"] == BOLT
    pull = bolt_forces(arrays)[bolts]
    total = 0.5 * ((pull**2).sum(axis=1) / links["stiffness"][bolts]).sum()
    c = c[(c["kind"] == PLAIN) & (c["state"] != OPEN)]
    return float(total + 0.5 * (c["stiffness"] * np.minimum(c["gap"], 0.0) ** 2).sum())


def energies(scene: Scene, arrays: Arrays, c: Contacts, ledger: Floats, before: float) -> Energy:
    """Return the current energies of all free bodies and the work done on them so far.

    `before` is the elastic energy at the start [J].
    """
    b, n = arrays.bodies, arrays.parameters[0].blocks
    free = b["status"][:n] != FIXED
    speed = b["vx"][:n] ** 2 + b["vy"][:n] ** 2
    kinetic = 0.5 * (b["mass"][:n] * speed + b["inertia"][:n] * b["omega"][:n] ** 2)
    gx, gy = scene.gravity_vector
    potential = -b["mass"][:n] * (gx * b["x"][:n] + gy * b["y"][:n])
    work = dict(zip(LEDGER, ledger.tolist(), strict=True))
    elastic = elastic_energy(arrays, c)
    return Energy(
        float(kinetic[free].sum()),
        float(potential[free].sum()),
        elastic,
        work["friction"],
        work["damping"],
        work["impact"] + work["links"] + elastic - before,
        work["external"],
    )


def diagnosed(
    arrays: Arrays, c: Contacts, count: Ints, deepest: float, seconds: float
) -> Diagnostics:
    """Return the diagnostics of a computation from its counters and its processor time [s]."""
    return Diagnostics(
        int(count[STEPS]),
        int(count[ITERATIONS]),
        int(count[RELAXED]),
        int(count[SWEEPS]),
        int(count[SOLVES]),
        int(count[SOLVER_ITERATIONS]),
        int(count[CONTACT_TOTAL]),
        deepest,
        compression(arrays, c),
        seconds,
    )


def compression(arrays: Arrays, c: Contacts) -> float:
    """Return the current compression of contacts at rest over the mean block size [-].

    The median is used, because an impact may load single contacts for one step; of plain contacts,
    which all have the same stiffness, the greatest is used.
    """
    b = arrays.bodies
    quiet = np.hypot(b["vx"], b["vy"]) + np.abs(b["omega"]) * b["radius"] < SLEEP_SPEED
    c = c[(c["state"] != OPEN) & quiet[c["a"]]]
    rest, plain = (c[c["kind"] == kind] for kind in (REST, PLAIN))
    rest, plain = (some["normal"] / some["stiffness"] for some in (rest, plain))
    typical = float(np.median(rest)) if len(rest) else 0.0
    size = arrays.parameters[0].margin / MARGIN_RATIO
    return max(typical, float(plain.max(initial=0.0))) / size


def divergence(arrays: Arrays, contacts: NDArray[np.void], block: int, when: str) -> str:
    """Return a message about a block that moves too fast, and about its most loaded contact."""
    body = arrays.bodies[block]
    speed = ", ".join(f"{body[name]:g}" for name in ("vx", "vy", "omega"))
    told = f"{when}: block {block} moves at ({speed})"
    touching = contacts[(contacts["block_a"] == block) | (contacts["block_b"] == block)]
    if len(touching):
        c = touching[np.argmax(np.abs(touching["normal_force"]))]
        other = c["block_b"] if c["block_a"] == block else c["block_a"]
        told += f", pressed with {c['normal_force']:g} N at ({c['x']:g}, {c['y']:g})"
        told += f" by {'the terrain' if other < 0 else f'block {other}'}"
    if not np.isfinite([body["vx"], body["vy"], body["omega"]]).all():
        return f"{told}; the solver failed, and a smaller dt will not help: try another solver"
    return f"{told}; use a smaller dt"
