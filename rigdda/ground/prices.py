"""Prices of barriers and costs of releases.

The design problem is to minimise the annual cost per metre of road [EUR per metre and year]

    Z = sum_b capital_b (annuity + upkeep_b) + sum_k rate_k E[harm_k + repair_k]

over barriers b and events k. All default prices are orders of magnitude; users should replace them.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import msgspec
import numpy as np

from rigdda import fields
from rigdda.fields import about, documented

ACCESS_HEIGHT = 60.0
"""Height above the road at which the surcharge for access is `Prices.access` times the price
[m]."""

MAXIMUM_PRICE = 1e6
"""Maximum price [EUR per m, m2 or m3]."""

FENCE_PRICES = {
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


Price = Annotated[float, about(ge=0.0, le=MAXIMUM_PRICE)]
EnergyClass = Annotated[str, about(choices=FENCE_PRICES)]
Upkeep = Annotated[float, about(ge=0.0, le=0.5)]
Protection = Annotated[str, about(choices=UPKEEP)]
Life = Annotated[float, about(ge=1.0, le=1000.0)]


@documented
class Prices(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Prices of barriers.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    fence: Annotated[
        dict[EnergyClass, Price], about("Price of a fence by its energy class in kJ.", "EUR/m2")
    ] = msgspec.field(default_factory=lambda: dict(FENCE_PRICES))
    fence_base: Annotated[
        Price,
        about("Additional price of a fence per metre of road, for foundations.", "EUR/m"),
    ] = 300.0
    ditch: Annotated[
        dict[str, Price],
        about(
            "Price of excavation by the surface of the ground. Other surfaces cost as much as the "
            "most expensive one in the table.",
            "EUR/m3",
            least=1,
        ),
    ] = msgspec.field(default_factory=lambda: dict(DITCHES))
    ditch_base: Annotated[Price, about("Additional price of a ditch.", "EUR/m")] = 20.0
    embankment: Annotated[Price, about("Price of reinforced soil.", "EUR/m3")] = 80.0
    concrete: Annotated[Price, about("Price of the concrete of walls.", "EUR/m3")] = 350.0
    removal: Annotated[Price, about("Price of removing the rock that barriers hold.", "EUR/m3")] = (
        100.0
    )
    access: Annotated[
        float,
        about(
            "Surcharge for access. Prices are multiplied by 1 + access h / 60, where h is the "
            "height of the barrier above the road in metres: by 2.5 at 60 m with the default, and "
            "by 1 at or below the road.",
            "-",
            ge=0.0,
            le=20.0,
        ),
    ] = 1.5
    interest: Annotated[
        float, about("Real rate of interest, after inflation.", "1/year", ge=0.0, le=0.5)
    ] = 0.03
    life: Annotated[
        Life,
        about("Service life of barriers. They are then replaced at their capital cost.", "years"),
    ] = 50.0
    lives: Annotated[
        dict[Protection, Life],
        about(
            "Service life by kind of barrier. A kind that is not in the table has the general "
            "`life`.",
            "years",
        ),
    ] = {}
    upkeep: Annotated[
        dict[Protection, Upkeep],
        about(
            "Annual upkeep as a share of the capital cost, by kind of barrier. A kind that is not "
            "in the table has no upkeep.",
            "1/year",
        ),
    ] = msgspec.field(default_factory=lambda: dict(UPKEEP))
    shed: Annotated[
        Price,
        about("Price of a rock shed over the road, a reference with full protection.", "EUR/m"),
    ] = 25_000.0
    source: Annotated[str, about("Source of the prices.")] = "orders of magnitude, from memory"

    def __post_init__(self) -> None:
        fields.check(self, "prices.")

    def annuity(self, kind: str) -> float:
        """Return the annual payment for a kind of barrier as a share of its capital cost [1/year].

        It is paid without end, because a barrier is replaced at the end of its service life.
        """
        life = self.lives.get(kind, self.life)
        if self.interest < 1e-9:
            return 1.0 / life
        return float(self.interest / -np.expm1(-life * np.log1p(self.interest)))

    def annual(self, kind: str, usual: float = 0.0) -> float:
        """Return the annual cost of a kind of barrier as a share of its capital cost [1/year].

        `usual` is the upkeep of a kind that is neither in the table `upkeep` nor built-in.
        """
        return float(self.annuity(kind) + self.upkeep_of(kind, usual))

    def upkeep_of(self, kind: str, usual: float = 0.0) -> float:
        """Return the annual upkeep of a kind of barrier as a share of its capital cost [1/year]."""
        return self.upkeep.get(kind, 0.0 if kind in UPKEEP else usual)


@documented
class Consequences(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Costs of rock on the road.

    The road is closed for days_base + days_factor V^days_exponent days, where V is the volume of
    rock that reaches it [m3].

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    closure: Annotated[
        float,
        about(
            "Cost of a day of closure, including detours. It includes the risk to life only if "
            "`[traffic]` does not give a value of a prevented fatality.",
            "EUR/day",
            ge=0.0,
            le=1e9,
        ),
    ] = 50_000.0
    days_base: Annotated[
        float, about("Days of closure for any volume.", "days", ge=0.0, le=1000.0)
    ] = 0.2
    days_factor: Annotated[
        float, about("Additional days of closure for 1 m3 of rock.", "days", ge=0.0, le=1000.0)
    ] = 0.15
    days_exponent: Annotated[
        float,
        about("Exponent of the volume in the additional days of closure.", "-", ge=0.0, le=2.0),
    ] = 0.6
    clearing: Annotated[Price, about("Cost of clearing the road.", "EUR/m3")] = 300.0
    source: Annotated[str, about("Source of these costs.")] = "orders of magnitude, from memory"

    def __post_init__(self) -> None:
        fields.check(self, "consequences.")

    def harm(self, volume: float, reached: bool) -> float:
        """Return the cost of a volume of rock on the road [EUR]; `volume` in m3."""
        if not reached:
            return 0.0
        days = self.days_base + self.days_factor * volume**self.days_exponent
        return self.closure * days + self.clearing * volume


class Bill(NamedTuple):
    """Cost of a release [EUR]: harm on the road, and repair and emptying of barriers."""

    harm: float
    repair: float
