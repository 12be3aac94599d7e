"""Blocks of rock: polygons with validated, anticlockwise, read-only corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.validation import explain_validity

from rigdda import check
from rigdda.errors import BadInput
from rigdda.geometry import clearly_convex, edges, is_convex


def convex_polygon(where: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of a convex polygon, (n, 2), anticlockwise and read-only.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner, has no area or is not convex.
    """
    corners = simple_polygon(where, value)
    if not is_convex(corners):
        raise BadInput(where, corners.tolist(), "make it convex, or cut it into convex blocks")
    return corners


def simple_polygon(where: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of a simple polygon, (n, 2), anticlockwise and read-only.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner or has no area.
    """
    corners = check.points(where, value, 3)
    if clearly_convex(corners):
        return corners
    polygon = shapely.Polygon(corners)
    if not polygon.is_valid:
        raise BadInput(where, corners.tolist(), f"untangle it: {explain_validity(polygon)}")
    size = polygon.length
    if polygon.area < 1e-9 * size**2:
        raise BadInput(where, corners.tolist(), "give a polygon with a non-zero area")
    short = np.flatnonzero(np.hypot(*edges(corners).T) < 1e-9 * size)
    if short.size:
        raise BadInput(
            f"{where}[{short[0]}]",
            corners[short[0]].tolist(),
            "remove it: the next one repeats it",
        )
    if not polygon.exterior.is_ccw:
        corners = corners[::-1]
    corners = np.ascontiguousarray(corners)
    corners.setflags(write=False)
    return corners


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A rigid block in the shape of a simple polygon, convex or not.

    Parameters
    ----------
    vertices : (n, 2) array_like
        Corners in either orientation [m]; stored anticlockwise.
    density : float
        Density [kg/m3]; the mass is per metre of slope width.
    surface : str
        Name of its surface in the scene.
    velocity : (vx, vy, omega)
        Initial velocity of the centroid and rate of rotation [m/s, m/s, rad/s].
    fixed : bool
        Whether the block cannot move.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner or has no area, or a value is not finite.
    """

    vertices: NDArray[np.float64]
    density: float = 2600.0
    surface: str = "rock"
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fixed: bool = False

    def __init__(
        self,
        vertices: ArrayLike,
        density: float = 2600.0,
        surface: str = "rock",
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        fixed: bool = False,
    ):
        try:
            vx, vy, omega = velocity
        except (TypeError, ValueError):
            raise BadInput("block velocity", velocity, "give (vx, vy, omega)") from None
        vx, vy, omega = (check.number("block velocity", v) for v in (vx, vy, omega))
        if not isinstance(surface, str):
            raise BadInput("block surface", surface, "name a surface of the scene")
        object.__setattr__(self, "vertices", simple_polygon("block vertices", vertices))
        object.__setattr__(
            self, "density", check.number("block density", density, 0.0, open_low=True)
        )
        object.__setattr__(self, "surface", str(surface))
        object.__setattr__(self, "velocity", (vx, vy, omega))
        object.__setattr__(self, "fixed", check.boolean("block fixed", fixed))

    @classmethod
    def sound(
        cls,
        corners: ArrayLike,
        density: float,
        surface: str,
        velocity: tuple[float, float, float],
    ) -> Block:
        """Return a block of valid, finite values without checking them.

        The corners must form a simple polygon, anticlockwise; they are copied. Checks would take
        longer than the rest of drawing a release of one block.
        """
        block = object.__new__(cls)
        vertices = np.array(corners)
        vertices.setflags(write=False)
        object.__setattr__(block, "vertices", vertices)
        object.__setattr__(block, "density", density)
        object.__setattr__(block, "surface", surface)
        object.__setattr__(block, "velocity", velocity)
        object.__setattr__(block, "fixed", False)
        return block
