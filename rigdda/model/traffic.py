"""Traffic on the road: vehicles hit by rockfall, and the risk to life of their occupants.

A vehicle meets rock in one of two ways (Bunce et al. 1997):

- **A moving vehicle is hit by falling rock.** The density of vehicles is
  lambda = N_v / (24 V), with N_v vehicles per day in both directions and the speed V. Rock of width
  w along the road hits every vehicle of length L_v of which a part is within w, so that

      E[vehicles hit] = lambda (L_v + w).

  For w = 0 this is the temporal and spatial probability P(S:T) = N_v / 24 * L_v / V of Bunce et al.
  (1997), Hungr et al. (1999) and Fell et al. (2005). Nicolet et al. (2016) recommend taking the
  width of the rock into account, too.

- **A vehicle runs into debris that lies on the road.** Vehicles that are closer to the place than
  the decision sight distance D when the rock falls cannot stop:

      E[vehicles that run into debris] = lambda D.

  Alternatively, the probability that a vehicle runs into the debris of a release is given.

Expected fatalities are vehicles times occupancy times vulnerability, the probability of death of an
occupant. The individual risk is that of one person who travels the section a number of times per
year: the risk per passage is that of all vehicles divided by the N_v 365 passages of a year.

Sources: Bunce, Cruden and Morgenstern, Assessment of the hazard from rock fall on a highway,
Canadian Geotechnical Journal 34 (1997) 344-356; Hungr, Evans and Hazzard, Magnitude and frequency
of rock falls and rock slides along the main transportation corridors of southwestern British
Columbia, Canadian Geotechnical Journal 36 (1999) 224-238; Fell, Ho, Lacasse and Leroi, A framework
for landslide risk assessment and management, in: Landslide Risk Management (2005) 3-25; Australian
Geomechanics Society, Practice note guidelines for landslide risk management, Australian
Geomechanics 42 (2007) 63-114; Nicolet, Jaboyedoff, Cloutier, Crosta and Levy, Brief communication:
On direct impact probability of landslides on vehicles, Natural Hazards and Earth System Sciences 16
(2016) 995-1004.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import fields
from rigdda.errors import BadInput
from rigdda.fields import about, documented

Floats = NDArray[np.float64]

DAYS_PER_YEAR = 365.0
"""Days per year."""

ROUNDING = 1e-9
"""Relative tolerance for the number of passages of one person."""

REACTION, DECELERATION = 2.5, 3.4
"""Reaction time [s] and deceleration [m/s2] of the stopping sight distance of AASHTO (A Policy on
Geometric Design of Highways and Streets)."""

USUAL_VULNERABILITY = ((1.0, 0.3), (10.0, 1.0))
"""Default vulnerability by volume [m3, -]. The probabilities are those recommended by the
Australian Geomechanics Society (2007) for a vehicle that is damaged only (0 to 0.3) and for one
that is buried or crushed (0.9 to 1). The volumes are an assumption."""

DEFAULT_TRIPS = 500.0
"""Default number of trips of a commuter [1/year]."""

RUNS_INTO = 0.1
"""Default vulnerability in a vehicle that runs into debris [-]. It lies in the range from 0 to 0.3
of the Australian Geomechanics Society (2007) for a vehicle that is damaged only. It is below the
recommended 0.3 because most drivers have braked and pieces of rock seldom block all lanes."""

Probability = Annotated[float, about(ge=0.0, le=1.0)]
Size = Annotated[float, about(ge=0.0)]
Pairs = Annotated[tuple[tuple[Size, Size], ...], about(least=1)]
Distance = Annotated[float, about(ge=0.0, le=2000.0)]
Value = Annotated[float, about(ge=0.0, le=1e9)]


class TrafficConsequences(NamedTuple):
    """Expected consequences of releases for the traffic, each a float or an (n,) array.

    Parameters
    ----------
    hit, run_into : array
        Number of vehicles that falling rock hits, and that run into debris.
    fatalities : array
        Number of fatalities.
    """

    hit: Floats
    run_into: Floats
    fatalities: Floats


@documented
class Traffic(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Traffic on the road, for the risk to life.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, the sizes of `vulnerability` do not
        increase, both `decision_sight_distance` and `run_into` are given, or one person travels the
        section more often than all vehicles together.
    """

    vehicles_per_day: Annotated[
        float,
        about(
            "Average number of vehicles per day, both directions together.",
            "1/day",
            gt=0.0,
            le=1e6,
        ),
    ]
    speed: Annotated[
        float,
        about("Average speed of the vehicles.", "km/h", ge=1.0, le=300.0),
    ]
    section_length: Annotated[
        float,
        about(
            "Length of road below the slope. The number of vehicles and the individual risk are "
            "those of this section.",
            "m",
            gt=0.0,
            le=1e5,
        ),
    ]
    vehicle_length: Annotated[
        float, about("Average length of a vehicle.", "m", gt=0.0, le=100.0)
    ] = 5.4
    occupancy: Annotated[
        float, about("Average number of persons in a vehicle.", "-", gt=0.0, le=1000.0)
    ] = 1.5
    vulnerability: Annotated[
        Pairs | None,
        about(
            "Probability of death of a person in a vehicle that falling rock hits, as pairs [size, "
            "probability] with increasing sizes. It is interpolated linearly, and constant beyond "
            "the first and the last size. The size is the volume that reaches the road [m3] or the "
            "energy on it [kJ], see `vulnerability_by`. The default is [[1, 0.3], [10, 1]] in m3.",
            "m3 or kJ, and -",
        ),
    ] = None
    vulnerability_by: Annotated[
        str,
        about("Which size `vulnerability` refers to.", choices=("volume", "energy")),
    ] = "volume"
    vulnerability_run_into: Annotated[
        Probability,
        about(
            "Probability of death of a person in a vehicle that runs into debris on the road.", "-"
        ),
    ] = RUNS_INTO
    decision_sight_distance: Annotated[
        Distance | None,
        about(
            "Distance from which a driver can stop before debris on the road. Vehicles that are "
            "closer when the rock falls run into it. The default is the stopping sight distance at "
            "`speed` for a reaction time of 2.5 s and a deceleration of 3.4 m/s2.",
            "m",
        ),
    ] = None
    run_into: Annotated[
        Probability | None,
        about(
            "Instead of `decision_sight_distance`, the probability that a vehicle runs into the "
            "debris that a release leaves on the road, for example on a bend or at night.",
            "-",
        ),
    ] = None
    commuter_trips: Annotated[
        float,
        about(
            "Number of times per year that one person travels the section, for the individual "
            "risk. At most the number of trips of all vehicles in a year.",
            "1/year",
            ge=0.0,
            le=1e5,
        ),
    ] = DEFAULT_TRIPS
    fatality_value: Annotated[
        Value | None,
        about(
            "Value of a prevented fatality. If it is given, fatalities are part of the harm in Z, "
            "and `consequences.closure` must not include the risk to life.",
            "EUR",
        ),
    ] = None
    source: Annotated[str, about("Source of these values.")] = "orders of magnitude, from memory"

    def __post_init__(self) -> None:
        fields.check(self, "traffic.")
        if self.decision_sight_distance is not None and self.run_into is not None:
            hint = "leave it out: the decision_sight_distance says how many vehicles cannot stop"
            raise BadInput("traffic.run_into", self.run_into, hint)
        most = DAYS_PER_YEAR * self.vehicles_per_day * min(1.0, self.occupancy)
        if self.commuter_trips > most * (1.0 + ROUNDING):
            hint = (
                f"give at most {most:g}, the passages in a year of all vehicles with a person in "
                f"them: vehicles_per_day is {self.vehicles_per_day:g} and occupancy "
                f"{self.occupancy:g}; {DEFAULT_TRIPS:g} is the value if the key is left out"
            )
            raise BadInput("traffic.commuter_trips", self.commuter_trips, hint)
        if self.vulnerability is None:
            if self.vulnerability_by == "energy":
                hint = "also give traffic.vulnerability as pairs [energy in kJ, probability]"
                raise BadInput("traffic.vulnerability_by", "energy", hint)
            return
        last = -math.inf
        for i, (size, probability) in enumerate(self.vulnerability):
            where = f"traffic.vulnerability[{i}]"
            if probability > 1.0:
                hint = "give a probability from 0 to 1 as the second number"
                raise BadInput(where, [size, probability], hint)
            if size <= last:
                hint = f"list increasing sizes: the one before is {last:g}"
                raise BadInput(where, [size, probability], hint)
            last = size

    @property
    def density(self) -> float:
        """Vehicles per metre of road, both directions: lambda = N_v / (24 V) [1/m]."""
        return self.vehicles_per_day / (24.0 * 1000.0 * self.speed)

    @property
    def stopping(self) -> float:
        """Decision sight distance; by default V t + V^2 / (2 a) [m]."""
        if self.decision_sight_distance is not None:
            return self.decision_sight_distance
        v = self.speed / 3.6
        return v * REACTION + v * v / (2.0 * DECELERATION)

    def hit(self, width: ArrayLike) -> Floats:
        """Return the expected number of vehicles hit by rock of a width [m]: lambda (L_v + w)."""
        return self.density * (self.vehicle_length + np.asarray(width, dtype=np.float64))

    @property
    def stopped_late(self) -> float:
        """Expected number of vehicles that run into the debris of a release: lambda D."""
        return self.density * self.stopping if self.run_into is None else self.run_into

    def deadly(self, volume: ArrayLike, energy: ArrayLike) -> Floats:
        """Return the probability of death in a vehicle hit by rock.

        Parameters
        ----------
        volume : float or (n,) array
            Volume that reaches the road [m3].
        energy : float or (n,) array
            Largest energy of a block over the road [J].
        """
        sizes, chances = zip(*(self.vulnerability or USUAL_VULNERABILITY), strict=True)
        by_energy = self.vulnerability_by == "energy"
        size = np.asarray(energy, dtype=np.float64) / 1e3 if by_energy else np.asarray(volume)
        found: Floats = np.asarray(np.interp(size, sizes, chances))
        return found

    def consequences(
        self,
        reached: ArrayLike,
        lies: ArrayLike,
        width: ArrayLike,
        volume: ArrayLike,
        energy: ArrayLike,
    ) -> TrafficConsequences:
        """Return the expected consequences of releases, floats or (n,) arrays.

        Parameters
        ----------
        reached, lies : bool or array of bool
            Whether rock reaches the road, and whether rock lies on it at the end.
        width : float or array
            Width along the road [m].
        volume, energy : float or array
            As for `deadly`.
        """
        hit = np.where(reached, self.hit(width), 0.0)
        run_into = np.where(lies, self.stopped_late, 0.0)
        killed = hit * self.deadly(volume, energy) + run_into * self.vulnerability_run_into
        return TrafficConsequences(hit, run_into, self.occupancy * killed)

    def price(self, fatalities: ArrayLike) -> Floats:
        """Return the value of fatalities [EUR]; 0 without a value of a prevented fatality."""
        return (self.fatality_value or 0.0) * np.asarray(fatalities, dtype=np.float64)

    @property
    def person(self) -> float:
        """Individual risk divided by the expected fatalities on the section [-].

        A person makes `commuter_trips` of the N_v 365 passages of a year, and is one of `occupancy`
        persons in the vehicle.
        """
        return self.commuter_trips / (DAYS_PER_YEAR * self.vehicles_per_day * self.occupancy)
