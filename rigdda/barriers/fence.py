"""A flexible fence."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Self

import msgspec

from rigdda.barriers.base import Floats
from rigdda.barriers.standing import Standing
from rigdda.errors import BadInput, DoubtfulInput

if TYPE_CHECKING:
    from rigdda.model.scene import Scene
    from rigdda.model.site import Site

PANEL = 10.0
"""Length of a panel of a fence along the slope, which acts whole [m]."""

LOST = 0.5
"""Share of its height that a fence has lost when it has absorbed its capacity [-]."""

LEAST_CAPACITY, WEAK = 1e3, 1e4
"""Capacities of a fence below which it is refused, and a warning is given [J/m]: a block of 50 kg
at 6 m/s and one of 500 kg, 0.5 m wide, at 4.5 m/s."""


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
    rest against it what these pass on, see `rigdda.dynamics.fence`. When this would exceed what is
    left of the capacity, it fails: the blocks go on with the energy that is left, and the fence is
    gone. It stays upright until then. In a scene of several blocks it is lower by what it took, at
    the capacity by a half (EAD 340059, class A: at least half is left after an impact of its
    energy).
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
    repaired: ClassVar[float] = PANEL

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
        energy_class = int(self.energy_class)
        msgspec.structs.force_setattr(self, "energy_class", energy_class)  # 1000.0 is in it, too
        found = FENCE_CLASSES[energy_class]
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
        return self._with(capacity=capacity, energy_class=None)

    def left_height(self, absorbed: float) -> float:
        """Return its height after it has absorbed so much [m]."""
        return self.height - self.sag * absorbed

    @property
    def sag(self) -> float:
        """Height that it loses by what it absorbs [m per J/m]."""
        return LOST * self.height / self.capacity if self.capacity else 0.0

    @property
    def bears(self) -> float:
        """Thrust of what rests against it that it bears [N/m], inf without elongation."""
        if self.capacity is None or self.elongation is None:
            return math.inf
        return self.capacity / self.elongation

    def resistance(self, scene: Scene, outline: Floats) -> float:
        """Return the mean force with which it brakes an impact of its capacity [N/m]."""
        return self.bears

    def price(self, site: Site, outline: Floats | None) -> float:
        """Return the price at the height of the road [EUR/m], with its foundations.

        One that is lower than any of its class costs as much as the lowest.
        """
        if self.energy_class is None:
            mend = "give an energy_class instead: only a certified fence has a price"
            raise BadInput("fence capacity", self.capacity, mend)
        prices, name = site.prices, f"{self.energy_class:g}"
        if name not in prices.fence:
            raise BadInput("fence energy_class", self.energy_class, f"add {name} to prices.fence")
        height = max(self.height, FENCE_CLASSES[self.energy_class].lowest)
        return prices.fence[name] * height + prices.fence_base

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its sizes in words."""
        capacity, named = self.capacity, self.energy_class
        takes = f"{named} kJ" if capacity is None else f"{capacity / 1e3:.0f} kJ/m"
        return f"{metres(self.height)} high, {takes}"
