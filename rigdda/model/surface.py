"""Surfaces: how strong they are, how rock rebounds from them, what counts where two meet."""

from __future__ import annotations

import msgspec

from rigdda import fields
from rigdda.errors import BadInput


class Surface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Strength and rebound of a surface.

    Parameters
    ----------
    friction_deg : float
        Coulomb friction angle [deg], from 0 to below 90.
    cohesion, tension : float
        Strength of a joint that is closed at the start, in shear beside friction and in tension
        [Pa]; it breaks once, as a whole.
    restitution : float or None
        Coefficient of restitution of a central impact, 0 (plastic) to 1. None: the paper's plain
        penalty contact, whose rebound is what step and stiffness make of it; in Python only, site
        files have no word for it.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    friction_deg: float = 30.0
    cohesion: float = 0.0
    tension: float = 0.0
    restitution: float | None = 0.0

    def __post_init__(self) -> None:
        fields.set_number(self, "friction_deg", 0.0, 89.9)
        fields.set_number(self, "cohesion", 0.0)
        fields.set_number(self, "tension", 0.0)
        if self.restitution is not None:
            fields.set_number(self, "restitution", 0.0, 1.0)


def smaller(a: Surface, b: Surface) -> Surface:
    """Return the properties of the contact between two surfaces: the smaller of each."""
    return Surface(
        friction_deg=min(a.friction_deg, b.friction_deg),
        cohesion=min(a.cohesion, b.cohesion),
        tension=min(a.tension, b.tension),
        restitution=None
        if a.restitution is None or b.restitution is None
        else min(a.restitution, b.restitution),
    )


class Interface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How two surfaces meet, instead of what follows from each.

    Without one, rock on the ground meets the ground's surface, and otherwise the smaller of each
    property counts.

    Parameters
    ----------
    first : str
        Name of the one surface.
    second : str
        Name of the other.
    friction_deg : float
        Coulomb friction angle [deg].
    cohesion, tension : float
        Strength of a joint that is closed at the start [Pa].
    restitution : float
        Coefficient of restitution [-].
    """

    first: str
    second: str
    friction_deg: float = 30.0
    cohesion: float = 0.0
    tension: float = 0.0
    restitution: float | None = 0.0

    @property
    def surface(self) -> Surface:
        """Its properties."""
        return Surface(self.friction_deg, self.cohesion, self.tension, self.restitution)


def check_surface(where: str, surface: Surface) -> None:
    """Check that the friction of a surface can be meant.

    Raises
    ------
    BadInput
        If it looks like a tangent or an angle in radians.
    """
    angle = surface.friction_deg
    if 0.0 < angle < 1.0:
        mend = f"give degrees, such as 30: {angle:g} looks like a tangent or radians"
        raise BadInput(f"{where}.friction_deg", angle, mend)
