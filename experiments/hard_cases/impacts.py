"""Hard cases of fast motion: spin, impacts at 100 m/s, a chain of impacts."""

from __future__ import annotations

import math

import numpy as np

from experiments.hard_cases.case import Case, History
from experiments.hard_cases.stacks import end_speed, on_level
from rigdda import Block, Scene, Terrain
from rigdda.validation.scenes import box, polygon, rock, rough

SPEED = 100.0
"""Speed of the impacts [m/s]."""

RESTITUTION = 0.5


def spinning() -> Scene:
    """Return a square that spins at 200 rad/s just above a rough floor."""
    return Scene(
        Terrain([(-1000.0, 0.0), (1000.0, 0.0)]),
        (box(0.0, 0.75, velocity=(0.0, 0.0, 200.0)),),
        rock(35.0, 0.3),
    )


def flat_blow() -> Scene:
    """Return a square that flies flat against a fixed one at 100 m/s, without gravity."""
    blocks = (box(0.0, 0.0, velocity=(SPEED, 0.0, 0.0)), box(10.0, 0.0, fixed=True))
    return Scene(None, blocks, rock(30.0, RESTITUTION), gravity=0.0)


def restitution_error(history: History) -> float:
    """Return the error of the coefficient of restitution [-]."""
    return float(abs(-history.velocities[-1, 0, 0] / SPEED - RESTITUTION))


def row_blow() -> Scene:
    """Return a square that flies at 100 m/s into a row of five in contact, without gravity."""
    flyer = box(-10.0, 0.0, velocity=(SPEED, 0.0, 0.0))
    return Scene(None, (flyer, *(box(float(i), 0.0) for i in range(5))), rock(0.0), gravity=0.0)


def momentum_error(history: History) -> float:
    """Return the relative change of momentum or the final spread of velocities, if greater [-]."""
    speed = history.velocities[-1, :, 0]
    return float(max(abs(speed.sum() / SPEED - 1.0), np.ptp(speed) / SPEED))


def volley() -> Scene:
    """Return spinning irregular blocks that fly at 100 m/s at a fixed wall 0.2 m thick."""
    rng = np.random.default_rng(2)
    blocks = [box(0.0, 25.0, 0.2, 60.0, fixed=True)]
    for i in range(12):
        corners = polygon(rough(rng, 6, 0.6), (-20.0 - 3.0 * i, 2.0 + 4.0 * i))
        blocks.append(Block(corners, velocity=(SPEED, 0.0, rng.uniform(-20.0, 20.0))))
    return Scene(None, tuple(blocks), rock(30.0, 0.2), gravity=0.0)


def behind_wall(history: History) -> float:
    """Return the number of blocks that were behind the wall in any frame."""
    return float((history.poses[:, 1:, 0] > 0.0).any(axis=0).sum())


def bullet() -> Scene:
    """Return a small block that hits a pile of large blocks at 100 m/s."""
    bullet = box(-10.0, 0.55, 0.1, 0.1, velocity=(SPEED, 0.0, 0.0))
    pile = [box(1.1 * i + 0.55 * j, 0.5 + j) for j in range(3) for i in range(3 - j)]
    return on_level(bullet, *pile)


def spin_error(history: History) -> float:
    """Return the relative excess of the speed over the limit set by the initial energy [-].

    The limit has all energy in translation: v^2 = k^2 w^2 + 2 g h, with the height h of the first
    fall.
    """
    start = 200.0**2 / 6.0 + 2.0 * 9.81 * 0.75
    now = (history.velocities[:, 0, :2] ** 2).sum(axis=1)
    return float(max(0.0, math.sqrt(now.max() / start) - 1.0))


CASES = (
    Case(
        "spin-200",
        "speed [-]: energy at the start bounds it",
        spinning,
        10.0,
        spin_error,
        1e-6,
        depth=0.02,
        frame=0.01,
    ),
    Case(
        "blow-100-flat",
        "restitution [-]: as prescribed",
        flat_blow,
        0.5,
        restitution_error,
        0.02,
        frame=0.01,
    ),
    Case(
        "blow-100-row",
        "momentum and common speed [-]: plastic",
        row_blow,
        1.0,
        momentum_error,
        0.02,
        depth=0.05,
        frame=0.01,
    ),
    Case(
        "volley-100-thin-wall",
        "blocks behind a wall of 0.2 m: none",
        volley,
        1.0,
        behind_wall,
        0.0,
        depth=0.05,
        frame=0.01,
    ),
    Case(
        "bullet-into-pile",
        "speed at the end [m/s]: it rests",
        bullet,
        10.0,
        end_speed,
        0.02,
        frame=0.01,
    ),
)
