"""Supports of blocks: the paper's fixed point and rock bolt.

What they do is computed in `rigdda.dynamics.contact.links`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigdda import fields
from rigdda.errors import BadInput


@dataclass(frozen=True, slots=True)
class FixedPoint:
    """A point of a block that stays where it is; the block may turn about it.

    Parameters
    ----------
    block : int
        Index of the block.
    point : (x, y)
        The point at the start [m].

    Raises
    ------
    BadInput
        If a value is not a finite number.
    """

    block: int
    point: tuple[float, float]

    def __post_init__(self) -> None:
        fields.set_integers("fixed point", self, "block")
        fields.set_vectors("fixed point", self, "point")


@dataclass(frozen=True, slots=True)
class Bolt:
    """A rock bolt: a spring between two blocks, or between a block and the ground.

    Parameters
    ----------
    block_a, point_a : int, (x, y)
        Block at one end and where it is anchored at the start [m].
    block_b, point_b : int or None, (x, y)
        The other end; None: anchored in the ground.
    stiffness : float
        Tension per elongation, per metre of slope width [N/m].
    prestress : float
        Tension at the start [N].
    yield_force : float or None
        Tension at which it yields, perfectly plastic [N]; None: never.

    Raises
    ------
    BadInput
        If a value is not finite or out of its range, or both ends are at one point or block.
    """

    block_a: int
    point_a: tuple[float, float]
    block_b: int | None
    point_b: tuple[float, float]
    stiffness: float
    prestress: float = 0.0
    yield_force: float | None = None

    def __post_init__(self) -> None:
        fields.set_integers("bolt", self, "block_a")
        if self.block_b is not None:
            fields.set_integers("bolt", self, "block_b")
            if self.block_b == self.block_a:
                raise BadInput("bolt: block_b", self.block_b, "give another block than block_a")
        fields.set_vectors("bolt", self, "point_a", "point_b")
        if math.dist(self.point_a, self.point_b) < 1e-6:
            raise BadInput("bolt: point_b", self.point_b, "put it apart from point_a")
        fields.set_number(self, "stiffness", 0.0, open_low=True, field="bolt: stiffness")
        fields.set_number(self, "prestress", 0.0, field="bolt: prestress")
        if self.yield_force is not None:
            fields.set_number(self, "yield_force", self.prestress, field="bolt: yield_force")


Support = FixedPoint | Bolt
