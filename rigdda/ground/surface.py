"""Surfaces and interfaces: friction, strength, restitution and rolling resistance of contacts."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import msgspec

from rigdda import fields
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.ground.grounds import GROUNDS

_OPEN: Any = msgspec.UNSET
"""Default of the fields that a surface takes from its ground."""

WITHOUT_GROUND = {
    "friction_deg": 30.0,
    "restitution": 0.0,
    "rolling": 0.0,
    "friction_sd_deg": 0.0,
    "restitution_sd": 0.0,
    "rolling_sd": 0.0,
    "roughness": 0.0,
    "restitution_speed": None,
}
"""Values of a surface without a ground."""


RETIRED = {
    name: "remove it: losses follow from rolling resistance; give `rolling`, or name a ground"
    for name in ("damping", "damping_sd")
}
"""Former keys of surfaces and interfaces, and what to do about them."""

Share = Annotated[float, about(ge=0.0, le=1.0)]
Speed = Annotated[float, about(gt=0.0)]


@documented
class Surface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Friction, strength, restitution and rolling resistance of a surface.

    A surface with a `ground` of the library takes from it all values that it does not specify
    itself. `Site.realise` varies the values that have a standard deviation, and the pits of the
    ground, for each release; scenes built directly use the values unchanged. In Python
    `restitution` may be None, which gives the plain penalty contact of the paper, whose rebound
    follows from time step and stiffness.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, or the library has no such ground.
    """

    friction_deg: Annotated[
        float, about("Coulomb friction angle. Without a ground, it is 30.", "deg", ge=0.0, le=89.9)
    ] = _OPEN
    cohesion: Annotated[
        float,
        about(
            "Shear strength, in addition to friction, of a joint that is closed at the start. The "
            "joint breaks as a whole and permanently.",
            "Pa",
            ge=0.0,
        ),
    ] = 0.0
    tension: Annotated[
        float,
        about("Tensile strength of a joint that is closed at the start.", "Pa", ge=0.0),
    ] = 0.0
    restitution: Annotated[
        Share | None,
        about(
            "Coefficient of restitution of a central impact; 0: plastic. Without a ground, it is "
            "0.",
            "-",
        ),
    ] = _OPEN
    rolling: Annotated[
        Share,
        about(
            "Coefficient c of rolling resistance. In each contact, a moment of at most c N R acts "
            "against the rotation of a block, with the normal force N and R = sqrt(2 I/m) from its "
            "moment of inertia I and mass m. Without a ground, it is 0; in a site file, that of "
            "the library ground that matches the name of the surface, with a warning.",
            "-",
        ),
    ] = _OPEN
    friction_sd_deg: Annotated[
        float,
        about(
            "Standard deviation of the friction angle from release to release. "
            "Without a ground, it is 0.",
            "deg",
            ge=0.0,
            le=15.0,
        ),
    ] = _OPEN
    restitution_sd: Annotated[
        float,
        about(
            "Standard deviation of the restitution from release to release. "
            "Without a ground, it is 0.",
            "-",
            ge=0.0,
            le=0.5,
        ),
    ] = _OPEN
    rolling_sd: Annotated[
        float,
        about(
            "Standard deviation of the coefficient of rolling resistance from release to release. "
            "Without a ground, it is 0.",
            "-",
            ge=0.0,
            le=0.5,
        ),
    ] = _OPEN
    roughness: Annotated[
        float,
        about(
            "Root-mean-square depth of pits in the ground, which are about one block size apart. "
            "Ground that overhangs or is steeper than 79 degrees has none. Without a "
            "ground, it is 0.",
            "m",
            ge=0.0,
            le=2.0,
        ),
    ] = _OPEN
    ground: Annotated[
        str,
        about(
            "Name of a ground in the library, whose typical values are used if no others are "
            "given. In Python, a copy of a surface with another ground keeps its values.",
            choices=(*GROUNDS, ""),
        ),
    ] = ""
    restitution_speed: Annotated[
        Speed | None,
        about(
            "Impact speed K at which restitution has fallen to half: at speed v it is "
            "e/(1 + (v/K)^2), where e is `restitution` (Pfeiffer and Bowen 1989, with K = "
            "9.144 m/s in RocFall). Without a ground, restitution does not depend on speed.",
            "m/s",
        ),
    ] = _OPEN

    retired: ClassVar[dict[str, str]] = RETIRED

    def __post_init__(self) -> None:
        fields.check(self)
        usual = GROUNDS[self.ground].values if self.ground else WITHOUT_GROUND
        for name, value in usual.items():
            if getattr(self, name) is msgspec.UNSET:
                msgspec.structs.force_setattr(self, name, value)

    @property
    def varies(self) -> bool:
        """Whether its friction, restitution or rolling resistance vary from release to release."""
        return self.friction_sd_deg > 0.0 or self.restitution_sd > 0.0 or self.rolling_sd > 0.0


def smaller(a: Surface, b: Surface) -> Surface:
    """Return the contact properties of two surfaces: the smaller value of each.

    A `restitution_speed` of None counts as infinite.
    """
    speeds = [s.restitution_speed for s in (a, b) if s.restitution_speed is not None]
    return Surface(
        rolling=min(a.rolling, b.rolling),
        restitution_speed=min(speeds, default=None),
        friction_deg=min(a.friction_deg, b.friction_deg),
        cohesion=min(a.cohesion, b.cohesion),
        tension=min(a.tension, b.tension),
        restitution=None
        if a.restitution is None or b.restitution is None
        else min(a.restitution, b.restitution),
    )


@documented
class Interface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Contact properties of a pair of surfaces.

    Without such a table, rock on the ground has the properties of the ground, and any other pair
    has the smaller value of each property. The values are checked with the site.
    """

    first: Annotated[str, about("Name of one of the surfaces.")]
    second: Annotated[str, about("Name of the other surface.")]
    friction_deg: Annotated[float, about("Coulomb friction angle.", "deg", ge=0.0, le=89.9)] = 30.0
    cohesion: Annotated[
        float,
        about(
            "Shear strength, in addition to friction, of a joint that is closed at the start.",
            "Pa",
            ge=0.0,
        ),
    ] = 0.0
    tension: Annotated[
        float, about("Tensile strength of a joint that is closed at the start.", "Pa", ge=0.0)
    ] = 0.0
    restitution: Annotated[
        Share | None, about("Coefficient of restitution of a central impact.", "-")
    ] = 0.0
    rolling: Annotated[
        Share | None,
        about(
            "Coefficient of rolling resistance. The default is that which the two surfaces have "
            "without this table.",
            "-",
        ),
    ] = None
    restitution_speed: Annotated[
        Speed | None,
        about(
            "Impact speed at which restitution has fallen to half. By default, restitution does "
            "not depend on speed.",
            "m/s",
        ),
    ] = None

    retired: ClassVar[dict[str, str]] = RETIRED

    @property
    def surface(self) -> Surface:
        """Its contact properties as a `Surface`, with rolling resistance 0 if it is not given."""
        return Surface(
            friction_deg=self.friction_deg,
            cohesion=self.cohesion,
            tension=self.tension,
            restitution=self.restitution,
            rolling=0.0 if self.rolling is None else self.rolling,
            restitution_speed=self.restitution_speed,
        )


def check_friction(where: str, angle: float) -> None:
    """Check that a friction angle [deg] of the table `where` is plausible.

    Raises
    ------
    BadInput
        If it looks like a tangent or an angle in radians.
    """
    if 0.0 < angle < 1.0:
        hint = f"give degrees, such as 30: {angle:g} looks like a tangent or radians"
        raise BadInput(f"{where}.friction_deg", angle, hint)
