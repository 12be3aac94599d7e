"""Loads on blocks, supports, and acceleration histories of the ground.

The loads are the point load, line load and body force of the paper, the supports its fixed point
and rock bolt. A scene takes them as `Scene(loads=..., supports=...)`.
`rigdda.dynamics.contact.links` computes the effect of supports.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import check
from rigdda.errors import BadInput


def history(value: ArrayLike) -> NDArray[np.float64]:
    """Return a history of ground acceleration as a read-only (m, 3) array."""
    try:
        history = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        history = np.zeros(0)
    if history.ndim != 2 or history.shape[1:] != (3,) or len(history) < 2:
        raise BadInput("base_motion", value, "give at least two rows (time, ax, ay)")
    if not np.isfinite(history).all():
        raise BadInput("base_motion", "NaN or infinity", "give finite numbers")
    if (np.diff(history[:, 0]) < 0.0).any() or history[0, 0] < 0.0:
        raise BadInput("base_motion", "times", "give times >= 0 that do not decrease")
    history.setflags(write=False)
    return history


@dataclass(frozen=True, slots=True)
class FixedPoint:
    """A point of a block that cannot move; the block can rotate about it.

    Parameters
    ----------
    block : int
        Index of the block.
    point : (x, y)
        Initial position of the point [m].

    Raises
    ------
    BadInput
        If a value is not a finite number.
    """

    block: int
    point: tuple[float, float]

    def __post_init__(self) -> None:
        check.set_integers("fixed point", self, "block")
        check.set_vectors("fixed point", self, "point")


@dataclass(frozen=True, slots=True)
class Bolt:
    """A rock bolt: a spring between two blocks, or between a block and the ground.

    Parameters
    ----------
    block_a, point_a : int, (x, y)
        Block at one end, and the initial position of the anchor [m].
    block_b, point_b : int or None, (x, y)
        The other end; None: anchored in the ground.
    stiffness : float
        Tension per elongation, per metre of slope width [N/m].
    prestress : float
        Initial tension [N].
    yield_force : float or None
        Tension at which it yields, perfectly plastic [N]; None: it does not yield.

    Raises
    ------
    BadInput
        If a value is not finite or out of its range, or both ends are on one block or at one point.
    """

    block_a: int
    point_a: tuple[float, float]
    block_b: int | None
    point_b: tuple[float, float]
    stiffness: float
    prestress: float = 0.0
    yield_force: float | None = None

    def __post_init__(self) -> None:
        check.set_integers("bolt", self, "block_a")
        if self.block_b is not None:
            check.set_integers("bolt", self, "block_b")
            if self.block_b == self.block_a:
                raise BadInput("bolt: block_b", self.block_b, "give a block other than block_a")
        check.set_vectors("bolt", self, "point_a", "point_b")
        if math.dist(self.point_a, self.point_b) < 1e-6:
            raise BadInput("bolt: point_b", self.point_b, "put it apart from point_a")
        check.set_number(self, "stiffness", 0.0, open_low=True, field="bolt: stiffness")
        check.set_number(self, "prestress", 0.0, field="bolt: prestress")
        if self.yield_force is not None:
            check.set_number(self, "yield_force", self.prestress, field="bolt: yield_force")


Support = FixedPoint | Bolt


Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PointLoad:
    """A dead load at a point of a block: it keeps its direction and moves with the block.

    Parameters
    ----------
    block : int
        Index of the block.
    point : (x, y)
        Initial position of the point [m].
    force : (fx, fy)
        Force per metre of slope width [N].

    Raises
    ------
    BadInput
        If a value is not a finite number.
    """

    block: int
    point: tuple[float, float]
    force: tuple[float, float]

    def __post_init__(self) -> None:
        check.set_integers("point load", self, "block")
        check.set_vectors("point load", self, "point", "force")

    def resultant(self, area: float, centre: Floats) -> tuple[Floats, Floats]:
        """Return the force [N] and its point of action [m] on a block of `area` and `centre`."""
        return np.array(self.force), np.array(self.point)


@dataclass(frozen=True, slots=True)
class LineLoad:
    """A uniform dead load on a line of a block.

    Parameters
    ----------
    block : int
        Index of the block.
    start, end : (x, y)
        Initial ends of the line [m].
    force_per_length : (fx, fy)
        Force per metre of the line and of slope width [N/m].

    Raises
    ------
    BadInput
        If a value is not a finite number.
    """

    block: int
    start: tuple[float, float]
    end: tuple[float, float]
    force_per_length: tuple[float, float]

    def __post_init__(self) -> None:
        check.set_integers("line load", self, "block")
        check.set_vectors("line load", self, "start", "end", "force_per_length")

    def resultant(self, area: float, centre: Floats) -> tuple[Floats, Floats]:
        """Return the force [N] and its point of action [m] on a block of `area` and `centre`."""
        start, end = np.array(self.start), np.array(self.end)
        length = float(np.hypot(*(end - start)))
        return length * np.array(self.force_per_length), 0.5 * (start + end)


@dataclass(frozen=True, slots=True)
class BodyForce:
    """A uniform dead load on the area of a block, in addition to its weight.

    Parameters
    ----------
    block : int
        Index of the block.
    force_per_area : (fx, fy)
        Force per square metre of the block and per metre of slope width [N/m2].

    Raises
    ------
    BadInput
        If a value is not a finite number.
    """

    block: int
    force_per_area: tuple[float, float]

    def __post_init__(self) -> None:
        check.set_integers("body force", self, "block")
        check.set_vectors("body force", self, "force_per_area")

    def resultant(self, area: float, centre: Floats) -> tuple[Floats, Floats]:
        """Return the force [N] and its point of action [m] on a block of `area` and `centre`."""
        return area * np.array(self.force_per_area), centre


Load = PointLoad | LineLoad | BodyForce
