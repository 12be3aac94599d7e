"""What barriers cost, and what a release costs: EUR per metre of road and year in the end.

The design problem is to have least of

    Z = sum_b capital_b (annuity + upkeep_b) + sum_k rate_k E[harm_k + repair_k]

over barriers b and events k. All prices are orders of magnitude and a user's to replace.
"""

from __future__ import annotations

from typing import NamedTuple

import msgspec
import numpy as np

from rigdda import check

ACCESS_HEIGHT = 60.0
"""Height above the road at which access costs `Prices.access` times the price at the road [m]."""

MOST = 1e6
"""Greatest price [EUR per m, m2 or m3]."""

FENCES = {
    "100": 150.0,
    "250": 200.0,
    "500": 250.0,
    "1000": 350.0,
    "1500": 420.0,
    "2000": 480.0,
    "3000": 600.0,
    "5000": 850.0,
    "8500": 1250.0,
}
DITCHES = {"rock": 40.0, "soil": 15.0}
UPKEEP = {
    "wall": 0.005,
    "gravity_wall": 0.005,
    "fence": 0.015,
    "ditch": 0.01,
    "embankment": 0.01,
    "mesh": 0.015,
    "shed": 0.005,
}


class Prices(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What barriers cost.

    Parameters
    ----------
    fence : table
        Price of a fence by its energy class [EUR/m2].
    fence_base : float
        And per metre: foundations [EUR/m].
    ditch : table
        Price of digging by the surface of the ground [EUR/m3]; one that is not listed is dug at the
        price of the dearest.
    ditch_base : float
        And per metre [EUR/m].
    embankment : float
        Price of reinforced earth [EUR/m3].
    concrete : float
        Price of walls [EUR/m3].
    removal : float
        Price of emptying what holds rock [EUR/m3].
    access : float
        The price rises by this factor for 60 m of height above the road [-].
    interest : float
        Rate of interest, after inflation [1/year].
    life : float
        Life of barriers [years].
    upkeep : table
        Upkeep by kind, "shed" included [1/year of the capital]; one that is not listed has none.
    shed : float
        Price of a rock shed over the road, the reference that always works [EUR/m].
    source : str
        Where the prices are from.

    Raises
    ------
    BadInput
        If a price is outside its range.
    """

    fence: dict[str, float] = msgspec.field(default_factory=lambda: dict(FENCES))
    fence_base: float = 300.0
    ditch: dict[str, float] = msgspec.field(default_factory=lambda: dict(DITCHES))
    ditch_base: float = 20.0
    embankment: float = 80.0
    concrete: float = 350.0
    removal: float = 100.0
    access: float = 1.5
    interest: float = 0.03
    life: float = 50.0
    upkeep: dict[str, float] = msgspec.field(default_factory=lambda: dict(UPKEEP))
    shed: float = 25_000.0
    source: str = "orders of magnitude, from memory"

    def __post_init__(self) -> None:
        for name in ("fence_base", "ditch_base", "embankment", "concrete", "removal", "shed"):
            check.number(f"prices.{name}", getattr(self, name), 0.0, MOST)
        for name, most in (("fence", MOST), ("ditch", MOST), ("upkeep", 0.5)):
            for key, price in getattr(self, name).items():
                check.number(f"prices.{name}.{key}", price, 0.0, most)
        for kind in self.fence:
            check.one_of("prices.fence", kind, FENCES)
        for kind in self.upkeep:
            check.one_of("prices.upkeep", kind, UPKEEP)
        check.number("prices.access", self.access, 0.0, 20.0)
        check.number("prices.interest", self.interest, 0.0, 0.5)
        check.number("prices.life", self.life, 1.0, 1000.0)

    @property
    def annuity(self) -> float:
        """Share of the capital to pay a year [1/year]."""
        if self.interest < 1e-9:
            return 1.0 / self.life
        return self.interest / -np.expm1(-self.life * np.log1p(self.interest))

    def annual(self, kind: str) -> float:
        """Return what a barrier of a kind costs a year, as a share of its capital [1/year]."""
        return float(self.annuity + self.upkeep.get(kind, 0.0))


class Consequences(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What rock on the road costs.

    The road is closed for days_base + days_factor V^days_exponent days, V being the volume that
    came onto it [m3].

    Parameters
    ----------
    closure : float
        A day of closure, detours and risk to life included [EUR/day].
    days_base : float
        Days of closure whatever the volume [days].
    days_factor : float
        And for a cubic metre [days].
    days_exponent : float
        Exponent of the volume [-].
    clearing : float
        Clearing the road [EUR/m3].
    source : str
        Where these are from.

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    closure: float = 50_000.0
    days_base: float = 0.2
    days_factor: float = 0.15
    days_exponent: float = 0.6
    clearing: float = 300.0
    source: str = "orders of magnitude, from memory"

    def __post_init__(self) -> None:
        check.number("consequences.closure", self.closure, 0.0, 1e9)
        check.number("consequences.days_base", self.days_base, 0.0, 1000.0)
        check.number("consequences.days_factor", self.days_factor, 0.0, 1000.0)
        check.number("consequences.days_exponent", self.days_exponent, 0.0, 2.0)
        check.number("consequences.clearing", self.clearing, 0.0, MOST)

    def harm(self, volume: float, reached: bool) -> float:
        """Return the cost of so much rock on the road [EUR]; `volume` in m3."""
        if not reached:
            return 0.0
        days = self.days_base + self.days_factor * volume**self.days_exponent
        return self.closure * days + self.clearing * volume


class Bill(NamedTuple):
    """What a release costs [EUR]: harm on the road, and repair of barriers with emptying them."""

    harm: float
    repair: float
