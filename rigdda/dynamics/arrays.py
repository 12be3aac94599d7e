"""Arrays that kernels are handed together, as named tuples of arrays of records: see `records`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.records import (
    Bodies,
    Corners,
    Floats,
    Interfaces,
    Ints,
    Links,
    Polygons,
    Shaking,
)


class Outlines(NamedTuple):
    """Polygons, anticlockwise and padded to P: bodies, then convex parts of non-convex bodies.

    Parts have corners of their body only; an edge inside the body is never a face of contact.
    """

    polygon: Polygons
    corner: Corners
    local: NDArray[np.void]  # (R, P) of LOCAL: the corners in body coordinates


class GroundArrays(NamedTuple):
    """Terrain segments with bins along x that list those above them."""

    segment: NDArray[np.void]  # (S + 1,) of SEGMENT; the last is only where the one before ends
    bin_start: Ints  # (bins + 1,)
    bin_item: Ints
    bin_origin: float
    bin_width: float


class World(NamedTuple):
    """What there is in a scene."""

    bodies: Bodies
    outlines: Outlines
    ground: GroundArrays
    interfaces: Interfaces
    links: Links
    shaking: Shaking


class Totals(NamedTuple):
    """What is counted and added up over a run."""

    counters: NDArray[np.int64]  # see records.COUNTERS
    ledger: Floats  # work by what does it [J], see records.LEDGER
    deepest: Floats  # (1,) greatest penetration [m]


class Matrix(NamedTuple):
    """The simultaneous equations K d = F of one island: n blocks, block-sparse, symmetric."""

    diagonal: Floats  # (G, 3, 3)
    off: Floats  # (pairs, 3, 3) row block pair_i, column block pair_j
    pair_i: Ints
    pair_j: Ints
    rhs: Floats  # (G, 3)
    d: Floats  # (G, 3) displacements u0, v0 [m], r0 [rad]


class Scratch(NamedTuple):
    """What the solvers of the equations work on."""

    residual: Floats  # (G, 3) vectors of the iterations
    direction: Floats
    product: Floats
    scaled: Floats
    first: Ints  # (G,) leftmost block of a row, or head of its chain of neighbours
    row: Ints  # (3 G,) place in `factor` of column 0 of a scalar row
    factor: Floats  # Cholesky factor within the profile
    next: Ints  # (2 pairs,) next entry in a chain of neighbours, -1 at its end


class Boxes(NamedTuple):
    """Swept boxes of the bodies, and the pairs of bodies whose boxes overlap."""

    swept: NDArray[np.void]  # (M,) of BOX
    row: NDArray[np.void]  # (M,) the same in order of low_x, kept over steps
    pairs: Ints  # (2 C,) candidate pairs of bodies
    partner_start: Ints  # (M + 1,) second bodies of the pairs by their first one
    partner: Ints  # (C,)


class Islands(NamedTuple):
    """Blocks and contacts island by island."""

    parent: Ints  # (M,) union-find
    slot: Ints  # (M,) place of a body in its island's matrix
    block_start: Ints  # (M + 1,) blocks of each island
    block_item: Ints
    contact_start: Ints  # (M + 1,) contacts of each island
    contact_item: Ints


class Rows(NamedTuple):
    """Contacts of one island and the motion of its bodies, see `rows`."""

    row: Floats  # (C, COLUMNS)
    fact: Floats  # (C, FACTS)
    form: Ints  # (C,) OF_A, OF_B, BETWEEN
    row_i: Ints  # (C,) slots of their bodies
    row_j: Ints
    idle: Ints  # (C,) substep until which a contact cannot close
    visit: Ints  # (C,) contacts that a sweep visits
    place: Ints  # (C,) row of each contact
    height: Floats  # (C,) of each contact [m]; in `recovery` the excess gap of each row
    layer: Ints  # (contacts + 1,) contacts below a height
    moved_in: Ints  # (G + 1,) last sweep in which a slot moved
    scale: Floats  # (G + 1, 3) inverse roots of the inertia of each slot
    slot: Floats  # (G + 1, SLOT_COLUMNS); the last of what does not move


class Work(NamedTuple):
    """Scratch arrays of a step, by what they are for: kernels are handed no more than they use."""

    boxes: Boxes
    islands: Islands
    rows: Rows
    matrix: Matrix
    scratch: Scratch
    first: Ints  # (M + 1,) first contact of each body a in the last step
    begin: Ints  # (M + 1,) the same in this step


class Monitors(NamedTuple):
    """What is watched during a run."""

    station: NDArray[np.void]  # (K,) of STATION, ascending
    rock: NDArray[np.void]  # (N,) of WATCHED
    target: NDArray[np.void]  # (B,) of TARGET
    barrier: Ints  # (M,) barrier that a body is, -1: rock
    push: Floats  # (B, 2) impulse downhill, in this step, of what leans and what strikes [N s]
    impulse: Floats  # (B, K, 2) that in the last K steps, which are a second [N s]
    mean: Floats  # (B, 2) thrust, mean over these [N]
    last_touch: Floats  # (G, B) time of the last touch [s]
    watch_low: float  # interval of x [m]
    watch_high: float
    leave: float  # x beyond which what moves on is left alone [m]; -inf: the run is not ended early
    event: NDArray[np.void]
