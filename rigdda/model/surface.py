"""Surfaces and interfaces: friction, strength, restitution and damping of contacts."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from rigdda import fields
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.model.grounds import GROUNDS

MOST_DAMPING = 100.0
"""Maximum plausible damping [1/s]."""


_OPEN: Any = msgspec.UNSET
"""Default of the fields that a surface takes from its ground."""

PLAIN = {
    "friction_deg": 30.0,
    "restitution": 0.0,
    "damping": None,
    "friction_sd_deg": 0.0,
    "restitution_sd": 0.0,
    "damping_sd": 0.0,
    "roughness": 0.0,
}
"""Values of a surface without a ground."""


Damping = Annotated[float, about(ge=0.0, le=MOST_DAMPING)]
Share = Annotated[float, about(ge=0.0, le=1.0)]


@documented
class Surface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Friction, strength, restitution and damping of a surface.

    A surface with a `ground` of the library takes from it all values that it does not specify
    itself. `Site.realise` varies the values that have a standard deviation, and the pits of the
    ground, for each release; scenes built directly use the values unchanged. In Python
    `restitution` may be None, which gives the plain penalty contact of the paper, whose rebound
    follows from time step and stiffness. With `damping` None, the damping of the scene or of the
    site is used.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, or the library has no such ground.
    """

    friction_deg: Annotated[
        float, about("Coulomb friction angle. Without a ground 30.", "deg", ge=0.0, le=89.9)
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
            "Coefficient of restitution of a central impact; 0: plastic. Without a ground 0.",
            "-",
        ),
    ] = _OPEN
    damping: Annotated[
        Damping | None,
        about(
            "Mass-proportional damping of a block while it touches the surface, and for 0.1 s "
            "afterwards. If a block touches several surfaces, the greatest damping applies. "
            "Without a ground, the damping of the site.",
            "1/s",
        ),
    ] = _OPEN
    friction_sd_deg: Annotated[
        float,
        about(
            "Standard deviation of the friction angle from release to release. Without a ground 0.",
            "deg",
            ge=0.0,
            le=15.0,
        ),
    ] = _OPEN
    restitution_sd: Annotated[
        float,
        about(
            "Standard deviation of the restitution from release to release. Without a ground 0.",
            "-",
            ge=0.0,
            le=0.5,
        ),
    ] = _OPEN
    damping_sd: Annotated[
        Damping,
        about(
            "Standard deviation of the damping from release to release. Without a ground 0.", "1/s"
        ),
    ] = _OPEN
    roughness: Annotated[
        float,
        about(
            "Root-mean-square depth of pits in the ground, which are about one block size apart. "
            "Ground that overhangs or is steeper than 79 degrees has none. Without a ground 0.",
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

    def __post_init__(self) -> None:
        fields.check(self)
        usual = GROUNDS[self.ground].values if self.ground else PLAIN
        for name, value in usual.items():
            if getattr(self, name) is msgspec.UNSET:
                msgspec.structs.force_setattr(self, name, value)

    @property
    def varies(self) -> bool:
        """Whether its friction, restitution or damping vary from release to release."""
        return self.friction_sd_deg > 0.0 or self.restitution_sd > 0.0 or self.damping_sd > 0.0


def smaller(a: Surface, b: Surface) -> Surface:
    """Return the contact properties of two surfaces: the smaller value of each.

    If only one of the surfaces specifies a damping, that one is used.
    """
    stated = [x.damping for x in (a, b) if x.damping is not None]
    return Surface(
        damping=min(stated, default=None),
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
    damping: Annotated[
        Damping | None,
        about(
            "Mass-proportional damping of blocks in contact. The default is the damping that the "
            "two surfaces have without this table.",
            "1/s",
        ),
    ] = None

    @property
    def surface(self) -> Surface:
        """Its contact properties as a `Surface`."""
        return Surface(
            friction_deg=self.friction_deg,
            cohesion=self.cohesion,
            tension=self.tension,
            restitution=self.restitution,
            damping=self.damping,
        )


def check_surface(where: str, surface: Surface) -> None:
    """Check that the friction angle of a surface is plausible.

    Raises
    ------
    BadInput
        If it looks like a tangent or an angle in radians.
    """
    angle = surface.friction_deg
    if 0.0 < angle < 1.0:
        mend = f"give degrees, such as 30: {angle:g} looks like a tangent or radians"
        raise BadInput(f"{where}.friction_deg", angle, mend)
