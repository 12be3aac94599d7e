"""Library of grounds: contact properties and roughness of common slope materials.

A surface refers to its ground (``ground = "meadow"``) and overrides known values. Each value has a
typical value, a plausible range and a source. The values are those of rigid blocks with corners:
restitution is that of a central impact, friction that of a sliding corner, and rolling resistance
is a moment against the rotation of a block in contact with the ground. They are not the
coefficients of a point mass, whose normal restitution also depends on the rotation of the block.
"""

from __future__ import annotations

from typing import NamedTuple


class Span(NamedTuple):
    """A typical value, its plausible range and the source of both."""

    typical: float
    low: float
    high: float
    source: str


class Ground(NamedTuple):
    """Contact properties of a ground for blocks that hit it and slide or roll on it."""

    words: str
    """Short description."""
    friction_deg: Span
    """Coulomb friction angle of rock on it [deg]."""
    restitution: Span
    """Coefficient of restitution of a central impact [-]."""
    rolling: Span
    """Coefficient of rolling resistance of a block in contact with it [-]."""
    roughness: Span
    """Root-mean-square depth of its pits at the scale of a block [m]."""
    friction_sd_deg: float
    """Standard deviation of friction from release to release [deg]."""
    restitution_sd: float
    """Standard deviation of restitution from release to release [-]."""
    rolling_sd: float
    """Standard deviation of rolling resistance from release to release [-]."""
    restitution_speed: float | None = None
    """Impact speed at which restitution has fallen to half [m/s]; None: it does not fall."""

    @property
    def values(self) -> dict[str, float | None]:
        """The fields of a `Surface` that it provides, at their typical values."""
        return {
            "friction_deg": self.friction_deg.typical,
            "restitution": self.restitution.typical,
            "rolling": self.rolling.typical,
            "friction_sd_deg": self.friction_sd_deg,
            "restitution_sd": self.restitution_sd,
            "rolling_sd": self.rolling_sd,
            "roughness": self.roughness.typical,
            "restitution_speed": self.restitution_speed,
        }


GROUNDS: dict[str, Ground] = {
    "hard_rock": Ground(
        "bare hard rock",
        Span(35.0, 25.0, 42.0, "RocFall's default for rigid bodies 27, RAMMS 39; high end assumed"),
        Span(0.3, 0.15, 0.55, "Wyllie (2014), square impacts .2; STONE, points .65"),
        Span(0.05, 0.0, 0.15, "assumed: half of weathered rock"),
        Span(0.0, 0.0, 0.1, "assumed"),
        3.0,
        0.05,
        0.02,
    ),
    "weathered_rock": Ground(
        "weathered or shattered rock, benches of a mine",
        Span(32.0, 20.0, 38.0, "PyRockfall, coal measures 20; RAMMS 29; high end assumed"),
        Span(0.45, 0.2, 0.6, "assumed at low speed; at 10 m/s it is .2, as Wyllie (2014) gives"),
        Span(0.1, 0.04, 0.25, "fitted to the catch bench of Restrepo et al. (2025)"),
        Span(0.0, 0.0, 0.15, "assumed"),
        4.0,
        0.06,
        0.03,
        9.144,
    ),
    "coarse_talus": Ground(
        "talus of blocks",
        Span(38.0, 30.0, 50.0, "PyRockfall, talus 35; angle of repose 35 to 40, from memory"),
        Span(0.2, 0.05, 0.38, "PyRockfall, points .30; Wyllie (2014), square impacts .2"),
        Span(0.15, 0.05, 0.4, "assumed: about meadow, in a wider range"),
        Span(0.0, 0.0, 0.3, "assumed"),
        4.0,
        0.05,
        0.05,
    ),
    "fine_scree": Ground(
        "fine scree",
        Span(35.0, 28.0, 40.0, "angle of repose, from memory"),
        Span(0.12, 0.02, 0.33, "STONE, points .45; Rockyfor3D, points .33, from memory"),
        Span(0.2, 0.08, 0.5, "assumed: more than meadow"),
        Span(0.0, 0.0, 0.1, "assumed"),
        3.0,
        0.04,
        0.05,
    ),
    "hard_soil": Ground(
        "firm soil, gravel, compacted fill",
        Span(32.0, 20.0, 38.0, "RAMMS medium 19; PyRockfall, floor 30; high end assumed"),
        Span(0.2, 0.05, 0.35, "STONE, points .15 to .35; RocFall, points .30, from memory"),
        Span(0.12, 0.04, 0.3, "assumed: a little less than meadow"),
        Span(0.0, 0.0, 0.1, "assumed"),
        3.0,
        0.05,
        0.04,
    ),
    "meadow": Ground(
        "meadow, soft soil",
        Span(45.0, 34.0, 60.0, "fitted to Tschamut and Chant Sura"),
        Span(0.49, 0.2, 0.75, "fitted to Tschamut and Chant Sura"),
        Span(0.14, 0.05, 0.3, "fitted to Tschamut and Chant Sura"),
        Span(0.0, 0.0, 0.06, "assumed; roughness did not improve the fit to Tschamut"),
        6.4,
        0.05,
        0.03,
        9.144,
    ),
    "asphalt": Ground(
        "asphalt",
        Span(33.0, 27.0, 38.0, "from memory"),
        Span(0.25, 0.1, 0.4, "Wyllie (2014), square impacts .2; RocFall, points .40, from memory"),
        Span(0.03, 0.0, 0.1, "assumed"),
        Span(0.0, 0.0, 0.02, "assumed"),
        2.0,
        0.04,
        0.01,
    ),
    "concrete": Ground(
        "concrete",
        Span(33.0, 27.0, 38.0, "from memory"),
        Span(0.3, 0.15, 0.5, "Wyllie (2014), square impacts .2; ends assumed"),
        Span(0.03, 0.0, 0.1, "assumed"),
        Span(0.0, 0.0, 0.01, "assumed"),
        2.0,
        0.04,
        0.01,
    ),
}
"""Grounds of the library by name."""

USUAL = {"rock": "hard_rock", "soil": "hard_soil", "concrete": "concrete", "asphalt": "asphalt"}
"""Ground of a surface that does not specify one, by the name of the surface."""

OTHER = "weathered_rock"
"""Ground of a surface with any other name that does not specify one."""
