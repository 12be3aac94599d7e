"""Space for contacts, for the equations of an island, and for what a step works on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Boxes, Islands, Matrix, Rows, Scratch, Work
from rigdda.dynamics.records import BOX, CONTACT, Contacts
from rigdda.dynamics.rows import COLUMNS, FACTS, SLOT_COLUMNS

MOST_BANDWIDTH = 64
"""Blocks to the left of the diagonal, on average, up to which a skyline is kept room for."""


def empty_contacts(room: int) -> Contacts:
    """Return space for `room` contacts."""
    return np.zeros(room, dtype=CONTACT).view(np.recarray)


def empty_matrix(blocks: int, room: int) -> Matrix:
    """Return space for the equations of an island of all blocks."""
    return Matrix(
        np.zeros((blocks, 3, 3)),
        np.zeros((room, 3, 3)),
        np.zeros(room, dtype=np.int64),
        np.zeros(room, dtype=np.int64),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
    )


def empty_scratch(blocks: int, room: int) -> Scratch:
    """Return space for the solvers of these equations."""
    return Scratch(
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros((blocks, 3)),
        np.zeros(blocks, dtype=np.int64),
        np.zeros(3 * blocks, dtype=np.int64),
        np.zeros(profile_room(blocks)),
        np.zeros(2 * room, dtype=np.int64),
    )


def profile_room(blocks: int) -> int:
    """Return the entries of a skyline that are kept room for; longer ones are not factorised."""
    return 9 * blocks * min(blocks, MOST_BANDWIDTH)


def empty_work(bodies: int, blocks: int, room: int) -> Work:
    """Return the scratch arrays of a step."""

    def whole(n: int) -> NDArray[np.int64]:
        return np.zeros(n, dtype=np.int64)

    row = np.zeros(bodies, BOX).view(np.recarray)
    row["body"] = np.arange(bodies)
    return Work(
        Boxes(
            swept=row.copy(),
            row=row,
            pairs=whole(2 * room),
            partner_start=whole(bodies + 1),
            partner=whole(room),
        ),
        Islands(
            parent=whole(bodies),
            slot=whole(bodies),
            block_start=whole(bodies + 1),
            block_item=whole(bodies),
            contact_start=whole(bodies + 1),
            contact_item=whole(room),
        ),
        Rows(
            row=np.zeros((room, COLUMNS)),
            fact=np.zeros((room, FACTS)),
            form=whole(room),
            row_i=whole(room),
            row_j=whole(room),
            idle=whole(room),
            visit=whole(room),
            place=whole(room),
            height=np.zeros(room),
            layer=whole(room + 1),
            moved_in=whole(blocks + 1),
            scale=np.zeros((blocks + 1, 3)),
            slot=np.zeros((blocks + 1, SLOT_COLUMNS)),
        ),
        empty_matrix(blocks, room),
        empty_scratch(blocks, room),
        first=whole(bodies + 1),
        begin=whole(bodies + 1),
    )
