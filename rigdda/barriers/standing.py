"""Barriers that stand on the ground: walls, gravity walls and fences."""

from __future__ import annotations

import numpy as np

from rigdda.barriers.base import BarrierBase, Floats
from rigdda.errors import BadInput
from rigdda.terrain import Terrain

FOUNDATION = 1.0
"""Depth to which walls and fences reach below the lowest ground under them [m]."""


class Standing(BarrierBase, frozen=True):
    """A barrier that stands on the ground: two vertical faces and a level top."""

    height: float

    @property
    def thickness(self) -> float:
        """Extent downhill of `x` [m], a field of every kind."""
        raise NotImplementedError

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed it where it stood at the start [m]."""
        return self.x + self.thickness

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        return self.thickness

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners, the foot in `ground`.

        Raises
        ------
        BadInput
            If it does not stand on the ground.
        """
        x, y = self._under(ground)
        foot, top = float(y.min()) - FOUNDATION, float(y.max()) + self.height
        return np.array([[x[0], foot], [x[-1], foot], [x[-1], top], [x[0], top]])

    def _under(self, ground: Terrain) -> tuple[Floats, Floats]:
        """Return chainages and elevations of the ground's corners under it, its faces included."""
        inner = {float(x) for x in ground.points[:, 0] if self.x < x < self.end}
        x = np.array([self.x, *sorted(inner), self.end])
        try:
            return x, np.array([ground.height(at) for at in x])
        except BadInput as bad:
            raise BadInput(f"{self.words} x", self.x, bad.mend) from None


class Wall(Standing, frozen=True, tag="wall"):
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
        If a value is not finite or outside its range.
    """

    thickness: float = 1.0

    def __post_init__(self) -> None:
        self._check("height", "thickness")


class GravityWall(Standing, frozen=True, tag="gravity_wall"):
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
        If a value is not finite or outside its range.
    """

    thickness: float = 1.0
    density: float = 2400.0

    def __post_init__(self) -> None:
        self._check("height", "thickness")
        self._check_number("density", 0.0)

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners at the start, on `ground`.

        Raises
        ------
        BadInput
            If it does not stand on the ground.
        """
        x, y = self._under(ground)
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


class Fence(Standing, frozen=True, tag="fence"):
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
        If a value is not finite or outside its range.
    """

    capacity: float
    thickness: float = 0.2

    def __post_init__(self) -> None:
        self._check("height", "thickness")
        self._check_number("capacity", 0.0)
