"""Hard cases of stacks: towers, unequal masses, cards, dominoes, brickwork."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from experiments.hard_cases.case import Case, History
from rigdda import Block, Scene, Terrain
from rigdda.validation.assemblies import CUBE_OFFSET, tower
from rigdda.validation.scenes import FLAT, box, polygon, rock

STANDS = 0.02
"""Displacement over block size up to which a block is stable [-]."""

CARD, THIN, LEAN = 1.0, 0.02, math.radians(20.0)
"""Length and thickness of a card [m], and its angle from the vertical [rad]."""

SPACING, TILES, TILE = 0.4, 20, 0.1
"""Spacing of the dominoes [m], which are 1 m high, their number and their thickness [m]."""

FAR = 2.6e6
"""A typical easting in a national grid [m]."""


def moved(history: History) -> float:
    """Return the greatest displacement of a block [m]."""
    return history.moved


def end_speed(history: History) -> float:
    """Return the greatest speed at the end [m/s]."""
    return history.speed


def on_level(*blocks: Block, friction_deg: float = 30.0) -> Scene:
    """Return blocks on level ground."""
    return Scene(Terrain(FLAT), blocks, rock(friction_deg))


def cubes(densities: list[float], x: float = 0.0) -> tuple[Block, ...]:
    """Return a tower of one-metre cubes, slightly out of line, with these densities."""
    offsets = np.random.default_rng(1).uniform(-CUBE_OFFSET, CUBE_OFFSET, len(densities))
    return tuple(
        box(x + dx, 0.5 + i, density=d)
        for i, (dx, d) in enumerate(zip(offsets, densities, strict=True))
    )


def far_tower() -> Scene:
    """Return a tower of ten cubes at coordinates of a national grid."""
    ground = Terrain([(FAR - 50.0, 0.0), (FAR + 50.0, 0.0)])
    return Scene(ground, cubes([2600.0] * 10, FAR), rock())


def brickwork() -> Scene:
    """Return a wall of bricks in running bond, with all joints exactly closed."""
    bricks = [box(2.0 * i + 0.5 * (j % 2), 0.5 + j, 2.0, 1.0) for j in range(6) for i in range(5)]
    return on_level(*bricks)


def card(side: float, x: float, y: float) -> Block:
    """Return a card leaning to `side`, with its upper corner at x and its foot at y [m]."""
    along = np.array([math.sin(LEAN), math.cos(LEAN)])
    across = np.array([math.cos(LEAN), -math.sin(LEAN)])
    centre = -0.5 * CARD * along - 0.5 * THIN * across
    centre[1] = 0.5 * CARD * along[1] - 0.5 * THIN * across[1]
    corners = [
        centre + 0.5 * (u * CARD * along + v * THIN * across)
        for u, v in ((-1, -1), (-1, 1), (1, 1), (1, -1))
    ]
    return Block(np.array(corners) * (side, 1.0) + (x, y))


def cards() -> Scene:
    """Return a house of cards: two tents, a card across their tops, and a tent on it."""
    storey = CARD * math.cos(LEAN) + THIN * math.sin(LEAN)
    apart = 0.5 * CARD
    tents = [(-apart, 0.0), (apart, 0.0), (0.0, storey + THIN)]
    blocks = [card(side, x, y) for x, y in tents for side in (1.0, -1.0)]
    return on_level(*blocks, box(0.0, storey + 0.5 * THIN, 2.0 * CARD, THIN), friction_deg=35.0)


def dominoes() -> Scene:
    """Return a row of dominoes, of which the first is tilted beyond its balance."""
    corners = np.array([(-TILE, 0.0), (0.0, 0.0), (0.0, 1.0), (-TILE, 1.0)])
    first = Block(polygon(corners, (0.5 * TILE, 0.0), -1.2 * math.atan(TILE)))
    rest = [box(i * SPACING, 0.5, TILE, 1.0) for i in range(1, TILES)]
    return on_level(first, *rest, friction_deg=25.0)


def left_standing(history: History) -> float:
    """Return the number of dominoes that stand or fall before their predecessor."""
    past = -history.poses[:, 1:, 2] > math.atan(TILE)
    when = np.where(past.any(axis=0), past.argmax(axis=0), len(past))
    return float((~past[-1]).sum() + (np.diff(when) < 0).sum())


def stands(name: str, blocks: Callable[[], Scene], size: float = 1.0, time: float = 20.0) -> Case:
    """Return the case of blocks of `size` [m] that must stand for `time` [s], without sleeping."""
    return Case(
        name,
        "displacement [m]: none, it stands",
        blocks,
        time,
        moved,
        STANDS * size,
        settings={"sleeping": False},
    )


def straight(count: int) -> Callable[[], Scene]:
    """Return a builder of a tower of cubes."""
    return lambda: on_level(*tower(np.random.default_rng(0), count))


CASES = (
    stands("stack-50", straight(50)),
    stands("stack-100", straight(100)),
    stands("heavy-on-light-1e4", lambda: on_level(*cubes([0.26, 2600.0]))),
    stands("light-on-heavy-1e4", lambda: on_level(*cubes([2600.0, 0.26]))),
    stands("masses-alternating-1e4", lambda: on_level(*cubes([0.26, 2600.0] * 3))),
    stands("far-coordinates", far_tower),
    stands("brickwork", brickwork),
    stands("slender-1-100", lambda: on_level(box(0.0, 5.0, 0.1, 10.0)), size=0.1),
    stands("house-of-cards", cards),
    Case(
        "dominoes",
        "dominoes that stay or fall out of turn: none",
        dominoes,
        8.0,
        left_standing,
        0.0,
        depth=0.02,
    ),
)
