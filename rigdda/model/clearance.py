"""Clear space of a scene: nothing starts in something else, barriers stand one behind the other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from rigdda.errors import BadInput
from rigdda.model.apart import check_apart, deepest, in_ground
from rigdda.model.block import Block
from rigdda.model.terrain import Terrain

if TYPE_CHECKING:
    from rigdda.model.scene import Scene


def check_blocks(blocks: Sequence[Block]) -> None:
    """Check that there is a free block and that blocks are apart.

    Raises
    ------
    BadInput
        If there is none, or two share too much.
    """
    if not any(not b.fixed for b in blocks):
        raise BadInput("blocks", f"{len(blocks)} blocks", "give at least one free block")
    check_apart([b.vertices for b in blocks], [b.fixed for b in blocks])


def check_clear(scene: Scene, ground: Terrain) -> None:
    """Check that no free block starts deep in the ground or in what stands on it.

    Raises
    ------
    BadInput
        If one does.
    """
    free = {i: block.vertices for i, block in enumerate(scene.blocks) if not block.fixed}
    found = in_ground(ground, list(free.values()))
    if found is not None:
        i = list(free)[found.block]
        mend = f"raise it: {found.shared:.3g} m2 of it are in the ground"
        raise BadInput(f"blocks[{i}]", scene.blocks[i].vertices.tolist(), mend)
    for j in scene.bodies:
        found = deepest(scene.outline(j), list(free.values()))
        if found is not None:
            i = list(free)[found.block]
            mend = f"move it: {found.shared:.3g} m2 of block {i} are in it"
            raise BadInput(f"barriers[{j}].x", scene.barriers[j].x, mend)


def check_order(scene: Scene) -> None:
    """Check that every barrier which is a body stands downhill of where the one before it ends.

    Raises
    ------
    BadInput
        If one does not.
    """
    upright = sorted(scene.bodies, key=lambda i: scene.barriers[i].x)
    for i, j in pairwise(upright):
        end = scene.barriers[i].end
        if scene.barriers[j].x < end - 1e-9 * max(1.0, abs(end)):
            mend = f"put it downhill of x = {end:g}, where barriers[{i}] ends"
            raise BadInput(f"barriers[{j}].x", scene.barriers[j].x, mend)
