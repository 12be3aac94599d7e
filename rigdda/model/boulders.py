"""Loose blocks of a band: random convex polygons that rest on the ground and on one another."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rigdda.model.block import Block
from rigdda.model.events import Event
from rigdda.model.shapes import DRAWN, JITTER, SPEED, SPIN
from rigdda.model.shapes import lay_blocks_directly as lay_blocks
from rigdda.model.shapes import write_shapes_directly as write_shapes
from rigdda.model.source import Point, Source

SPREAD = 1.1
"""Distance of neighbours of a group over their mean length [-]; what does not fit side by side in
the band lies in a layer above."""


def draw(
    rng: np.random.Generator, source: Source, event: Event, ground: NDArray[np.float64]
) -> tuple[list[float], list[Block]]:
    """Return areas [m2] and blocks of an event of a band, clear of ground and one another.

    `ground` has its corners, (m, 2) [m].
    """
    assert source.band is not None
    low, high = event.number
    count = low if low == high else low + int(rng.random() * (high - low + 1))
    most_corners = source.corners[1]
    numbers = rng.random((count, DRAWN + most_corners))
    corners = np.empty((count, most_corners, 2))
    number, area = np.empty(count, dtype=np.int64), np.empty(count)
    least_area, greatest_area = event.area or (0.0, 0.0)
    long, middle, short = source.edges or (0.0, 0.0, 0.0)
    write_shapes.call(
        numbers,
        *map(int, source.corners),
        float(least_area),
        float(greatest_area),
        1.5 * event.exponent,  # a volume is an area times its root
        float(source.aspect[0]),
        float(source.aspect[1]),
        float(long),
        float(middle),
        float(short),
        source.edges is not None,
        corners,
        number,
        area,
    )
    areas: list[float] = area.tolist()
    start, end = source.band
    row = 1  # so many lie side by side
    if count > 1:
        length = SPREAD * math.sqrt(sum(areas) / count * source.aspect[1])
        row = min(max(1, int((end - start) / length)), count)
    lay_blocks.call(numbers, float(start), float(end), row, ground, corners, number)
    least, greatest = source.speed
    starts = numbers[:, SPEED : SPIN + 1].tolist()
    blocks = [
        Block.sound(
            corner[:n],
            source.density,
            source.surface,
            (least + (greatest - least) * speed, 0.0, source.spin * (2.0 * spin - 1.0)),
        )
        for corner, n, (speed, spin) in zip(corners, number.tolist(), starts, strict=True)
    ]
    return areas, blocks


def reach(source: Source, event: Event) -> float:
    """Return the greatest distance of a corner of a block from its place [m]."""
    if source.edges is not None:
        return max(source.edges)
    if event.area is None:
        return 0.0
    corners = source.corners[0]
    gap = 2.0 * math.pi / corners
    narrow, wide = (1.0 - 2.0 * JITTER) * gap, (1.0 + 2.0 * JITTER) * gap
    least = 0.25 * corners * (math.sin(narrow) + math.sin(wide))  # of a circle of radius 1
    return math.sqrt(event.area[1] / least * source.aspect[1])


@lru_cache(maxsize=256)
def line(points: tuple[Point, ...]) -> NDArray[np.float64]:
    """Return the ground as an array of its corners, (m, 2) [m]."""
    return np.array(points, dtype=np.float64)
