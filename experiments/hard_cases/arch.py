"""A keystone arch with loads on both sides of its limit, found by linear programming."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.optimize import linprog

from experiments.hard_cases.case import Case, Floats, History
from experiments.hard_cases.stacks import moved
from rigdda import Block, PointLoad, Scene, Terrain
from rigdda.geometry import polygon_properties
from rigdda.validation.scenes import FLAT, GRAVITY, rock

RADIUS, THICKNESS, VOUSSOIRS = 5.0, 1.0, 15
"""Mean radius and thickness [m], and number of blocks, which is odd so that one is the keystone."""

FRICTION_DEG = 40.0


def joints() -> Floats:
    """Return the inner and outer ends of all radial joints, (K, 2, 2) [m]."""
    angle = np.linspace(0.0, math.pi, VOUSSOIRS + 1)
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    out[-1, 1] = 0.0  # both springings exactly on the ground
    radii = np.array([RADIUS - 0.5 * THICKNESS, RADIUS + 0.5 * THICKNESS])
    return radii[None, :, None] * out[:, None, :]


def voussoirs() -> tuple[Block, ...]:
    """Return the blocks, from the right foot to the left one."""
    return tuple(Block([p[0], p[1], q[1], q[0]]) for p, q in pairwise(joints()))


@cache
def limit_load() -> float:
    """Return the greatest downward force on the keystone for which equilibrium exists [N].

    By the static theorem of limit analysis (Livesley 1978), with normal forces at both ends of each
    joint, a shear force of at most tan phi times their sum, and three equations of equilibrium per
    block.
    """
    ends, blocks = joints(), voussoirs()
    unknowns = 3 * len(ends) + 1
    balance = np.zeros((3 * len(blocks), unknowns))
    load = np.zeros(3 * len(blocks))
    for i, block in enumerate(blocks):
        area, centre, _ = polygon_properties(block.vertices)
        load[3 * i + 1] = block.density * area * GRAVITY
        for joint, sign in ((i, 1.0), (i + 1, -1.0)):
            along = np.subtract(*ends[joint, ::-1]) / THICKNESS  # pointing outwards
            normal = np.array([-along[1], along[0]])  # from joint k into block k
            for column, direction, point in (
                (0, normal, ends[joint, 0]),
                (1, normal, ends[joint, 1]),
                (2, along, ends[joint, 0]),
            ):
                fx, fy = sign * direction
                x, y = point - centre
                balance[3 * i : 3 * i + 3, 3 * joint + column] = fx, fy, x * fy - y * fx
    balance[3 * (VOUSSOIRS // 2) + 1, -1] = -1.0
    rough = math.tan(math.radians(FRICTION_DEG))
    slip = np.zeros((2 * len(ends), unknowns))
    for k in range(len(ends)):
        slip[2 * k, 3 * k : 3 * k + 3] = -rough, -rough, 1.0
        slip[2 * k + 1, 3 * k : 3 * k + 3] = -rough, -rough, -1.0
    bounds = [(0.0, None), (0.0, None), (None, None)] * len(ends) + [(0.0, None)]
    goal = np.zeros(unknowns)
    goal[-1] = -1.0
    found = linprog(goal, slip, np.zeros(len(slip)), balance, load, bounds)
    return float(found.x[-1])


def loaded(share: float) -> Callable[[], Scene]:
    """Return a builder of the arch with a fraction of its limit load on the keystone."""

    def build() -> Scene:
        top = (0.0, RADIUS + 0.5 * THICKNESS)
        load = PointLoad(VOUSSOIRS // 2, top, (0.0, -share * limit_load()))
        return Scene(Terrain(FLAT), voussoirs(), rock(FRICTION_DEG), loads=(load,))

    return build


def still_up(history: History) -> float:
    """Return the final height of the keystone over the initial one, in excess of one half [-]."""
    height = history.poses[:, VOUSSOIRS // 2, 1]
    return max(0.0, float(height[-1] / height[0]) - 0.5)


CASES = (
    Case(
        "arch-below-limit",
        "displacement [m] at 0.9 of the limit load: none, it stands",
        loaded(0.9),
        20.0,
        moved,
        0.02,
        settings={"sleeping": False},
    ),
    Case(
        "arch-above-limit",
        "height of the keystone beyond one half [-] at 1.1 of the limit load: it falls",
        loaded(1.1),
        10.0,
        still_up,
        0.0,
        depth=0.05,
    ),
)
