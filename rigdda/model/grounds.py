"""The library of grounds: friction, restitution, damping and roughness of what slopes are made of.

A surface names its ground (``ground = "meadow"``) and overrides what is known of it. Each number
has a typical value and a plausible range, and says where it comes from. The numbers are those of
rigid blocks with corners: restitution is that of a central impact, friction that of a corner that
slides, and damping is what a block loses beside both while it touches the ground. They are not the
coefficients of a point mass, whose normal restitution also depends on how the block turns.
"""

from __future__ import annotations

from typing import NamedTuple


class Span(NamedTuple):
    """A typical value, the plausible range about it and the source of both."""

    typical: float
    low: float
    high: float
    source: str


class Ground(NamedTuple):
    """What a ground does to a block that strikes it and slides or rolls on it."""

    words: str
    """What it is, in a few words."""
    friction_deg: Span
    """Coulomb friction angle of rock on it [deg]."""
    restitution: Span
    """Coefficient of restitution of a central impact [-]."""
    damping: Span
    """Mass-proportional damping of a block that touches it [1/s]."""
    roughness: Span
    """Standard deviation of its height at the scale of a block [m]."""
    friction_sd_deg: float
    """Standard deviation of friction from release to release [deg]."""
    restitution_sd: float
    """The same of restitution [-]."""
    damping_sd: float
    """The same of damping [1/s]."""

    @property
    def values(self) -> dict[str, float]:
        """The fields of a `Surface` that it fills in, at their typical values."""
        return {
            "friction_deg": self.friction_deg.typical,
            "restitution": self.restitution.typical,
            "damping": self.damping.typical,
            "friction_sd_deg": self.friction_sd_deg,
            "restitution_sd": self.restitution_sd,
            "damping_sd": self.damping_sd,
            "roughness": self.roughness.typical,
        }


GROUNDS: dict[str, Ground] = {
    "hard_rock": Ground(
        "bare hard rock",
        Span(35.0, 25.0, 42.0, "Wyllie (2014); ends assumed"),
        Span(0.30, 0.15, 0.55, "Wyllie (2014); STONE .65 for points"),
        Span(0.3, 0.0, 1.0, "assumed"),
        Span(0.0, 0.0, 0.2, "assumed"),
        3.0,
        0.08,
        0.1,
    ),
    "weathered_rock": Ground(
        "weathered rock",
        Span(35.0, 25.0, 42.0, "Wyllie (2014); ends assumed"),
        Span(0.30, 0.15, 0.55, "Wyllie (2014); STONE .65 for points"),
        Span(0.3, 0.0, 1.0, "assumed"),
        Span(0.0, 0.0, 0.2, "assumed"),
        3.0,
        0.08,
        0.1,
    ),
    "hard_soil": Ground(
        "bare hard rock",
        Span(35.0, 25.0, 42.0, "Wyllie (2014); ends assumed"),
        Span(0.30, 0.15, 0.55, "Wyllie (2014); STONE .65 for points"),
        Span(0.3, 0.0, 1.0, "assumed"),
        Span(0.0, 0.0, 0.2, "assumed"),
        3.0,
        0.08,
        0.1,
    ),
    "concrete": Ground(
        "bare hard rock",
        Span(35.0, 25.0, 42.0, "Wyllie (2014); ends assumed"),
        Span(0.30, 0.15, 0.55, "Wyllie (2014); STONE .65 for points"),
        Span(0.3, 0.0, 1.0, "assumed"),
        Span(0.0, 0.0, 0.2, "assumed"),
        3.0,
        0.08,
        0.1,
    ),
    "asphalt": Ground(
        "bare hard rock",
        Span(35.0, 25.0, 42.0, "Wyllie (2014); ends assumed"),
        Span(0.30, 0.15, 0.55, "Wyllie (2014); STONE .65 for points"),
        Span(0.3, 0.0, 1.0, "assumed"),
        Span(0.0, 0.0, 0.2, "assumed"),
        3.0,
        0.08,
        0.1,
    ),
    "meadow": Ground(
        "bare hard rock",
        Span(35.0, 25.0, 42.0, "Wyllie (2014); ends assumed"),
        Span(0.30, 0.15, 0.55, "Wyllie (2014); STONE .65 for points"),
        Span(0.3, 0.0, 1.0, "assumed"),
        Span(0.0, 0.0, 0.2, "assumed"),
        3.0,
        0.08,
        0.1,
    ),
}
"""Every ground of the library by its name."""

USUAL = {"rock": "hard_rock", "soil": "hard_soil", "concrete": "concrete", "asphalt": "asphalt"}
"""Ground of a surface that names none, by the name of the surface."""

OTHER = "weathered_rock"
"""Ground of a surface of any other name."""
