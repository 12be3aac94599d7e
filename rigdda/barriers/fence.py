"""Flexible rockfall fence: its shape, price and catalogue.

Its motion and the energy that it absorbs are in `rigdda.dynamics.fence_brakes`; that energy is
accounted in `rigdda.dynamics.yielding_fences` and `rigdda.dynamics.island_step`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from typing import Annotated, ClassVar, NamedTuple, Self

import msgspec

from rigdda.barriers.base import (
    CATALOGUE_HEIGHTS,
    FOUNDATION,
    MIN_HEIGHT,
    Barrier,
    Floats,
    KnownSite,
    Length,
    Metres,
    Standing,
    Subsoil,
    at_ends,
    share_of,
)
from rigdda.errors import BadInput, DoubtfulInput
from rigdda.fields import about, documented
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.terrain import Terrain

PANEL = 10.0
"""Length of a fence panel along the slope, which acts as a unit [m]."""

LOST = 0.5
"""Share of its height that a fence loses at full elongation [-]: at least half of the height must
remain after an impact of its class (EAD 340059, class A)."""

MASS = 6.0
"""Mass per area of the net and the ropes that move with the rock [kg/m2]; an estimate without a
source."""

LEAST_CAPACITY, WEAK = 1e3, 1e4
"""Capacities of a fence below which it is rejected or causes a warning [J/m]. They correspond to a
block of 50 kg at 6 m/s and to one of 500 kg at 4.5 m/s, both 0.5 m wide."""


SHORTEST = 0.05
"""Minimum elongation of a fence [m]."""


class FenceClass(NamedTuple):
    """Properties of the fences of an energy class."""

    lowest: float
    """Minimum height on the market [m]; a lower fence costs the same."""
    height: float
    """Maximum height [m]."""
    elongation: float
    """Deflection downhill in an impact of its energy [m]."""


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
"""Fences on the market by impact energy [kJ], following the classification of kits in EAD 340059.
Heights and elongations are orders of magnitude without a source."""


CLASSES = tuple(FENCE_CLASSES)
"""Energy classes of fences, ascending [kJ]."""

Condition = Annotated[float, about(ge=0.05, le=1.0)]
Capacity = Annotated[float, about(ge=LEAST_CAPACITY)]
Elongation = Annotated[float, about(ge=SHORTEST)]


@documented
class Fence(Standing, frozen=True, tag="fence", omit_defaults=True):
    """A flexible fence, which brakes rock with a constant force over its elongation.

    It does not move until the force of an impact or of resting rock exceeds capacity / elongation
    in the downhill direction. It then deflects at this constant force and absorbs the force times
    the deflection. Its top sinks in proportion, to half the height at full elongation. The fence
    then fails, and the blocks continue with the remaining energy. Impacts on it are plastic and
    frictionless regardless of its surface, and the mass of its net moves with the rock. Uphill
    forces do not move it. The net stands vertical, and its height is vertical. A kit intercepts as
    much as a net whose height is the nominal height of the kit, which is normal to the slope,
    divided by the cosine of the slope.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, the height exceeds that of its class,
        or not exactly one of capacity and class is given.

    Warns
    -----
    DoubtfulInput
        If the capacity is below 10 kJ/m.
    """

    capacity: Annotated[
        Capacity | None,
        about(
            "Energy that the fence absorbs before it fails, per metre of road. Give either "
            "this or `energy_class`.",
            "J/m",
        ),
    ] = None
    energy_class: Annotated[
        int | None,
        about(
            "Energy class of a certified fence. `for_width` converts it to the capacity in a "
            "scene.",
            "kJ",
            choices=FENCE_CLASSES,
        ),
    ] = None
    thickness: Annotated[Metres, about("Extent downhill of `x`.", "m")] = 0.2
    elongation: Annotated[
        Elongation | None,
        about(
            "Distance over which it absorbs its capacity. The default is that of its class; if "
            "`capacity` is given, that of the lowest class with this capacity on a 10 m panel.",
            "m",
        ),
    ] = None
    repaired: ClassVar[float] = PANEL
    fallible: ClassVar[bool] = True
    lengths: ClassVar[tuple[Length, ...]] = (Length("height", "max_height"),)

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.capacity is None) == (self.energy_class is None):
            given = (self.capacity, self.energy_class)
            raise BadInput("fence capacity, energy_class", given, "give exactly one of them")
        if self.capacity is None:
            self._check_class()
        elif self.elongation is None:
            msgspec.structs.force_setattr(self, "elongation", _usual_elongation(self.capacity))
        if self.capacity is not None and self.capacity < WEAK:
            told = f"fence capacity = {self.capacity:g}: check the unit, J per metre of road"
            warnings.warn(told, DoubtfulInput, stacklevel=3)

    def _check_class(self) -> None:
        """Check the height and the elongation, and set the elongation."""
        assert self.energy_class is not None
        found = FENCE_CLASSES[self.energy_class]
        if self.height > found.height:
            hint = f"give at most {found.height:g} m, or a higher class than {self.energy_class} kJ"
            raise BadInput("fence height", self.height, hint)
        if self.elongation not in (None, found.elongation):
            hint = f"leave it out: it is {found.elongation:g} m for {self.energy_class} kJ"
            raise BadInput("fence elongation", self.elongation, hint)
        msgspec.structs.force_setattr(self, "elongation", found.elongation)

    def for_width(self, width: float) -> Fence:
        """Return the fence for a scene of this width [m], with a capacity instead of a class.

        The capacity is the class energy divided by the width, or by the panel length if that is
        less. A fence with a given capacity is returned unchanged.
        """
        if self.energy_class is None:
            return self
        capacity = 1e3 * self.energy_class / min(width, PANEL)
        return self._with(capacity=capacity, energy_class=None)

    @property
    def deflection(self) -> float:
        """Its elongation: the clear distance downhill that it needs for its deflection [m]."""
        assert self.elongation is not None  # set at the start
        return self.elongation

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners, with the foot below all ground that the fence may sweep over.

        Raises
        ------
        BadInput
            If it does not stand on the ground.
        """
        corners = super().outline(ground)
        assert self.elongation is not None  # set at the start
        points = ground.points
        reach = (points[:, 0] >= self.x) & (points[:, 0] <= self.end + self.elongation)
        last = min(self.end + self.elongation, float(points[:, 0].max()))
        lowest = min([ground.height(last), *points[reach, 1].tolist()])
        corners[:2, 1] = min(corners[0, 1], lowest - FOUNDATION)
        return corners

    def left_height(self, displacement: float) -> float:
        """Return its height after a deflection [m]."""
        return self.height - self.sag * displacement

    @property
    def sag(self) -> float:
        """Loss of height per deflection [-]."""
        assert self.elongation is not None  # set at the start
        return LOST * self.height / self.elongation

    @property
    def braking_force(self) -> float:
        """Force at which it deflects [N/m]; inf for a class without a known width."""
        assert self.elongation is not None  # set at the start
        return self.capacity / self.elongation if self.capacity is not None else math.inf

    def resistance(self, scene: Subsoil, outline: Floats) -> float:
        """Return the force at which it deflects [N/m]."""
        return self.braking_force

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        """Return the capital cost without the surcharge for height, with foundations [EUR/m].

        A fence lower than the minimum height of its class costs as much as one of that height.
        """
        if self.energy_class is None:
            hint = "give an energy_class instead: only a certified fence has a price"
            raise BadInput("fence capacity", self.capacity, hint)
        prices, name = site.prices, f"{self.energy_class:g}"
        if name not in prices.fence:
            raise BadInput("fence energy_class", self.energy_class, f"add {name} to prices.fence")
        height = max(self.height, FENCE_CLASSES[self.energy_class].lowest)
        return prices.fence[name] * height + prices.fence_base

    def idle_resistance(self, other: Barrier, resistance: float) -> float:
        """Return the force at which it deflects [N/m]."""
        return self.braking_force

    @property
    def strength(self) -> str:
        """Its energy class, or its capacity per metre, in words."""
        if self.energy_class is not None:
            return f"{self.energy_class:,g} kJ"
        assert self.capacity is not None
        return f"{self.capacity / 1e3:,.0f} kJ/m"

    @property
    def label(self) -> str:
        """Kind, class and height in words."""
        return f"fence {self.strength}, {self.height:.1f} m high"

    def order(self, road: float) -> tuple[str, str]:
        """Return its deflection and the remaining clearance to the road in words."""
        clear = road - self.end - self.deflection
        told = f"; it deflects by up to {self.deflection:.1f} m, to {clear:.1f} m from the road"
        return "", told

    @property
    def rated(self) -> int:
        """Its energy class [kJ]; every designed fence has one."""
        assert self.energy_class is not None
        return self.energy_class

    def check_design(self, where: str, site: KnownSite) -> None:
        """Check that it has an energy class.

        Raises
        ------
        BadInput
            If it has none; the message begins with `where`.
        """
        if self.energy_class is None:
            hint = "give its energy class instead of a capacity"
            raise BadInput(f"{where}.capacity", self.capacity, hint)

    @classmethod
    def of_shares(cls, zone: BarrierZone, x: float, first: float, second: float) -> Self:
        """Return a fence whose height and energy class are given by shares from 0 to 1."""
        energy_class = CLASSES[min(int(second * len(CLASSES)), len(CLASSES) - 1)]
        tall = MIN_HEIGHT + first * (tallest(zone) - MIN_HEIGHT)
        return cls(x, min(tall, FENCE_CLASSES[energy_class].height), energy_class=energy_class)

    def shares(self, zone: BarrierZone) -> tuple[float, float]:
        """Return the shares of its height and of its energy class (the middle of its interval)."""
        size = (CLASSES.index(self.rated) + 0.5) / len(CLASSES)
        return share_of(self.height, MIN_HEIGHT, tallest(zone)), size

    @classmethod
    def catalogue(cls, zone: BarrierZone) -> Iterator[Self]:
        """Yield fences of every class and of every height on the market."""
        for name, row in FENCE_CLASSES.items():
            for height in (h for h in CATALOGUE_HEIGHTS if h <= zone.max_height):
                if row.lowest <= height <= row.height:
                    yield cls(zone.start, height, energy_class=name)

    def bounds(self, zone: BarrierZone) -> dict[str, tuple[float, float]]:
        """Return the range of heights on the market for its class [m]."""
        row = FENCE_CLASSES[self.rated]
        return {"height": (row.lowest, min(zone.max_height, row.height))}

    def varied(self, level: int, zone: BarrierZone) -> Iterator[Self]:
        """Yield it higher and lower, and with the classes `level` steps above and below."""
        yield from super().varied(level, zone)
        at = CLASSES.index(self.rated)
        for other in (at - level, at + level):
            if 0 <= other < len(CLASSES):
                row = FENCE_CLASSES[CLASSES[other]]
                tall = min(max(self.height, row.lowest), row.height, zone.max_height)
                yield type(self)(self.x, tall, energy_class=CLASSES[other])

    @property
    def numbers(self) -> list[float]:
        """Its chainage, its height and the logarithm of its class."""
        return [self.x, self.height, math.log(self.rated)]

    @property
    def size(self) -> float:
        """Class times height."""
        return self.rated * self.height

    def sizes_at_bounds(self, zone: BarrierZone) -> list[str]:
        """Return in words whether its height or class is the least or the greatest.

        The greatest height of its class does not count, because the next class may be higher.
        """
        found = at_ends(self.height, MIN_HEIGHT, zone.max_height, "height")
        if self.energy_class in (CLASSES[0], CLASSES[-1]):
            found.append("lowest class" if self.energy_class == CLASSES[0] else "highest class")
        return found

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its dimensions and capacity in words."""
        capacity, named = self.capacity, self.energy_class
        takes = f"{named} kJ" if capacity is None else f"{capacity / 1e3:.0f} kJ/m"
        return f"{metres(self.height)} high, {takes}"


class WornFence(Fence, frozen=True, tag="fence", omit_defaults=True):
    """A fence of an energy class that absorbs only a share of the energy of its class.

    It is a barrier that stands already, see `rigdda.Existing`; layout files have no such fences.
    """

    condition: Annotated[Condition, about("Share of the energy of its class.", "-")] = 1.0

    def for_width(self, width: float) -> Fence:
        """Return the fence for a scene of this width [m], see `Fence.for_width`.

        It is no longer a worn fence: its capacity is what is left of that of its class.
        """
        kind = self.energy_class
        new = Fence(self.x, self.height, energy_class=kind, thickness=self.thickness)
        new = new.for_width(width)
        assert new.capacity is not None
        return new._with(capacity=self.condition * new.capacity)

    @property
    def strength(self) -> str:
        """Its energy class and its condition in words."""
        return f"{super().strength} at {100.0 * self.condition:.0f} %"

    def sizes(self, metres: Callable[[float], str]) -> str:
        """Return its dimensions, its class and its condition in words."""
        return f"{super().sizes(metres)} at {100.0 * self.condition:.0f} %"

    @property
    def remaining(self) -> float:
        """Energy that it absorbs [kJ]."""
        return self.condition * self.rated


def tallest(zone: BarrierZone) -> float:
    """Return the greatest height of a fence of any class in a zone [m]."""
    return min(zone.max_height, max(row.height for row in FENCE_CLASSES.values()))


def _usual_elongation(capacity: float) -> float:
    """Return the elongation [m] of the lowest class with this capacity [J/m] on a panel."""
    above = [c for energy, c in FENCE_CLASSES.items() if 1e3 * energy >= capacity * PANEL]
    return (above or [FENCE_CLASSES[max(FENCE_CLASSES)]])[0].elongation
