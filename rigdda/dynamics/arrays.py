"""Named tuples of arrays passed to the kernels together; see `records` for their fields."""

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
    """Polygons with corners in anticlockwise order, padded to P corners.

    The outlines of all bodies come first, then the convex parts of non-convex bodies. The parts use
    only corners of their body. Edges between two parts lie inside the body and are never a contact
    face.
    """

    polygon: Polygons
    corner: Corners
    local: NDArray[np.void]  # (R, P) of LOCAL: corners in body coordinates


class GroundArrays(NamedTuple):
    """Terrain segments, and bins along x that list the segments above them."""

    segment: NDArray[np.void]  # (S + 1,) of SEGMENT; the last entry only marks the terrain's end
    bin_start: Ints  # (bins + 1,)
    bin_item: Ints
    bin_origin: float
    bin_width: float


class Stems(NamedTuple):
    """Stems of a forest that each block strikes; no rows without a forest."""

    stem: NDArray[np.void]  # (N, K) of STEM in order of chainage, padded with x = inf
    next: Ints  # (N,) first stem that the block has not passed


class World(NamedTuple):
    """The physical contents of a scene."""

    bodies: Bodies
    outlines: Outlines
    ground: GroundArrays
    interfaces: Interfaces
    links: Links
    shaking: Shaking
    stems: Stems


class Totals(NamedTuple):
    """Counters and sums accumulated over a run."""

    counters: NDArray[np.int64]  # see records.COUNTERS
    ledger: Floats  # work by source [J], see records.LEDGER
    deepest: Floats  # (1,) greatest penetration [m]


class Matrix(NamedTuple):
    """The simultaneous equations K d = F of one island of n blocks: block-sparse and symmetric."""

    diagonal: Floats  # (G, 3, 3)
    off: Floats  # (pairs, 3, 3), in block row pair_i and block column pair_j
    pair_i: Ints
    pair_j: Ints
    rhs: Floats  # (G, 3)
    d: Floats  # (G, 3) displacements u0, v0 [m] and r0 [rad]


class Scratch(NamedTuple):
    """Working arrays of the equation solvers."""

    residual: Floats  # (G, 3) vectors of the iterative solvers
    direction: Floats
    product: Floats
    scaled: Floats
    first: Ints  # (G,) leftmost block of a row, or head of its linked list of neighbours
    row: Ints  # (3 G,) index in `factor` of column 0 of a scalar row
    factor: Floats  # Cholesky factor within the skyline
    next: Ints  # (2 pairs,) next entry in a linked list of neighbours, -1 at its end


class Boxes(NamedTuple):
    """Swept bounding boxes of the bodies, and the pairs of bodies whose boxes overlap."""

    swept: NDArray[np.void]  # (M,) of BOX
    row: NDArray[np.void]  # (M,) the same boxes sorted by low_x; the order is kept between steps
    pairs: Ints  # (2 C,) candidate pairs of bodies
    partner_start: Ints  # (M + 1,) start of each body's entries in `partner`
    partner: Ints  # (C,) second bodies of the pairs, grouped by first body


class Islands(NamedTuple):
    """Blocks and contacts grouped by island."""

    parent: Ints  # (M,) union-find forest
    slot: Ints  # (M,) position of a body within its island
    block_start: Ints  # (M + 1,) start of each island's entries in `block_item`
    block_item: Ints
    contact_start: Ints  # (M + 1,) start of each island's entries in `contact_item`
    contact_item: Ints


class Rows(NamedTuple):
    """Contacts of one island and the motion of its bodies, see `rows`."""

    row: Floats  # (C, COLUMNS)
    fact: Floats  # (C, FACTS)
    form: Ints  # (C,) OF_A, OF_B, BETWEEN
    row_i: Ints  # (C,) slots of bodies a and b
    row_j: Ints
    idle: Ints  # (C,) substep before which a contact cannot close
    active: Ints  # (C,) rows of the contacts that may close in this substep
    visit: Ints  # (C,) contacts visited by a sweep
    place: Ints  # (C,) row of each contact
    face: Ints  # (C,) 2 if a row is solved together with the next one, 0 for the latter, else 1
    height: Floats  # (C,) of each contact [m]; in `position_correction` the excess gap of each row
    layer: Ints  # (contacts + 1,) number of contacts below a height
    moved_in: Ints  # (G + 1,) last sweep in which a slot moved
    scale: Floats  # (G + 1, 3) inverse square roots of the inertia of each slot
    slot: Floats  # (G + 1, SLOT_COLUMNS); the last one stands for everything that does not move


class Work(NamedTuple):
    """Working arrays of a step, grouped so that each kernel receives only those that it uses."""

    boxes: Boxes
    islands: Islands
    rows: Rows
    matrix: Matrix
    scratch: Scratch
    first: Ints  # (M + 1,) first contact of each body a in the last step
    begin: Ints  # (M + 1,) the same for the current step


class Monitors(NamedTuple):
    """Quantities that are recorded during a run."""

    station: NDArray[np.void]  # (K,) of STATION, in ascending order
    rock: NDArray[np.void]  # (N,) of WATCHED
    target: NDArray[np.void]  # (B,) of TARGET
    barrier: Ints  # (M,) index of the barrier that a body is; -1 for rock
    push: Floats  # (B, 2) downhill impulse in this step, LEANING and STRIKING [N s]
    impulse: Floats  # (B, K, 2) the same in each of the last K steps, which span a second [N s]
    mean: Floats  # (B, 2) thrust averaged over these steps [N]
    last_touch: Floats  # (G, B) time of the last contact with each barrier [s]
    watch_low: float  # interval of x in which energies are recorded [m]
    watch_high: float
    leave: float  # x beyond which moving blocks may be ignored [m]; -inf: do not end the run early
    event: NDArray[np.void]
