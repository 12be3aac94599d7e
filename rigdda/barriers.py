"""Protective structures: what a layout is made of.

Walls, gravity walls and fences stand on the ground; ditches and embankments change it. The x of
each is the chainage where it begins for a block that comes down the slope.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.earthworks import regrade, span
from rigdda.errors import BadInput
from rigdda.geometry import polygon_properties
from rigdda.terrain import Terrain

Floats = NDArray[np.float64]

FOUNDATION = 1.0
"""Depth to which walls and fences reach below the lowest ground under them [m]."""

LEAST_SLOPE, FLATTEST_SLOPE = 0.02, 5.0
"""Steepest and flattest side of an earthwork, run over rise [-]."""


class _Barrier(msgspec.Struct, frozen=True, tag_field="kind", forbid_unknown_fields=True):
    """What every barrier has; written as a table with its `kind`."""

    x: float

    @property
    def kind(self) -> str:
        """Name of the kind, as in layout files."""
        return str(type(self).__struct_config__.tag)

    def _check(self, *positive: str) -> None:
        check.number(f"{self.words} x", self.x)
        for name in positive:
            check.number(f"{self.words} {name}", getattr(self, name), 0.0, open_low=True)

    @property
    def words(self) -> str:
        """Name of the kind in words."""
        return self.kind.replace("_", " ")


class Wall(_Barrier, frozen=True, tag="wall"):
    """A rigid retaining wall that stands on the terrain and cannot be moved.

    Parameters
    ----------
    x : float
        Chainage of its uphill face [m].
    height : float
        Height above the highest ground under it [m].
    thickness : float
        Extent downhill of `x` [m].

    Raises
    ------
    BadInput
        If a value is not finite or not above zero.
    """

    height: float
    thickness: float = 1.0

    def __post_init__(self) -> None:
        self._check("height", "thickness")

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed it [m]."""
        return self.x + self.thickness

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        return self.thickness

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners of the wall on `ground`, its foot in it.

        Raises
        ------
        BadInput
            If the wall does not stand on the ground.
        """
        return _upright(self, ground)


class GravityWall(_Barrier, frozen=True, tag="gravity_wall"):
    """A concrete block that stands on the terrain by its weight, and can slide and overturn.

    Its faces are vertical and its top is level. Its base is straight: the chord of the ground
    between its faces or, where that would dip into the ground, the edge of the ground's convex
    hull below its middle.

    Parameters
    ----------
    x : float
        Chainage of its uphill face [m].
    height : float
        Height above the higher end of its base [m].
    thickness : float
        Extent downhill of `x` [m].
    density : float
        Density [kg/m3]; 2400 is plain concrete.

    Raises
    ------
    BadInput
        If a value is not finite or not above zero.
    """

    height: float
    thickness: float = 1.0
    density: float = 2400.0

    def __post_init__(self) -> None:
        self._check("height", "thickness", "density")

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed it where it stood at the start [m]."""
        return self.x + self.thickness

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        return self.thickness

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners at the start, on `ground`.

        Raises
        ------
        BadInput
            If the wall does not stand on the ground.
        """
        x, y = _under(self, ground)
        middle = 0.5 * (x[0] + x[-1])
        ends = [(i, j) for i in range(len(x)) for j in range(i + 1, len(x))]

        def base(pair: tuple[int, int], at: float) -> float:
            i, j = pair
            return float(y[i] + (y[j] - y[i]) * (at - x[i]) / (x[j] - x[i]))

        # of all chords across the middle the highest there is the edge of the convex hull
        over = [pair for pair in ends if x[pair[0]] <= middle <= x[pair[1]]]
        edge = max(over, key=lambda pair: base(pair, middle))
        left, right = base(edge, x[0]), base(edge, x[-1])
        top = max(left, right) + self.height
        return np.array([[x[0], left], [x[-1], right], [x[-1], top], [x[0], top]])


class Fence(_Barrier, frozen=True, tag="fence"):
    """A flexible fence that absorbs energy up to its capacity, then fails.

    Impacts on it are plastic whatever its surface. It takes the work of its contact forces, and
    of a blow on a block at rest against it what that block passes on. When this would exceed what
    is left of the capacity, it fails: the block goes on with the energy that is left, and the
    fence is gone. It stays upright until then; the weight of a pile that leans on it does no work
    and does not break it.

    Parameters
    ----------
    x : float
        Chainage of its uphill face [m].
    height : float
        Height above the highest ground under it [m].
    capacity : float
        Energy that it absorbs before it fails [J per metre of slope width].
    thickness : float
        Extent downhill of `x` [m].

    Raises
    ------
    BadInput
        If a value is not finite or not above zero.
    """

    height: float
    capacity: float
    thickness: float = 0.2

    def __post_init__(self) -> None:
        self._check("height", "capacity", "thickness")

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed it [m]."""
        return self.x + self.thickness

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        return self.thickness

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners of the fence on `ground`, its foot in it.

        Raises
        ------
        BadInput
            If the fence does not stand on the ground.
        """
        return _upright(self, ground)


class Ditch(_Barrier, frozen=True, tag="ditch"):
    """A ditch with a level floor, cut into the terrain. Its surface is that of the terrain.

    Parameters
    ----------
    x : float
        Chainage of its uphill edge [m].
    depth : float
        Depth of the floor below the lower of its edges [m].
    width : float
        Distance of its edges along x [m].
    side_slope : float
        Run over rise of its sides [-]; 0.25 is usual for a cut in rock.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    depth: float
    width: float
    side_slope: float = 0.25

    def __post_init__(self) -> None:
        self._check("depth", "width")
        check.number("ditch side_slope", self.side_slope, LEAST_SLOPE, FLATTEST_SLOPE)

    @property
    def end(self) -> float:
        """Chainage of its downhill edge, beyond which a block has passed it [m]."""
        return self.x + self.width

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope [m]."""
        return self.width

    def outline(self, ground: Terrain) -> Floats:
        """Return the (n, 2) corners of what is dug out of `ground`, as it was before.

        Raises
        ------
        BadInput
            If the ditch does not fit.
        """
        return self._cut(ground, "")[0]

    def build(self, ground: Terrain, surface: str) -> Terrain:
        """Return `ground` with the ditch; `surface`, that of a fill, is not used.

        Raises
        ------
        BadInput
            If the ditch does not fit.
        """
        return self._cut(ground, "")[1]

    def _cut(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        old = span("ditch x", ground, self.x, self.end)
        (left, high), (right, low) = old[0], old[-1]
        floor = min(high, low) - self.depth
        first = left + self.side_slope * (high - floor)
        last = right - self.side_slope * (low - floor)
        if last - first < 1e-6:
            least = first - left + right - last
            raise BadInput(
                "ditch width",
                self.width,
                f"give more than {least:g}, or less depth: its sides meet above its floor",
            )
        line = np.array([[left, high], [first, floor], [last, floor], [right, low]])
        return regrade("ditch x", ground, line, np.minimum, None)


class Embankment(_Barrier, frozen=True, tag="embankment"):
    """A dam of earth with a level crest, raised on the terrain.

    Its surface is "soil" where the scene defines it, else that of the other barriers.

    Parameters
    ----------
    x : float
        Chainage of its uphill toe [m].
    height : float
        Height of the crest above the ground at `x` [m].
    width : float
        Width of the crest [m].
    side_slope : float
        Run over rise of its sides [-]; 0.5 is usual for reinforced earth. The downhill side goes
        on until it meets the ground.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    height: float
    width: float = 1.0
    side_slope: float = 0.5

    def __post_init__(self) -> None:
        self._check("height", "width")
        check.number("embankment side_slope", self.side_slope, LEAST_SLOPE, FLATTEST_SLOPE)

    @property
    def end(self) -> float:
        """Chainage of the downhill edge of its crest, beyond which a block has passed it [m]."""
        return self.x + self.side_slope * self.height + self.width

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        return 2.0 * self.side_slope * self.height + self.width

    def outline(self, ground: Terrain) -> Floats:
        """Return the (n, 2) corners of the fill on `ground`, as it was before.

        Raises
        ------
        BadInput
            If the embankment does not fit.
        """
        return self._fill(ground, "")[0]

    def build(self, ground: Terrain, surface: str) -> Terrain:
        """Return `ground` with the embankment, of a surface of this name.

        Raises
        ------
        BadInput
            If the embankment does not fit.
        """
        return self._fill(ground, surface)[1]

    def _fill(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        base = span("embankment x", ground, self.x, self.end)[0, 1]
        top, toe = base + self.height, self._toe(ground, base + self.height)
        line = np.array(
            [
                [self.x, base],
                [self.x + self.side_slope * self.height, top],
                [self.end, top],
                [toe, top - (toe - self.end) / self.side_slope],
            ]
        )
        return regrade("embankment x", ground, line, np.maximum, surface)

    def _toe(self, ground: Terrain, top: float) -> float:
        """Return the chainage where the downhill side meets the ground [m]."""
        corners = ground.points
        ahead = corners[corners[:, 0] > self.end, 0]
        for x in ahead:
            # ordered along the chain: span refuses what turns back before the side meets it
            piece = span("embankment x", ground, self.end, float(x))
            over = top - (piece[:, 0] - self.end) / self.side_slope - piece[:, 1]
            if over[-1] <= 0.0:
                before, after = max(over[-2], 0.0), over[-1]
                share = before / (before - after) if before > 0.0 else 0.0
                toe = piece[-2, 0] + share * (piece[-1, 0] - piece[-2, 0])
                return max(float(toe), self.end + 1e-6)
        raise BadInput(
            "embankment x",
            self.x,
            "put it where the ground is flatter than its side, which does not meet the ground",
        )


Earthwork = Ditch | Embankment
Standing = Wall | GravityWall | Fence
Barrier = Wall | GravityWall | Fence | Ditch | Embankment
Layout = tuple[Barrier, ...]

KINDS: dict[str, type[Barrier]] = {
    "wall": Wall,
    "gravity_wall": GravityWall,
    "fence": Fence,
    "ditch": Ditch,
    "embankment": Embankment,
}
"""Class of every kind, by its name in layout files."""


def earthworks(
    terrain: Terrain, layout: Iterable[Barrier], surface: str
) -> tuple[Terrain, dict[Barrier, Floats]]:
    """Return the ground with the ditches and embankments of a layout, and what each moved.

    They are built from the crest down, each on the ground that those above it left.

    Parameters
    ----------
    terrain : Terrain
        The natural ground.
    surface : str
        Surface of embankments.

    Returns
    -------
    ground : Terrain
        The ground with them.
    outlines : dict of barrier to (n, 2) array
        Corners of what each digs out or fills in [m].

    Raises
    ------
    BadInput
        If one does not fit.
    """
    outlines: dict[Barrier, Floats] = {}
    for barrier in sorted((b for b in layout if isinstance(b, Earthwork)), key=lambda b: b.x):
        outlines[barrier] = barrier.outline(terrain)
        terrain = barrier.build(terrain, surface)
    return terrain, outlines


def section(outline: Floats) -> float:
    """Return the area of an outline [m2], in whichever direction it is walked."""
    return abs(polygon_properties(outline)[0])


def from_table(where: str, table: Any) -> Barrier:
    """Return the barrier of a table of a layout file, by default a wall.

    Raises
    ------
    BadInput
        If the kind is unknown, a field is unknown, missing or not a number, or a value is outside
        its range; the message names it.
    """
    if not isinstance(table, dict):
        raise BadInput(where, table, "give a table")
    kind = check.one_of(f"{where}.kind", table.get("kind", "wall"), KINDS)
    try:
        return msgspec.convert({**table, "kind": kind}, KINDS[kind])
    except msgspec.ValidationError as error:
        if isinstance(error.__cause__, BadInput):
            raise error.__cause__ from None
        raise BadInput(where, table, f"mend it: {error}") from None


def to_tables(layout: Sequence[Barrier]) -> list[dict[str, Any]]:
    """Return the tables of a layout file; `from_table` gives each barrier back."""
    return [msgspec.to_builtins(barrier) for barrier in layout]


def describe(barrier: Barrier, digits: int = 1) -> str:
    """Return a barrier in words, lengths with so many digits after the point."""

    def metres(value: float) -> str:
        return f"{value:.{digits}f} m"

    head = f"{barrier.words} at {metres(barrier.x)}"
    match barrier:
        case Ditch():
            return f"{head}, {metres(barrier.depth)} deep, {metres(barrier.width)} wide"
        case Embankment():
            return f"{head}, {metres(barrier.height)} high, crest {metres(barrier.width)} wide"
        case Fence():
            return f"{head}, {metres(barrier.height)} high, {barrier.capacity / 1e3:.0f} kJ"
    return f"{head}, {metres(barrier.height)} high, {metres(barrier.thickness)} thick"


def _under(barrier: Standing, ground: Terrain) -> tuple[Floats, Floats]:
    """Return chainages and elevations of the ground's corners under a barrier, its faces included.

    Raises
    ------
    BadInput
        If the barrier reaches beyond the ground.
    """
    inner = {float(x) for x in ground.points[:, 0] if barrier.x < x < barrier.end}
    x = np.array([barrier.x, *sorted(inner), barrier.end])
    try:
        return x, np.array([ground.height(at) for at in x])
    except BadInput as bad:
        raise BadInput(f"{barrier.words} x", barrier.x, bad.mend) from None


def _upright(barrier: Wall | Fence, ground: Terrain) -> Floats:
    """Return the (4, 2) corners of an upright rectangle with its foot in the ground."""
    x, y = _under(barrier, ground)
    foot, top = float(y.min()) - FOUNDATION, float(y.max()) + barrier.height
    return np.array([[x[0], foot], [x[-1], foot], [x[-1], top], [x[0], top]])
