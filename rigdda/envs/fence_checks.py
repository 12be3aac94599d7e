"""What the rule demands of a fence along a slope, and the check of a fence factor by factor.

The rule is UNI 11211-4:2012 as Peila and Ronco (2009, Nat. Hazards Earth Syst. Sci. 9, 1291-1298)
describe it, with the factors of `rigdda.model.partial_factors`. The design values of velocity and
height at a station are those of the design event that demands most. The mass is that of the event:
it does not depend on the station.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rigdda import Fence, Site
from rigdda.barriers.fence import FENCE_CLASSES, FenceClass
from rigdda.envs.design_envelope import DesignEnvelope, EventEnvelope
from rigdda.envs.quantiles import Quantile
from rigdda.model.existing import WornFence
from rigdda.model.partial_factors import PartialFactors
from rigdda.rounding import between

USE_ROUNDING = 1e-9
"""Rounding error up to which a utilisation may exceed its limit [-]."""


class Action(NamedTuple):
    """What the blocks of an event do at a station, with and without partial factors.

    Parameters
    ----------
    event : EventEnvelope
        The event.
    passing : float
        Number of blocks that pass; between two stations it is interpolated.
    speed, height : Quantile
        Characteristic velocity [m/s] and height of the centre of a block [m].
    factors : PartialFactors
        The factors.
    """

    event: EventEnvelope
    passing: float
    speed: Quantile
    height: Quantile
    factors: PartialFactors

    @property
    def design_mass(self) -> float:
        """Mass with its factors [kg]."""
        return self.event.mass * self.factors.mass

    def design_speed(self) -> float:
        """Return the velocity with its factors [m/s]."""
        return self.speed.value * self.factors.velocity

    @property
    def enough(self) -> bool:
        """Whether enough blocks pass for the characteristic values to be below the largest ones."""
        return round(self.passing) * (1.0 - self.factors.quantile) >= 1.0 - 1e-9

    def energy(self) -> float:
        """Return the design energy E_d [J]."""
        return 0.5 * self.design_mass * self.design_speed() ** 2 * self.factors.risk

    def design_height(self) -> float:
        """Return the height of the centre with its factors [m]."""
        return self.height.value * self.factors.velocity * self.factors.height

    @property
    def freeboard(self) -> float:
        """Height of the fence above the design height [m]."""
        return max(self.factors.freeboard, self.event.radius)

    def needed_height(self) -> float:
        """Return the height that a fence needs [m]."""
        return self.design_height() + self.freeboard


@dataclass(frozen=True, slots=True)
class Demand:
    """What the rule demands of a fence at a chainage.

    Parameters
    ----------
    x : float
        Chainage [m].
    covered : float
        Of the blocks that reach the road, the share that passes here [-].
    hard, high : Action
        The actions of the design events that demand most energy and most height.
    """

    x: float
    covered: float
    hard: Action
    high: Action

    def energy(self) -> float:
        """Return the design energy E_d [J]."""
        return self.hard.energy()

    def height(self) -> float:
        """Return the height that a fence needs [m]."""
        return self.high.needed_height()

    def classes(self) -> Iterator[tuple[int, FenceClass]]:
        """Yield the classes with enough energy, ascending."""
        factors = self.hard.factors
        for name, row in FENCE_CLASSES.items():
            if self.energy() * factors.energy <= factors.rated(name) * (1.0 + USE_ROUNDING):
                yield name, row

    @property
    def least_class(self) -> int | None:
        """The lowest class with enough energy [kJ], or None."""
        return next((name for name, _ in self.classes()), None)


def demands(envelope: DesignEnvelope, factors: PartialFactors) -> list[Demand]:
    """Return what is demanded at every station that a block passes, going downhill."""
    found = (demand_at(envelope, factors, x) for x in envelope.stations)
    return [demand for demand in found if demand is not None]


def demand_at(envelope: DesignEnvelope, factors: PartialFactors, x: float) -> Demand | None:
    """Return what is demanded at a chainage, interpolated between stations.

    It is None where no block passes, and beyond the first and the last station.
    """
    if not envelope.stations[0] <= x <= envelope.stations[-1]:
        return None
    actions = [
        action
        for event in envelope.events
        if (action := _action(envelope, event, factors, x)) is not None
    ]
    if not actions:
        return None
    covered = float(np.interp(x, envelope.stations, envelope.crossing))
    hard = max(actions, key=lambda action: action.energy())
    return Demand(x, covered, hard, max(actions, key=lambda action: action.needed_height()))


def _action(
    envelope: DesignEnvelope, event: EventEnvelope, factors: PartialFactors, x: float
) -> Action | None:
    """Return what the blocks of an event do at a chainage, None if none passes."""
    passing = np.array(event.passing, dtype=np.float64)
    known = passing > 0.0
    if not known.any() or np.interp(x, envelope.stations, passing) <= 0.0:
        return None
    at = np.array(envelope.stations)[known]

    def between(quantiles: list[Quantile]) -> Quantile:
        columns = np.array(quantiles)[known].T
        return Quantile(*(float(np.interp(x, at, column)) for column in columns))

    count = float(np.interp(x, envelope.stations, passing))
    return Action(event, count, between(event.speed), between(event.height), factors)


class SheetRow(NamedTuple):
    """A line of a design sheet: a quantity, its symbol, its value and where it comes from."""

    quantity: str
    symbol: str
    value: float | str
    unit: str
    basis: str


@dataclass(frozen=True, slots=True)
class FenceCheck:
    """Check of a fence against the rule.

    Parameters
    ----------
    fence : Fence
        A fence of an energy class.
    demand : Demand
        What is demanded where it stands.
    clearance : float
        Distance from its downhill face to the road [m].
    slope : float
        Inclination of the ground that falls towards it, over its own height uphill of it [rad].
    """

    fence: Fence
    demand: Demand
    clearance: float
    slope: float

    @classmethod
    def of(cls, site: Site, fence: Fence, demand: Demand) -> FenceCheck:
        """Return the check of a fence on a site."""
        clear = site.road.start - fence.end
        slope = site.profile.inclination(fence.x - 0.5 * fence.height, fence.height)
        return cls(fence, demand, clear, float(slope))

    @property
    def factors(self) -> PartialFactors:
        """The partial factors."""
        return self.demand.hard.factors

    @property
    def energy(self) -> float:
        """Energy of the fence at the chosen level, for a worn one times its condition [J]."""
        left = self.fence.condition if isinstance(self.fence, WornFence) else 1.0
        return self.factors.rated(self.fence.rated) * left

    @property
    def capacity(self) -> float:
        """Energy of the fence at the chosen level, divided by its factor [J]."""
        return self.energy / self.factors.energy

    @property
    def design_elongation(self) -> float:
        """Elongation times its factor [m]."""
        return self.fence.deflection * self.factors.elongation

    @property
    def energy_use(self) -> float:
        """Design energy divided by the capacity [-]."""
        return self.demand.energy() / self.capacity

    @property
    def height_use(self) -> float:
        """Needed height divided by the height [-]."""
        return self.demand.height() / self.fence.height

    @property
    def nominal_height(self) -> float:
        """Height that a kit needs, measured normal to the slope as EAD 340059 does [m].

        The height of the centre of the block is reduced by the cosine of the inclination of the
        ground; the freeboard, which is a size of the block, is not.
        """
        high = self.demand.high
        return high.design_height() * math.cos(self.slope) + high.freeboard

    @property
    def elongation_use(self) -> float:
        """Design elongation divided by the clear distance to the road [-]."""
        return self.design_elongation / max(self.clearance, 1e-9)

    @property
    def uses(self) -> dict[str, float]:
        """All three utilisations by name [-]."""
        return {
            "energy": self.energy_use,
            "height": self.height_use,
            "elongation": self.elongation_use,
        }

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Utilisations at the ends of the intervals of velocity and height, by name [-]."""
        hard, high = self.demand.hard, self.demand.high
        speeds = [(end / hard.speed.value) ** 2 for end in (hard.speed.low, hard.speed.high)]
        heights = [
            high._replace(height=Quantile(end, end, end)).needed_height() / self.fence.height
            for end in (high.height.low, high.height.high)
        ]
        return {
            "energy": (self.energy_use * speeds[0], self.energy_use * speeds[1]),
            "height": (heights[0], heights[1]),
            "elongation": (self.elongation_use, self.elongation_use),
        }

    @property
    def fits(self) -> bool:
        """Whether the fence satisfies the rule."""
        return max(self.uses.values()) <= 1.0 + USE_ROUNDING

    def rows(self) -> list[SheetRow]:
        """Return the design sheet, factor by factor."""
        return [*self._energy_rows(), *self._height_rows(), *self._elongation_rows()]

    def _quantile(self, value: Quantile, action: Action) -> str:
        share = f"{100.0 * self.factors.quantile:g} % quantile"
        if not action.enough:
            return f"largest of {action.passing:.0f}, too few for a {share}"
        return f"{share}, {between(value.low, value.high, '.3g')}"

    def _worn(self) -> str:
        fence = self.fence
        return f", {fence.condition:.0%} of it left" if isinstance(fence, WornFence) else ""

    def _energy_rows(self) -> list[SheetRow]:
        hard, f = self.demand.hard, self.factors
        speed, use = self._quantile(hard.speed, hard), self.energy_use
        return [
            SheetRow("station", "x", self.fence.x, "m", ""),
            SheetRow("design event", "", hard.event.name, "", "the one that demands most energy"),
            SheetRow("blocks that pass", "n", round(hard.passing), "", _simulated(hard.event)),
            SheetRow("velocity", "v", hard.speed.value, "m/s", speed),
            SheetRow("trajectories", "g_tr", f.trajectory, "-", "factor on v"),
            SheetRow("topography", "g_dp", f.topography, "-", "factor on v"),
            SheetRow("design velocity", "v_d", hard.design_speed(), "m/s", "v g_tr g_dp"),
            SheetRow("block mass", "m", hard.event.mass, "kg", "quantile over the event"),
            SheetRow("block size", "g_vol", f.block_size, "-", "factor on m"),
            SheetRow("density", "g_rho", f.density, "-", "factor on m"),
            SheetRow("design mass", "m_d", hard.design_mass, "kg", "m g_vol g_rho"),
            SheetRow("risk", "g_R", f.risk, "-", "factor on the energy"),
            SheetRow("design energy", "E_d", 1e-3 * hard.energy(), "kJ", "m_d v_d2 g_R / 2"),
            SheetRow("factor of the fence", "g_E", f.energy, "-", f"at {f.level}"),
            SheetRow("demanded energy", "g_E E_d", 1e-3 * hard.energy() * f.energy, "kJ",
                     f"demanded class: {self.demand.least_class or 'none'}"),
            SheetRow("energy of the fence", "E", 1e-3 * self.energy, "kJ",
                     f"class {self.fence.rated:,} kJ at {f.level}{self._worn()}"),
            SheetRow("utilisation, energy", "g_E E_d / E", use, "-", _verdict(use)),
        ]  # fmt: skip

    def _height_rows(self) -> list[SheetRow]:
        high, f = self.demand.high, self.factors
        height, use = self._quantile(high.height, high), self.height_use
        return [
            SheetRow("design event", "", high.event.name, "", "the one that demands most height"),
            SheetRow("bounce height", "h", high.height.value, "m", height),
            SheetRow("factor on heights", "g_h", f.height, "-", "and g_tr, g_dp"),
            SheetRow("design height", "h_d", high.design_height(), "m", "h g_tr g_dp g_h"),
            SheetRow("freeboard", "f", high.freeboard, "m",
                     f"at least {f.freeboard:g} and the mean radius, {high.event.radius:.2f}"),
            SheetRow("needed height", "h_d + f", high.needed_height(), "m", "vertical"),
            SheetRow("height of the fence", "H", self.fence.height, "m", "vertical"),
            SheetRow("utilisation, height", "(h_d + f) / H", use, "-", _verdict(use)),
            SheetRow("inclination of the ground", "b", math.degrees(self.slope), "deg",
                     "over the height of the fence, uphill of it"),
            SheetRow("bounce height, normal to the slope", "h cos b",
                     high.height.value * math.cos(self.slope), "m", "not used by this check"),
            SheetRow("nominal height of a kit", "h_d cos b + f", self.nominal_height, "m",
                     "normal to the slope, as in EAD 340059; not used by this check"),
        ]  # fmt: skip

    def _elongation_rows(self) -> list[SheetRow]:
        return [
            SheetRow("elongation", "D", self.fence.deflection, "m", "of the class"),
            SheetRow("factor on elongation", "g_D", self.factors.elongation, "-", ""),
            SheetRow("design elongation", "D_d", self.design_elongation, "m", "D g_D"),
            SheetRow("clearance to the road", "d", self.clearance, "m", ""),
            SheetRow("utilisation, elongation", "D_d / d", self.elongation_use, "-",
                     _verdict(self.elongation_use)),
        ]  # fmt: skip


def _simulated(event: EventEnvelope) -> str:
    return f"of {event.blocks:,} in {event.releases:,} releases"


def _verdict(use: float) -> str:
    return "satisfied" if use <= 1.0 + USE_ROUNDING else "NOT SATISFIED"
