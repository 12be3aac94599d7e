"""The loose rock of a site: a mass cut by joint sets, or blocks as they are."""

from __future__ import annotations

import msgspec
import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda import check
from rigdda.errors import BadInput
from rigdda.geometry import overlap
from rigdda.joints import JointSet, cut
from rigdda.scene import convex_polygon, simple_polygon

Point = tuple[float, float]
Floats = NDArray[np.float64]

NEAR = 1e-6
"""Depth to which rock may reach into other rock or the ground at the start [m]: rounding."""

DENSEST = 1e5
"""Greatest density [kg/m3], far above any metal's."""

MOST_BLOCKS = 1e5
"""Most blocks that a mass may be cut into: more would take days to simulate."""


class Source(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rock that comes down: a jointed mass, or blocks that are the same in every release.

    Parameters
    ----------
    polygon : sequence of (x, y)
        Corners of a convex mass [m], cut by at least two sets of `joints` into blocks whose mean
        area is `block_area` [m2].
    blocks : sequence of sequences of (x, y)
        Corners of each block [m], instead of the polygon and its joints.
    density : float
        Density [kg/m3].
    surface : str
        Name of its surface.

    Raises
    ------
    BadInput
        If a value is outside its range, blocks overlap, or there is not one of the two.
    """

    polygon: tuple[Point, ...] = ()
    joints: tuple[JointSet, ...] = ()
    blocks: tuple[tuple[Point, ...], ...] = ()
    block_area: float = 2.0
    density: float = 2600.0
    surface: str = "rock"

    def __post_init__(self) -> None:
        check.number("source.block_area", self.block_area, 0.0, open_low=True)
        check.number("source.density", self.density, 0.0, DENSEST, open_low=True)
        if self.blocks:
            self._check_blocks()
            return
        convex_polygon("source.polygon", self.polygon)
        rock = self.area
        least = rock / MOST_BLOCKS
        if not least <= self.block_area <= rock:
            mend = f"give {least:g} to {rock:g} m2: the mass has {rock:g} m2"
            raise BadInput("source.block_area", self.block_area, mend)
        if len({j.dip_deg for j in self.joints}) < 2:
            raise BadInput("source.joints", self.joints, "give at least two sets of different dip")

    def _check_blocks(self) -> None:
        if self.polygon or self.joints:
            raise BadInput(
                "source.blocks",
                f"{len(self.blocks)} blocks",
                "leave them out, or the polygon and its joints",
            )
        rocks = [shapely.Polygon(simple_polygon(where, b)) for where, b in self.pieces()]
        for i, j in shapely.STRtree(rocks).query(rocks, predicate="intersects").T:
            common = overlap(rocks[i], rocks[j]) if i < j else 0.0
            if common > NEAR * rocks[j].length:
                raise BadInput(
                    f"source.blocks[{j}]",
                    self.blocks[j],
                    f"move it: {common:g} m2 of it are in block {i}",
                )

    def pieces(self) -> list[tuple[str, tuple[Point, ...]]]:
        """Return the name in the file and the corners [m] of each polygon."""
        if self.blocks:
            return [(f"source.blocks[{i}]", block) for i, block in enumerate(self.blocks)]
        return [("source.polygon", self.polygon)]

    @property
    def outline(self) -> Floats:
        """Corners of the convex hull of all rock, (n, 2) [m]."""
        corners = shapely.MultiPoint([point for _, piece in self.pieces() for point in piece])
        return np.array(corners.convex_hull.exterior.coords)[:-1]

    @property
    def area(self) -> float:
        """Area of all rock [m2]."""
        return float(sum(shapely.Polygon(piece).area for _, piece in self.pieces()))

    @property
    def mean_block_area(self) -> float:
        """Mean area of its blocks [m2]."""
        return self.area / len(self.blocks) if self.blocks else self.block_area

    def draw(self, rng: np.random.Generator) -> list[Floats]:
        """Return the corners of the blocks of a release [m]; `rng` draws the joints."""
        if self.blocks:
            return [np.array(block) for block in self.blocks]
        return cut(shapely.Polygon(self.polygon), self.joints, self.block_area, rng)
