"""Hard cases of bolts at yield and of a shaken slope."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from experiments.hard_cases.case import Case, History
from experiments.hard_cases.stacks import moved
from rigdda import Bolt, Scene, Terrain
from rigdda.model.block import Block
from rigdda.validation.scenes import GRAVITY, box, polygon, rock

WEIGHT = 2600.0 * GRAVITY
"""Weight of a cube of one metre [N]."""

SLOPE, FRICTION = 20.0, 30.0
"""Angle of the shaken slope, and friction angle of its joints [deg]."""

YIELD = GRAVITY * math.tan(math.radians(FRICTION - SLOPE))
"""Ground acceleration into the slope at which blocks begin to slide [m/s2]."""

PULSE = 0.4
"""Duration of a pulse [s]."""


def hung(share: float) -> Callable[[], Scene]:
    """Return a builder of a block on a bolt that yields at `share` of the block's weight."""

    def build() -> Scene:
        force = share * WEIGHT
        bolt = Bolt(0, (0.0, 50.5), None, (0.0, 60.0), 1e8, min(force, WEIGHT), force)
        ground = Terrain([(-10.0, 0.0), (10.0, 0.0)])
        return Scene(ground, (box(0.0, 50.0),), rock(), supports=(bolt,))

    return build


def drop_error(share: float) -> Callable[[History], float]:
    """Return the relative error of the distance [-]: g (1 - F/W) t^2/2."""

    def error(history: History) -> float:
        exact = 0.5 * GRAVITY * (1.0 - share) * history.times[-1] ** 2
        return float(abs((history.poses[0, 0, 1] - history.poses[-1, 0, 1]) / exact - 1.0))

    return error


def jointed(rows: int, columns: int) -> tuple[tuple[Block, ...], Terrain]:
    """Return bricks in running bond on a slope down towards +x, and the slope."""
    th = math.radians(SLOPE)
    corners = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (0.0, 0.5)])
    blocks = [
        Block(polygon(corners + np.array([2.0 * i + 0.5 * (j % 2), 0.5 * j]), angle=-th))
        for j in range(rows)
        for i in range(columns)
    ]
    down = np.array([math.cos(th), -math.sin(th)])
    return tuple(blocks), Terrain([-20.0 * down, 60.0 * down])


def shaken(push: float, rows: int) -> Callable[[], Scene]:
    """Return a builder of a jointed slope under ground acceleration into the slope [m/s2].

    Alternating pulses are applied where it must hold, a single one where it slides.
    """

    def build() -> Scene:
        blocks, ground = jointed(rows, 5)
        signs = (-1.0, 1.0) * 5 if push < YIELD else (-1.0,)
        edges = 1.0 + PULSE * np.arange(len(signs) + 1)
        pushes = push * np.array(signs)
        history = np.zeros((2 * len(edges), 3))  # two points per edge for rectangular pulses
        history[:, 0] = np.repeat(edges, 2)
        history[1:-1, 1] = np.repeat(pushes, 2)
        return Scene(ground, blocks, rock(FRICTION), base_motion=history)

    return build


def newmark_error(push: float) -> Callable[[History], float]:
    """Return the relative error of the displacement of blocks on the slope (Newmark 1965) [-].

    The ground accelerates uphill, -x, by `push`. Relative to it, blocks accelerate downhill by a =
    (push - k) cos(phi - th)/cos phi during the pulse and decelerate by k cos(phi - th)/cos phi
    afterwards, with k = g tan(phi - th).
    """

    def error(history: History) -> float:
        phi, th = math.radians(FRICTION), math.radians(SLOPE)
        ratio = math.cos(phi - th) / math.cos(phi)
        gained, slowed = (push - YIELD) * ratio, YIELD * ratio
        exact = 0.5 * gained * PULSE**2 * (1.0 + gained / slowed)
        way = np.hypot(*(history.poses[-1, :, :2] - history.poses[0, :, :2]).T)
        return float(np.abs(way / exact - 1.0).max())

    return error


CASES = (
    Case(
        "bolt-below-yield",
        "displacement [m]: none",
        hung(1.01),
        10.0,
        moved,
        1e-4,
    ),
    Case("bolt-at-yield", "way [-]: g (1 - F/W) t^2/2", hung(0.99), 10.0, drop_error(0.99), 1e-2),
    Case(
        "shaken-below-yield",
        "displacement [m] at 0.9 of the yield acceleration g tan(phi - th): none",
        shaken(0.9 * YIELD, 4),
        8.0,
        moved,
        5e-3,  # a hundredth of a brick
    ),
    Case(
        "shaken-above-yield",
        "way [-]: rigid sliding (Newmark 1965)",
        shaken(2.0 * YIELD, 1),
        4.0,
        newmark_error(2.0 * YIELD),
        1e-2,
    ),
)
