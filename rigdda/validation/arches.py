"""A semicircular masonry arch under its own weight (Milankovitch 1907; Heyman 1969)."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from rigdda.model.scene import Block, Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, rock

RADIUS, VOUSSOIRS = 10.0, 22
"""Mean radius [m] and number of blocks."""


def arch(ratio: float) -> tuple[Block, ...]:
    """Return blocks with radial joints and a thickness of `ratio` times the mean radius."""
    thickness = ratio * RADIUS
    inner, outer = RADIUS - 0.5 * thickness, RADIUS + 0.5 * thickness
    angle = np.linspace(0.0, math.pi, VOUSSOIRS + 1)
    joint = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    joint[-1, 1] = 0.0  # both springings exactly on the ground
    return tuple(Block([inner * p, outer * p, outer * q, inner * q]) for p, q in pairwise(joint))


def drop(lab: Lab, ratio: float, time: float) -> float:
    """Return the settlement of the crown after `time` [m]."""
    blocks = arch(ratio)
    sim = lab.simulate(Scene(Terrain(FLAT), blocks, rock(60.0)), sleeping=False)
    crown = VOUSSOIRS // 2
    start = sim.poses[crown, 1]
    sim.step(lab.steps(time))
    return float(start - sim.poses[crown, 1])


CASES = (
    Case(
        "arch-stands",
        (Check("sinks at 0.115 by", "none: limit 0.1068", "m", 0.05, "bound"),),
        lambda lab: (Measured(abs(drop(lab, 0.115, 30.0))),),
    ),
    Case(
        "arch-falls",
        # the crown of a collapsed arch lies below half its height
        (Check("falls at 0.095", "yes: limit 0.1068", "-", 0.0, "absolute"),),
        lambda lab: (Measured(float(drop(lab, 0.095, 30.0) > 0.5 * RADIUS), 1.0),),
    ),
)
