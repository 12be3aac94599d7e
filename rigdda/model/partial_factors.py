"""Partial factors of the engineering rule for fences, UNI 11211-4.

With the characteristic velocity v, bounce height h and block mass m of a design event, a fence of
energy E, height H and elongation D at a clear distance d from the road satisfies the rule if

    E_d = 1/2 (m m_factors) (v v_factors)^2 risk <= E / energy
    h v_factors height + freeboard <= H
    D elongation <= d

where the factors on v are `trajectory` and `topography`, and those on m are `block_size` and
`density`. docs/howto/checks.md says which of the default values could be compared with a source.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from rigdda import fields
from rigdda.fields import about, documented

SERVICE = 1.0 / 3.0
"""Energy of the service energy level (SEL) divided by that of the maximum energy level (MEL) [-]: a
kit must withstand two impacts of a third of its class (ETAG 027, EAD 340059)."""

LEVELS = ("MEL", "SEL")
"""Energy levels of a kit: maximum, one impact; service, two impacts without repair."""

Factor = Annotated[float, about(ge=1.0, le=5.0)]


@documented
class PartialFactors(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Partial factors of the rule for fences and their source.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    quantile: Annotated[
        float,
        about(
            "Share of the passing blocks below the characteristic velocity and the characteristic "
            "bounce height, and share of the blocks of an event below its characteristic mass.",
            "-",
            ge=0.5,
            le=0.99,
        ),
    ] = 0.95
    trajectory: Annotated[
        Factor,
        about(
            "Factor on velocities and heights for the reliability of the trajectories: 1.02 if "
            "they were fitted to observations on the slope, 1.10 if the ground has values from the "
            "literature.",
            "-",
        ),
    ] = 1.10
    topography: Annotated[
        Factor,
        about(
            "Factor on velocities and heights for the survey of the slope: 1.02 for a precise "
            "one, 1.10 for a rough one.",
            "-",
        ),
    ] = 1.02
    block_size: Annotated[
        Factor,
        about(
            "Factor on the mass for the survey of the block sizes: 1.02 for a precise one, 1.10 "
            "for a rough one.",
            "-",
        ),
    ] = 1.02
    density: Annotated[
        Factor, about("Factor on the mass for the density of the rock; usually 1.", "-")
    ] = 1.0
    risk: Annotated[
        Factor,
        about(
            "Factor on the energy for the consequences of a failure: from 1.0 for modest damage "
            "up to 1.2 for danger to life.",
            "-",
        ),
    ] = 1.0
    level: Annotated[
        str,
        about(
            'Energy level at which a fence is used: "MEL", the energy of its class, or "SEL", a '
            "third of this energy, which the fence withstands twice without repair.",
            choices=LEVELS,
        ),
    ] = "MEL"
    energy: Annotated[
        Factor,
        about(
            "Factor by which the energy of the fence is divided: 1.2 at MEL; 1.0 is usual at SEL.",
            "-",
        ),
    ] = 1.2
    height: Annotated[
        Factor,
        about(
            "Factor on bounce heights in addition to those for trajectories and topography.", "-"
        ),
    ] = 1.0
    freeboard: Annotated[
        float,
        about(
            "Least height of the fence above the design height of the centre of a block. It is at "
            "least the mean radius of the blocks.",
            "m",
            ge=0.0,
            le=10.0,
        ),
    ] = 0.5
    elongation: Annotated[
        Factor,
        about("Factor on the elongation of the fence for the clear distance to the road.", "-"),
    ] = 1.3
    source: Annotated[str, about("Source of the factors.")] = (
        "UNI 11211-4:2012, EAD 340059; risk, energy and elongation from memory"
    )

    def __post_init__(self) -> None:
        fields.check(self, "rule.")

    @property
    def velocity(self) -> float:
        """Factor on velocities [-]."""
        return self.trajectory * self.topography

    @property
    def mass(self) -> float:
        """Factor on masses [-]."""
        return self.block_size * self.density

    def rated(self, energy_class: int) -> float:
        """Return the energy of a class at the chosen level, before the factor `energy` [J]."""
        return 1e3 * energy_class * (1.0 if self.level == "MEL" else SERVICE)
