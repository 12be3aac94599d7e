"""Sources of loose rock: a band of blocks, a mass cut by joint sets, or surveyed blocks."""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple

import msgspec
import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda import check, fields
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.geometry import overlap, without_straight_corners
from rigdda.model.block import convex_polygon, simple_polygon
from rigdda.model.joints import JointSet, cut, spaced_area

Point = tuple[float, float]
Floats = NDArray[np.float64]

ALLOWED_OVERLAP = 1e-6
"""Depth to which rock may overlap other rock or the ground at the start [m]; allows for
rounding."""

LIGHTEST, DENSEST = 500.0, 1e5
"""Least and greatest density [kg/m3]. Pumice has 600; a value such as 2.65 is in t/m3."""

MOST_BLOCKS = 1e5
"""Maximum number of blocks of a mass; more would take days to simulate."""


BlockArea = Annotated[float, about(gt=0.0)]
Edge = Annotated[float, about(ge=0.01, le=30.0)]
Corners = Annotated[int, about(ge=4, le=12)]
Ratio = Annotated[float, about(ge=1.0, le=4.0)]
Speed = Annotated[float, about(ge=0.0, le=50.0)]


class Shape(NamedTuple):
    """Outline of blocks: ranges of the number of corners and of length over breadth."""

    corners: tuple[int, int]
    aspect: tuple[float, float]


SHAPES = {
    "cube": Shape((4, 4), (1.0, 1.2)),
    "prism": Shape((4, 6), (1.5, 2.5)),
    "slab": Shape((4, 6), (2.5, 4.0)),
    "disc": Shape((9, 12), (1.0, 1.2)),
}
"""Shapes of blocks by name, as they are seen along the road."""

USUAL_SHAPE = Shape((5, 8), (1.0, 1.5))
"""Outline of blocks without a named shape."""


