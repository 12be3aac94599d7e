"""Loads on blocks: the paper's point load, line load and body force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import fields

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PointLoad:
    """A dead force on a point of a block: its direction stays, the point moves with the block.

    Parameters
    ----------
    block : int
        Index of the block.
    point : (x, y)
        Where it acts at the start [m].
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
        fields.set_integers("point load", self, "block")
        fields.set_vectors("point load", self, "point", "force")

    def resultant(self, area: float, centre: Floats) -> tuple[Floats, Floats]:
        """Return the force [N] and where it acts [m] on a block of `area` and `centre`."""
        return np.array(self.force), np.array(self.point)


@dataclass(frozen=True, slots=True)
class LineLoad:
    """A dead load spread evenly over a line of a block.

    Parameters
    ----------
    block : int
        Index of the block.
    start, end : (x, y)
        Ends of the line at the start [m].
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
        fields.set_integers("line load", self, "block")
        fields.set_vectors("line load", self, "start", "end", "force_per_length")

    def resultant(self, area: float, centre: Floats) -> tuple[Floats, Floats]:
        """Return the force [N] and where it acts [m] on a block of `area` and `centre`."""
        start, end = np.array(self.start), np.array(self.end)
        length = float(np.hypot(*(end - start)))
        return length * np.array(self.force_per_length), 0.5 * (start + end)


@dataclass(frozen=True, slots=True)
class BodyForce:
    """A dead force spread evenly over the area of a block, beside its weight.

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
        fields.set_integers("body force", self, "block")
        fields.set_vectors("body force", self, "force_per_area")

    def resultant(self, area: float, centre: Floats) -> tuple[Floats, Floats]:
        """Return the force [N] and where it acts [m] on a block of `area` and `centre`."""
        return area * np.array(self.force_per_area), centre


Load = PointLoad | LineLoad | BodyForce
