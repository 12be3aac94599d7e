"""Hard cases of strength: friction and cohesion at their limits, penalties of any stiffness."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from experiments.hard_cases.case import Case, History
from experiments.hard_cases.shapes import way_error
from experiments.hard_cases.stacks import cubes, moved, on_level
from rigdda import Scene, Surface, Terrain
from rigdda.validation.scenes import FLAT, GRAVITY, box, incline, masses

CREEP = 1e-4
"""Displacement up to which a block on a slope counts as held [m]."""

STEEP, ROUGH = 60.0, 20.0
"""Slope of the joint held by cohesion, and its friction angle [deg]."""


def slope(
    name: str, slope_deg: float, friction_deg: float, height: float, time: float, bar: float
) -> Case:
    """Return the case of a block 1 m long that holds on a slope or slides by the closed form."""
    holds = friction_deg > slope_deg
    return Case(
        name,
        "creep [m]: none" if holds else "way [-]: g t^2/2 (sin th - cos th tan phi)",
        lambda: incline(slope_deg, friction_deg, 1.0, height)[0],
        time,
        moved if holds else way_error(slope_deg, friction_deg),
        bar,
        settings={"sleeping": False},
    )


def bonded(share: float) -> Callable[[], Scene]:
    """Return a builder of a block on a steep joint with `share` of the required cohesion.

    c L = W (sin th - cos th tan phi), for a joint of 1 m. The block is thin so that the pressure on
    its joint is uniform, because joints break where the pressure is least.
    """

    def build() -> Scene:
        plain, _ = incline(STEEP, ROUGH, 1.0, 0.02)
        weight = GRAVITY * float(masses(plain)[0][0])
        th, phi = math.radians(STEEP), math.radians(ROUGH)
        need = weight * (math.sin(th) - math.cos(th) * math.tan(phi))
        surface = Surface(friction_deg=ROUGH, cohesion=share * need)
        return Scene(plain.terrain, plain.blocks, {"rock": surface})

    return build


def hung(share: float) -> Callable[[], Scene]:
    """Return a builder of a cube bonded below a fixed one with `share` of the required tension."""

    def build() -> Scene:
        blocks = (box(0.0, 6.0, fixed=True), box(0.0, 5.0))
        weight = GRAVITY * float(masses(on_level(*blocks))[0][1])
        surface = Surface(30.0, cohesion=10.0 * weight, tension=share * weight)
        return Scene(Terrain(FLAT), blocks, {"rock": surface})

    return build


def fall_error(history: History) -> float:
    """Return the relative error of the free fall distance of the last block [-]."""
    way = history.poses[0, -1, 1] - history.poses[-1, -1, 1]
    return float(abs(way / (0.5 * GRAVITY * history.times[-1] ** 2) - 1.0))


SOFTNESS = 0.02
"""Target penetration of the soft tower [m]."""


def uneven_sinking(history: History) -> float:
    """Return the greatest settlement of a block of a soft tower over the permitted one [-].

    Joint k from the ground may compress by at most the target penetration under its load.
    """
    sunk = history.poses[0, :, 1] - history.poses[-1, :, 1]
    allowed = SOFTNESS * np.arange(1, len(sunk) + 1)
    sway = np.abs(history.poses[-1, :, 0] - history.poses[0, :, 0])
    return float(max((sunk / allowed).max(), sway.max() / SOFTNESS))


CASES = (
    slope("near-limit-holds", 30.0, 30.05, 0.5, 20.0, CREEP),
    slope("near-limit-slides", 30.0, 29.95, 0.5, 20.0, 1e-2),
    slope("friction-0", 1.0, 0.0, 1.0, 5.0, 1e-3),
    slope("friction-85", 80.0, 85.0, 0.1, 20.0, CREEP),
    Case("cohesion-just-holds", "creep [m]: none", bonded(1.02), 20.0, moved, CREEP),
    Case(
        "cohesion-just-breaks",
        "way [-]: g t^2/2 (sin th - cos th tan phi)",
        bonded(0.98),
        2.0,
        way_error(STEEP, ROUGH),
        1e-2,
    ),
    Case("tension-just-holds", "displacement [m]: none", hung(1.02), 20.0, moved, CREEP),
    Case("tension-just-breaks", "way [-]: g t^2/2", hung(0.98), 0.8, fall_error, 1e-2),
    Case(
        "penalty-stiff",
        "displacement [m]: none, it stands",
        lambda: on_level(*cubes([2600.0] * 10)),
        20.0,
        moved,
        1e-3,
        settings={"penetration": 1e-9, "sleeping": False},
    ),
    Case(
        "penalty-soft",
        "sinking over what was asked for [-]",
        lambda: on_level(*cubes([2600.0] * 3)),
        20.0,
        uneven_sinking,
        1.1,
        depth=1.1 * SOFTNESS,
        gain=2.0 * SOFTNESS,
        settings={"penetration": SOFTNESS, "sleeping": False},
    ),
)
