"""Hard cases of ground: a slot, concave corners, an overhang, degenerate segments."""

from __future__ import annotations

import math

import numpy as np

from experiments.bench.growth import rubble
from experiments.hard_cases.case import Case, History
from experiments.hard_cases.shapes import way_error
from experiments.hard_cases.stacks import end_speed, moved, stands
from rigdda import Block, Scene, Terrain
from rigdda.validation.scenes import GRAVITY, box, incline, masses, polygon, rock, rough

SLOT, DEPTH = 1.002, 6.0
"""Width and depth of the slot for a block 1 m wide [m]."""

FALL = 3.0
"""Distance from the start to the floor of the slot [m]."""


def slot() -> Scene:
    """Return a frictionless block, slightly rotated, in a slot 2 mm wider than the block."""
    half = 0.5 * SLOT
    edge = [(-9.0, 0.0), (-half, 0.0), (-half, -DEPTH), (half, -DEPTH), (half, 0.0), (9.0, 0.0)]
    return Scene(Terrain(edge), (box(0.0, -2.5, angle=1e-3),), rock(0.0))


def slot_error(history: History) -> float:
    """Return the greater error of the fall at 0.7 s and of the final distance to the floor [-]."""
    way = history.poses[0, 0, 1] - history.poses[:, 0, 1]
    k = int(np.argmin(np.abs(history.times - 0.7)))
    falling = abs(way[k] / (0.5 * GRAVITY * history.times[k] ** 2) - 1.0)
    return float(max(falling, abs(way[-1] / FALL - 1.0)))


def notch() -> Scene:
    """Return a square on its corner that exactly fits a concave right angle of the ground."""
    ground = Terrain([(-20.0, 10.0), (-10.0, 10.0), (0.0, 0.0), (10.0, 10.0), (20.0, 10.0)])
    return Scene(ground, (box(0.0, math.sqrt(0.5), angle=math.pi / 4.0),), rock(10.0))


def stairs() -> Scene:
    """Return irregular blocks that tumble down stairs into a pit."""
    rng = np.random.default_rng(3)
    steps = [(2.0 * i, 20.0 - 2.0 * k) for i in range(10) for k in (i, i + 1)]
    chain = [(-20.0, 40.0), (-20.0, 20.0), *steps, (20.0, 0.0), (40.0, 0.0), (40.0, 40.0)]
    blocks = [
        Block(
            polygon(
                rough(rng, int(rng.integers(3, 8)), 0.5), (-2.0 * (i % 6), 21.0 + 1.5 * (i // 6))
            ),
            velocity=(6.0, 0.0, 0.0),
        )
        for i in range(36)
    ]
    return Scene(Terrain(chain), tuple(blocks), rock(25.0, 0.2))


def overhang() -> Scene:
    """Return blocks thrown up against the roof of an overhang."""
    chain = [(30.0, 0.0), (30.0, 20.0), (40.0, 20.0)]
    cave = [(-20.0, 20.0), (10.0, 20.0), (10.0, 6.0), (-10.0, 4.0), (-10.0, 0.0)]
    rng = np.random.default_rng(4)
    blocks = [
        Block(polygon(rough(rng, 6, 0.5), (-7.0 + 2.0 * i, 1.0)), velocity=(1.0, 12.0, 5.0))
        for i in range(8)
    ]
    return Scene(Terrain([*cave, *chain]), tuple(blocks), rock(30.0, 0.3))


def collinear() -> Scene:
    """Return a block on a plane divided into 200 random segments, some of them a micron long."""
    plain, down = incline(30.0, 20.0)
    at = np.sort(np.random.default_rng(5).uniform(-4.0, 20.0, 200))
    at[::20] = at[1::20] - 1e-6
    along = np.concatenate([[-5.0], at, [60.0]])
    return Scene(Terrain(along[:, None] * down), plain.blocks, plain.surfaces)


def empty_segment() -> Scene:
    """Return a ground with a segment of zero length."""
    return Scene(Terrain([(-9.0, 0.0), (0.0, 0.0), (0.0, 0.0), (9.0, 0.0)]), (box(0.0, 0.5),))


def hopper() -> Scene:
    """Return 1,000 blocks above a hopper with a closed outlet."""
    rng = np.random.default_rng(6)
    chain = [(-45.0, 130.0), (-45.0, 40.0), (-4.0, 0.0), (4.0, 0.0), (45.0, 40.0), (45.0, 130.0)]
    blocks = [
        Block(rubble(rng) + np.array([2.2 * (i % 25) - 26.4, 31.0 + 2.2 * (i // 25)]))
        for i in range(1000)
    ]
    return Scene(Terrain(chain), tuple(blocks), rock(28.0, 0.2))


def carried_error(history: History) -> float:
    """Return the relative error of the upward ground force compared with the weight [-]."""
    c = history.sim.contacts()
    c = c[c["block_b"] < 0]
    up = (c["normal_force"] * c["ny"] + c["shear_force"] * c["nx"]).sum()
    return abs(float(up) / (GRAVITY * float(masses(history.scene)[0].sum())) - 1.0)


CASES = (
    Case(
        "narrow-slot",
        "way [-]: g t^2/2, then to the floor",
        slot,
        3.0,
        slot_error,
        1e-2,
    ),
    stands("concave-corner", notch, 1.0),
    Case("stairs", "speed at the end [m/s]: it rests", stairs, 20.0, end_speed, 0.02, depth=0.05),
    Case(
        "overhang", "speed at the end [m/s]: it rests", overhang, 20.0, end_speed, 0.02, depth=0.05
    ),
    Case(
        "collinear-segments",
        "way [-]: g t^2/2 (sin th - cos th tan phi)",
        collinear,
        2.0,
        way_error(30.0, 20.0),
        1e-3,
    ),
    Case(
        "empty-segment",
        "refused: it has no direction",
        empty_segment,
        1.0,
        moved,
        0.0,
        refused=True,
    ),
    Case(
        "hopper-1000",
        "weight carried by the ground [-]",
        hopper,
        25.0,
        carried_error,
        0.05,
        depth=0.05,
        frame=0.5,
    ),
)
