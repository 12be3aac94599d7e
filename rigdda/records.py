"""Arrays that the kernels work on: structured arrays, named tuples of arrays. `pack` fills them.

M bodies: the N blocks of the scene, its gravity walls, then its walls and fences. B: barriers. P:
most corners of a body. S: terrain segments. C: room for contacts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _record(**fields: type) -> np.dtype:
    """Return a structured type; one such array is far cheaper to compile than its many columns."""
    return np.dtype(list(fields.items()), align=True)


BODY = _record(
    x=float,  # centroid [m]
    y=float,
    theta=float,  # rotation since the start, unwrapped [rad]
    vx=float,  # [m/s]
    vy=float,
    omega=float,  # [rad/s]
    mass=float,  # per metre of width [kg]
    inertia=float,  # about the centroid [kg m2]
    radius=float,  # of the circumscribed circle about the centroid [m]
    quiet=float,  # time it has been quiet [s]
    count=int,  # corners
    surface=int,  # index of the surface
    status=int,  # AWAKE, ASLEEP, FIXED, RETIRED
    island=int,  # island in which a sleeping body fell asleep
    touching=int,  # 1 if a contact was closed in the last step
    wait=int,  # steps until its island is solved as a whole again
)
"""State of a body. Angle and body coordinates are the state, so area is kept."""

CONTACT = _record(
    a=int,  # block
    b=int,  # body or TERRAIN; the normal points to a
    key=int,  # vertex and its owner, the same over steps
    owner=int,  # 1: the vertex belongs to a, 0: to b
    other=int,  # surface of b
    x=float,  # the vertex [m]
    y=float,
    nx=float,
    ny=float,
    gap=float,  # positive is open [m]
    ra_x=float,  # arms from the centroids when the force acts [m]
    ra_y=float,
    rb_x=float,
    rb_y=float,
    un=float,  # normal and shear relative velocity at the start [m/s], positive separates
    us=float,
    friction=float,  # tan phi
    restitution=float,
    passing=float,  # closing velocity if the fence it is with were not there [m/s]
    stiffness=float,  # of the contact at rest [N/m]
    kappa=float,  # in this step [N/m]
    bias=float,  # displacement at which the spring is free [m], see contact.law
    share=float,  # share of the step that remains when an impact acts
    memory_normal=float,  # forces carried over from the last step [N]
    memory_shear=float,
    steady=float,  # part of the carried normal force that lasts [N]
    normal=float,  # force of this step [N], on a
    shear=float,
    lag=float,  # shear force of a slipping contact in the current iteration [N]
    state=int,  # OPEN, STICK, SLIP
    kind=int,  # REST, NEW, IMPACT, SHOCK
    flips=int,
    pair=int,  # off-diagonal block of the pair of bodies, -1: no coupling
)
"""One contact in one step."""

Bodies = NDArray[np.void]
"""(M,) array of BODY."""
Contacts = NDArray[np.void]
"""(C,) array of CONTACT."""


class Outlines(NamedTuple):
    """Corners of bodies, anticlockwise and padded to P."""

    body_x: Floats  # (M, P) about the centroid at theta = 0 [m]
    body_y: Floats
    world_x: Floats  # (M, P) now [m]
    world_y: Floats
    normal_x: Floats  # (M, P) outward unit normal of the edge that starts at the corner
    normal_y: Floats


class Ground(NamedTuple):
    """Terrain segments with bins along x that list those above them."""

    x: Floats  # (S + 1,) corners [m]
    y: Floats
    normal_x: Floats  # (S,) unit normal out of the ground
    normal_y: Floats
    length: Floats  # (S,) [m]
    turn: Floats  # (S + 1,) turn at a corner [rad], positive concave, 0 at the ends
    surface: Ints  # (S,)
    bin_start: Ints  # (bins + 1,)
    bin_item: Ints
    bin_origin: float
    bin_width: float


class Matrix(NamedTuple):
    """Block-sparse symmetric system of one island: n blocks, 3x3 each."""

    diagonal: Floats  # (N, 3, 3), N with the gravity walls
    off: Floats  # (pairs, 3, 3) row block pair_i, column block pair_j
    pair_i: Ints
    pair_j: Ints
    rhs: Floats  # (N, 3)
    d: Floats  # (N, 3) displacements: u0, v0 [m], r0 [rad]
    residual: Floats  # (N, 3) and the vectors of conjugate gradients
    direction: Floats
    product: Floats
    scaled: Floats


class Work(NamedTuple):
    """Scratch arrays of a step."""

    low_x: Floats  # (M,) swept boxes [m]
    high_x: Floats
    low_y: Floats
    high_y: Floats
    sorted: Ints  # (M,) bodies by low_x, kept over steps
    pairs: Ints  # (2 C,) candidate pairs of bodies
    parent: Ints  # (M,) union-find
    slot: Ints  # (M,) place of a body in its island's matrix
    block_start: Ints  # (M + 1,) blocks of each island
    block_item: Ints
    contact_start: Ints  # (M + 1,) contacts of each island
    contact_item: Ints
    first: Ints  # (M + 1,) contacts of the last step by body a
    row: Floats  # (C, columns) contacts of one island, see linear.psor
    row_i: Ints  # (C,) slots of their bodies, -1: no unknowns
    row_j: Ints


class Gauges(NamedTuple):
    """What is watched during a run."""

    station: Floats  # (K,) ascending chainages [m]
    station_ground: Floats  # (K,) elevation of the highest ground there [m]
    next_station: Ints  # (N,) first station a block has not passed
    barrier: Ints  # (M,) barrier that a body is, -1: rock
    capacity: Floats  # (B,) energy that a barrier absorbs before it fails [J], inf: it does not
    fences: int  # barriers that can fail
    barrier_ground: Floats  # (B,) elevation from which impact heights count [m]
    last_touch: Floats  # (N, B), N with the gravity walls: time of the last touch [s]
    absorbed: Floats  # (B,) [J]
    watch: Floats  # (2,) interval of x
    watch_energy: Floats  # (N,) largest energy in it [J]
    event: NDArray[np.void]


class Parameters(NamedTuple):
    """Numbers of the scene and the settings."""

    blocks: int  # bodies that may move: the blocks of the scene and its gravity walls
    dt: float
    gravity: float
    damping: float
    damping_in_contact_only: bool
    block_weight: float  # mean of the free blocks [N]
    penetration: float
    slack: float
    tolerance: float
    iterations: int
    sleeping: bool
    floor: float  # a centroid below it is retired [m]
    friction: Floats  # (surfaces, surfaces) tan phi
    restitution: Floats


LEDGER = ("friction", "impact", "damping", "gravity")
"""Work done on the blocks so far [J]: entries of the ledger array."""

COUNTERS = (
    "steps",
    "open_close_iterations",
    "relaxed_islands",
    "solves",
    "solver_iterations",
    "contacts",
    "events",
    "contact_total",
    "sweeps",
)
"""Entries of the counter array."""
