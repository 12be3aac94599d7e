"""Surfaces: their strength, rebound and loss, and what counts where two of them meet."""

from __future__ import annotations

from typing import Any

import msgspec

from rigdda import check
from rigdda.errors import BadInput
from rigdda.model.grounds import GROUNDS

MOST_DAMPING = 100.0
"""Greatest damping that can be meant [1/s]."""


_OPEN: Any = msgspec.UNSET
"""Default of what a surface takes from its ground."""

PLAIN = {
    "friction_deg": 30.0,
    "restitution": 0.0,
    "damping": None,
    "friction_sd_deg": 0.0,
    "restitution_sd": 0.0,
    "damping_sd": 0.0,
    "roughness": 0.0,
}
"""Values of a surface that names no ground."""


class Surface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Strength, rebound and loss of a surface.

    The standard deviations and the roughness are drawn by `Site.realise` for each release; a scene
    that is built by hand uses the other values as they are.

    Parameters
    ----------
    friction_deg : float
        Coulomb friction angle [deg], from 0 to below 90. Without a ground 30.
    cohesion, tension : float
        Strength of a joint that is closed at the start, in shear beside friction and in tension
        [Pa]; it breaks once, as a whole.
    restitution : float or None
        Coefficient of restitution of a central impact, 0 (plastic) to 1. Without a ground 0. None:
        the paper's plain penalty contact, whose rebound is what step and stiffness make of it; in
        Python only, site files have no word for it.
    damping : float or None
        Mass-proportional damping [1/s] of a block that touches the surface, or did within 0.1 s.
        None, the default without a ground: the damping of the scene or of the site. If a block
        touches several surfaces, the greatest damping counts.
    friction_sd_deg, restitution_sd, damping_sd : float
        Standard deviations of friction [deg], restitution [-] and damping [1/s] from release to
        release. Without a ground 0.
    roughness : float
        Root-mean-square depth of pits in the ground [m], one in each length of a block. Without a
        ground 0. Ground that overhangs, or is steeper than 79 degrees, has no pits.
    ground : str
        Name of its ground in the library (`rigdda.grounds`), whose typical values it takes where
        the others are not given. To change the ground of a surface, make a new one: a copy with
        another ground keeps its values.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range, or the library has no such ground.
    """

    friction_deg: float = _OPEN
    cohesion: float = 0.0
    tension: float = 0.0
    restitution: float | None = _OPEN
    damping: float | None = _OPEN
    friction_sd_deg: float = _OPEN
    restitution_sd: float = _OPEN
    damping_sd: float = _OPEN
    roughness: float = _OPEN
    ground: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.ground, str) or self.ground not in ("", *GROUNDS):
            raise BadInput("ground", self.ground, f"choose one of {', '.join(GROUNDS)}")
        msgspec.structs.force_setattr(self, "ground", str(self.ground))
        usual = GROUNDS[self.ground].values if self.ground else PLAIN
        for name, value in usual.items():
            if getattr(self, name) is msgspec.UNSET:
                msgspec.structs.force_setattr(self, name, value)
        check.set_number(self, "friction_deg", 0.0, 89.9)
        check.set_number(self, "cohesion", 0.0)
        check.set_number(self, "tension", 0.0)
        if self.restitution is not None:
            check.set_number(self, "restitution", 0.0, 1.0)
        if self.damping is not None:
            check.set_number(self, "damping", 0.0, MOST_DAMPING)
        check.set_number(self, "friction_sd_deg", 0.0, 15.0)
        check.set_number(self, "restitution_sd", 0.0, 0.5)
        check.set_number(self, "damping_sd", 0.0, MOST_DAMPING)
        check.set_number(self, "roughness", 0.0, 2.0)

    @property
    def varies(self) -> bool:
        """Whether releases draw its friction, restitution or damping."""
        return self.friction_sd_deg > 0.0 or self.restitution_sd > 0.0 or self.damping_sd > 0.0


def smaller(a: Surface, b: Surface) -> Surface:
    """Return the properties of the contact between two surfaces: the smaller of each.

    Damping is that of the one that states it, where the other leaves it to the scene.
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
    damping : float
        Mass-proportional damping of blocks that touch [1/s]; by default that which the two would
        have without this table.
    """

    first: str
    second: str
    friction_deg: float = 30.0
    cohesion: float = 0.0
    tension: float = 0.0
    restitution: float | None = 0.0
    damping: float | None = None

    @property
    def surface(self) -> Surface:
        """Its properties."""
        return Surface(
            friction_deg=self.friction_deg,
            cohesion=self.cohesion,
            tension=self.tension,
            restitution=self.restitution,
            damping=self.damping,
        )


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