@documented
class Source(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A source of rock: a band of loose blocks, a jointed mass, or surveyed blocks.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, blocks overlap, or not exactly one of
        `band`, `polygon` and `blocks` is given.
    """

    name: Annotated[str, about("Name of the source, to which `events` refer.")] = "rock"
    band: Annotated[
        tuple[float, float] | None,
        about(
            "Chainages between which loose blocks lie at random places on the ground. The "
            "events specify their number and size.",
            "m",
        ),
    ] = None
    polygon: Annotated[
        tuple[Point, ...],
        about(
            "Instead of a band, the corners [x, y] of a convex mass of rock. `joints` cut it into "
            "blocks, at their own spacings or to the mean area `block_area`.",
            "m",
        ),
    ] = ()
    joints: Annotated[
        tuple[JointSet, ...],
        about("Joint sets of a mass, at least two with different dips."),
    ] = ()
    blocks: Annotated[
        tuple[tuple[Point, ...], ...],
        about("Instead of a band or a mass, the surveyed corners [x, y] of each block.", "m"),
    ] = ()
    disturbance: Annotated[
        float,
        about(
            "Greatest initial speed of surveyed blocks, in a random direction. The motion of "
            "jointed rock is chaotic, so that even a small speed makes releases differ. With 0, "
            "all releases are identical.",
            "m/s",
            ge=0.0,
            le=1.0,
        ),
    ] = 1e-4
    block_area: Annotated[
        BlockArea | None,
        about(
            "Mean area of the blocks of a jointed mass, which is met within 5 % by scaling the "
            "spacings of all joint sets by one factor. By default the spacings are kept as they "
            "are given. In both cases, blocks of less than 0.35 of the mean area are joined to a "
            "neighbour where the two make a convex block.",
            "m2",
        ),
    ] = None
    density: Annotated[
        float,
        about("Density of the rock, about 2600.", "kg/m3", ge=LIGHTEST, le=DENSEST),
    ] = 2600.0
    surface: Annotated[
        str,
        about(
            "Name of the surface of the rock. It applies to contacts between blocks; contacts of a "
            "block with the ground have the surface of the ground."
        ),
    ] = "rock"
    corners: Annotated[
        tuple[Corners, Corners],
        about("Least and greatest number of corners of a block of a band.", "-", rising=True),
    ] = USUAL_SHAPE.corners
    aspect: Annotated[
        tuple[Ratio, Ratio],
        about("Least and greatest length over breadth of a block of a band.", "-", rising=True),
    ] = USUAL_SHAPE.aspect
    edges: Annotated[
        tuple[Edge, Edge, Edge] | None,
        about(
            "Edges of the box around a measured block of a band, instead of `aspect` and the "
            "`area` of events. Each release uses one of the three faces of the box at random.",
            "m",
        ),
    ] = None
    shape: Annotated[
        str | None,
        about(
            "Name of the shape of the blocks of a band. It sets those of the ranges `corners` and "
            "`aspect` that are not given. `Site.save` writes these two ranges instead of it.",
            choices=SHAPES,
        ),
    ] = None
    spin: Annotated[
        float,
        about(
            "Greatest initial rate of rotation of a block of a band, in either direction.",
            "rad/s",
            ge=0.0,
            le=20.0,
        ),
    ] = 0.5
    speed: Annotated[
        tuple[Speed, Speed],
        about(
            "Least and greatest initial speed of a block of a band. Its direction is horizontal, "
            "away from the face.",
            "m/s",
            rising=True,
        ),
    ] = (0.2, 1.0)
    array: ClassVar[str] = "sources"

    def __post_init__(self) -> None:
        where = self.words
        left_out = [name for name in Shape._fields if self._is_left_out(name)]
        fields.check(self, f"{where}.")
        if self.shape is not None:
            if self.band is None or self.edges is not None:
                hint = "leave it out: only blocks of a band without edges have a shape"
                raise BadInput(f"{where}.shape", self.shape, hint)
            if not left_out:
                hint = "leave out it or one of corners and aspect: with both, it has no effect"
                raise BadInput(f"{where}.shape", self.shape, hint)
            for name in left_out:
                msgspec.structs.force_setattr(self, name, getattr(SHAPES[self.shape], name))
            msgspec.structs.force_setattr(self, "shape", None)
        if self.edges is not None:
            if self.band is None:
                hint = "leave it out: only blocks of a band have edges"
                raise BadInput(f"{where}.edges", self.edges, hint)
        if self.block_area is not None and not self.polygon:
            hint = "leave it out: only a mass with a polygon is cut to an area"
            raise BadInput(f"{where}.block_area", self.block_area, hint)
        given = [name for name in ("band", "polygon", "blocks") if getattr(self, name)]
        hint = "give exactly one of band, polygon with joints, blocks"
        if not given:
            raise BadInput(f"{where}.polygon", self.polygon, hint)
        if len(given) > 1 or (self.joints and not self.polygon):
            what = given[-1] if len(given) > 1 else "joints"
            raise BadInput(f"{where}.{what}", getattr(self, what), hint)
        if self.band is not None:
            check.interval(f"{where}.band", self.band, open_low=True)
        elif self.blocks:
            self._check_blocks()
        else:
            self._check_mass()
        self._check_unused()

    def _is_left_out(self, name: str) -> bool:
        """Return whether a range of the outline was not given.

        It is then the default itself. A range that is given is another object, even if it is equal.
        """
        return getattr(self, name) is getattr(USUAL_SHAPE, name)

    def _check_unused(self) -> None:
        """Check that no key is given that blocks of this kind do not use.

        A key with its default counts as left out because `Site.save` writes the keys of all kinds.
        """
        unused: dict[str, str] = {}
        if self.band is None:
            reason = "only blocks of a band have it"
            start = "surveyed blocks have a `disturbance`" if self.blocks else "a mass is at rest"
            unused |= dict.fromkeys(("corners", "aspect"), reason)
            unused |= dict.fromkeys(("spin", "speed"), f"{reason}; {start}")
        elif self.edges is not None:
            unused["aspect"] = "the edges of the blocks determine it"
        if not self.blocks:
            unused["disturbance"] = "only surveyed blocks have it"
        for name, reason in unused.items():
            value = getattr(self, name)
            if value != _default(name):
                raise BadInput(f"{self.words}.{name}", value, f"leave it out: {reason}")

    def _check_mass(self) -> None:
        convex_polygon(f"{self.words}.polygon", self.polygon)
        if len({j.dip_deg % 180.0 for j in self.joints}) < 2:  # -90 and 90 are the same
            hint = "give at least two sets with different dips"
            raise BadInput(f"{self.words}.joints", self.joints, hint)
        rock = self.area
        least = rock / MOST_BLOCKS
        if self.block_area is None:
            if self.mean_block_area < least:
                spacings = [joint.spacing for joint in self.joints]
                hint = f"give spacings in metres that make at most {MOST_BLOCKS:g} blocks"
                raise BadInput(f"{self.words}.joints.spacing", spacings, hint)
        elif not least <= self.block_area <= rock:
            hint = f"give {least:g} to {rock:g} m2: the mass has {rock:g} m2"
            raise BadInput(f"{self.words}.block_area", self.block_area, hint)

    def _check_blocks(self) -> None:
        rocks = [shapely.Polygon(simple_polygon(where, b)) for where, b in self.pieces()]
        for i, j in shapely.STRtree(rocks).query(rocks, predicate="intersects").T:
            common = overlap(rocks[i], rocks[j]) if i < j else 0.0
            if common > ALLOWED_OVERLAP * rocks[j].length:
                raise BadInput(
                    f"{self.words}.blocks[{j}]",
                    self.blocks[j],
                    f"move it: {common:g} m2 of it are in block {i}",
                )

    @property
    def words(self) -> str:
        """Path of the source in error messages."""
        return f"{self.array}.{self.name}"

    def pieces(self) -> list[tuple[str, tuple[Point, ...]]]:
        """Return the path in error messages and the corners [m] of each polygon.

        It is empty for a band.
        """
        if self.blocks:
            return [(f"{self.words}.blocks[{i}]", block) for i, block in enumerate(self.blocks)]
        return [(f"{self.words}.polygon", self.polygon)] if self.polygon else []

    @property
    def outline(self) -> Floats:
        """Corners of the convex hull of a mass or of given blocks, (n, 2) [m]."""
        corners = shapely.MultiPoint([point for _, piece in self.pieces() for point in piece])
        return np.array(corners.convex_hull.exterior.coords)[:-1]

    @property
    def area(self) -> float:
        """Area of a mass or of given blocks [m2]; 0 for a band."""
        return float(sum(shapely.Polygon(piece).area for _, piece in self.pieces()))

    @property
    def mean_block_area(self) -> float:
        """Mean area of the blocks of a mass or of given blocks [m2], 0 of a band.

        That of a mass without a `block_area` follows from the spacings of its joints.
        """
        if self.blocks:
            return self.area / len(self.blocks)
        if self.block_area is not None or not self.joints:
            return self.block_area or 0.0
        return min(spaced_area(self.joints), self.area)

    def cut(self, rng: np.random.Generator) -> list[Floats]:
        """Return the corners of the blocks of a mass, cut by random joints, or of given blocks [m].

        Corners within a straight edge, as in surveys, are removed. Bands have no such blocks:
        theirs lie on the ground of a site, see `rigdda.model.loose_blocks`.
        """
        if self.blocks:
            return [without_straight_corners(np.array(block)) for block in self.blocks]
        return cut(shapely.Polygon(self.polygon), self.joints, self.block_area, rng)

    def disturbed(self, rng: np.random.Generator, count: int) -> list[tuple[float, float, float]]:
        """Return the initial velocities of `count` blocks [m/s, m/s, rad/s].

        Given blocks have a random velocity, so that releases differ; blocks of a mass have none.
        """
        if not self.blocks or self.disturbance == 0.0:
            return [(0.0, 0.0, 0.0)] * count
        speeds = self.disturbance * rng.random(count)
        angles = 2.0 * math.pi * rng.random(count)
        return [
            (v * math.cos(a), v * math.sin(a), 0.0) for v, a in zip(speeds, angles, strict=True)
        ]


@cache
def _default(name: str) -> Any:
    """Return the default of a field of a source."""
    return next(f.default for f in msgspec.structs.fields(Source) if f.name == name)
