"""Barriers that stand on the ground: walls, gravity walls and fences."""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple, Self

import msgspec
import numpy as np

from rigdda.barriers.base import BarrierBase, Floats
from rigdda.errors import BadInput, DoubtfulInput
from rigdda.terrain import Terrain

FOUNDATION = 1.0
"""Depth to which walls and fences reach below the lowest ground under them [m]."""

ELEMENT, PANEL = 5.0, 10.0
"""Lengths along the slope of an element of a gravity wall and of a panel of a fence, which act
whole [m]."""

LOST = 0.5
"""Share of its height that a fence has lost when it has absorbed its capacity [-]."""

LEAST_CAPACITY, WEAK = 1e3, 1e4
"""Capacities of a fence below which it is refused, and a warning is given [J/m]: a block of 50 kg
at 6 m/s and one of 500 kg, 0.5 m wide, at 4.5 m/s."""


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

    def for_width(self, width: float) -> Self:
        """Return the wall that resists what is so wide [m]: its elements of 5 m act whole."""
        factor = ELEMENT / min(width, ELEMENT)
        return msgspec.structs.replace(self, density=self.density * factor)

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


class FenceClass(NamedTuple):
    """What fences of an energy class are like."""

    lowest: float
    """Least height that is made [m]: a lower one costs as much."""
    height: float
    """Greatest height [m]."""
    elongation: float
    """Distance downhill over which it stops an impact of its energy [m]."""


FENCE_CLASSES = {
    100: FenceClass(1.5, 2.5, 2.0),
    250: FenceClass(2.0, 3.0, 2.5),
    500: FenceClass(2.0, 4.0, 3.5),
    1000: FenceClass(3.0, 5.0, 4.5),
    1500: FenceClass(3.0, 5.0, 5.0),
    2000: FenceClass(4.0, 6.0, 5.5),
    3000: FenceClass(4.0, 6.0, 6.5),
    5000: FenceClass(5.0, 7.0, 7.5),
    8500: FenceClass(6.0, 8.0, 9.0),
}
"""Fences on the market by the energy of the impact that they stop [kJ], as EAD 340059 classifies
kits; heights and elongations are orders of magnitude, from memory."""


class Fence(Standing, frozen=True, tag="fence", omit_defaults=True):
    """A flexible fence that absorbs energy up to its capacity, then fails.

    Impacts on it are plastic whatever its surface. It takes their work, and of blows on blocks that
    rest against it what these pass on, see `rigdda.fence`. When this would exceed what is left of
    the capacity, it fails: the blocks go on with the energy that is left, and the fence is gone.
    It stays upright until then. In a scene of several blocks it is lower by what it took, at the
    capacity by a half (EAD 340059, class A: at least half is left after an impact of its energy).
    Blocks at rest against it cost it no energy. But if their thrust, as a mean over a second,
    exceeds the mean force with which it brakes an impact of its class, it fails, too.

    Parameters
    ----------
    x : float
        Chainage of its uphill face [m].
    height : float
        Height above the highest ground under it [m].
    capacity : float, optional
        Energy that it absorbs before it fails [J per metre of slope width].
    energy_class : int, optional
        In place of the capacity, one of `FENCE_CLASSES` [kJ]; `for_width` gives the fence of a
        scene.
    thickness : float
        Extent downhill of `x` [m].
    elongation : float, optional
        Distance over which it stops an impact of its capacity [m]; that of the class where there is
        one. Without it no thrust breaks the fence.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range, the height is more than its class has, or
        there is not either a capacity or a class.

    Warns
    -----
    DoubtfulInput
        If the capacity is below 10 kJ/m.
    """

    capacity: float | None = None
    energy_class: int | None = None
    thickness: float = 0.2
    elongation: float | None = None

    def __post_init__(self) -> None:
        self._check("height", "thickness")
        if (self.capacity is None) == (self.energy_class is None):
            given = (self.capacity, self.energy_class)
            raise BadInput("fence capacity, energy_class", given, "give one of them")
        if self.capacity is not None:
            self._check_number("capacity", LEAST_CAPACITY)
            if self.capacity < WEAK:
                told = f"fence capacity = {self.capacity:g}: is it meant? It is in J per metre"
                warnings.warn(told, DoubtfulInput, stacklevel=3)
        else:
            self._check_class()
        if self.elongation is not None:
            self._check_number("elongation", 0.0)

    def _check_class(self) -> None:
        """Check the class and the height, and set the elongation."""
        if self.energy_class not in tuple(FENCE_CLASSES):
            known = ", ".join(str(name) for name in FENCE_CLASSES)
            raise BadInput("fence energy_class", self.energy_class, f"give one of {known} kJ")
        found = FENCE_CLASSES[self.energy_class]
        if self.height > found.height:
            mend = f"give at most {found.height:g} m, or a higher class than {self.energy_class} kJ"
            raise BadInput("fence height", self.height, mend)
        if self.elongation not in (None, found.elongation):
            mend = f"leave it out: of {self.energy_class} kJ it is {found.elongation:g} m"
            raise BadInput("fence elongation", self.elongation, mend)
        msgspec.structs.force_setattr(self, "elongation", found.elongation)

    def for_width(self, width: float) -> Self:
        """Return the fence of a scene that is so wide [m]: its class a metre, at most of a panel.

        One of given capacity is itself.
        """
        if self.energy_class is None:
            return self
        capacity = 1e3 * self.energy_class / min(width, PANEL)
        return msgspec.structs.replace(self, capacity=capacity, energy_class=None)

    def left_height(self, absorbed: float) -> float:
        """Return its height after it has absorbed so much [m]."""
        return self.height - self.sag * absorbed

    @property
    def sag(self) -> float:
        """Height that it loses by what it absorbs [m per J/m]."""
        return LOST * self.height / self.capacity if self.capacity else 0.0

    @property
    def resistance(self) -> float:
        """Thrust of what rests against it that it bears [N/m], inf without elongation."""
        if self.capacity is None or self.elongation is None:
            return math.inf
        return self.capacity / self.elongation
