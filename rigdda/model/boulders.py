"""Loose blocks of a band: random convex polygons that rest on the ground and on one another.

Corners lie on an ellipse, so that they are convex, at angles that are spaced at random within
`JITTER`. A block that was measured fills a face of its box: natural blocks of given edges weigh
half to two thirds of a full box, as such outlines do. Plain numbers throughout: a release of one
block is drawn in some tens of microseconds.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from rigdda.model.block import Block
from rigdda.model.events import Event
from rigdda.model.source import Point, Source

JITTER = 0.35
"""Greatest shift of a corner over the mean spacing of corners [-]: with four corners the widest gap
is 153 deg, so that the centre stays inside."""

CLEAR = 0.01
"""Height of a block above what it rests on at the start [m]: clear of it whatever the rounding."""

SPREAD = 1.1
"""Distance of neighbours of a group over their mean length [-]; what does not fit side by side in
the band lies in a layer above."""

DRAWN = 7
"""Numbers drawn for a block beside its corners' places."""

Line = tuple[list[float], list[float]]
"""A line from left to right: chainages and elevations [m]."""


def draw(
    rng: np.random.Generator, source: Source, event: Event, ground: Line
) -> tuple[list[float], list[Block]]:
    """Return areas [m2] and blocks of an event of a band, clear of ground and one another."""
    assert source.band is not None
    low, high = event.number
    count = low if low == high else low + int(rng.random() * (high - low + 1))
    numbers = rng.random((count, DRAWN + source.corners[1])).tolist()
    shapes = [_shape(u, source, event) for u in numbers]
    start, end = source.band
    row = 1  # so many lie side by side
    if count > 1:
        length = SPREAD * math.sqrt(sum(area for area, _ in shapes) / count * source.aspect[1])
        row = min(max(1, int((end - start) / length)), count)
    placed: list[list[Point]] = []
    for i, (u, (_, corners)) in enumerate(zip(numbers, shapes, strict=True)):
        x = start + (end - start) * (i % row + u[4]) / row
        moved = [(x + a, b) for a, b in corners]
        lift = CLEAR + max(_lift(moved, ground), _lift_off(moved, placed) if placed else -math.inf)
        placed.append([(a, b + lift) for a, b in moved])
    least, greatest = source.speed
    blocks = [
        Block.sound(
            corners,
            source.density,
            source.surface,
            (least + (greatest - least) * u[5], 0.0, source.spin * (2.0 * u[6] - 1.0)),
        )
        for corners, u in zip(placed, numbers, strict=True)
    ]
    return [area for area, _ in shapes], blocks


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
def line(points: tuple[Point, ...]) -> Line:
    """Return the ground as a line, for a chain that never turns back."""
    return [x for x, _ in points], [y for _, y in points]


def _shape(u: Sequence[float], source: Source, event: Event) -> tuple[float, list[Point]]:
    """Return the area [m2] and the corners [m] of a block about its place, anticlockwise."""
    least, most = source.corners
    count = least + int(u[1] * (most - least + 1))
    gap = 2.0 * math.pi / count
    angles = [gap * (i + JITTER * (2.0 * u[DRAWN + i] - 1.0)) for i in range(count)]
    double = math.sin(angles[0] - angles[-1])
    for i in range(1, count):
        double += math.sin(angles[i] - angles[i - 1])
    if source.edges is not None:
        long, short = _face(u, source.edges, angles)
    else:
        assert event.area is not None
        area = _area(u[0], *event.area, 1.5 * event.exponent)  # volume: area times its root
        aspect = source.aspect[0] + u[2] * (source.aspect[1] - source.aspect[0])
        size = math.sqrt(2.0 * area / double)
        long, short = size * math.sqrt(aspect), size / math.sqrt(aspect)
    turn = 2.0 * math.pi * u[3]
    cos, sin = math.cos(turn), math.sin(turn)
    corners = []
    for angle in angles:
        a, b = long * math.cos(angle), short * math.sin(angle)
        corners.append((cos * a - sin * b, sin * a + cos * b))
    return 0.5 * long * short * double, corners


def _face(
    u: Sequence[float], edges: tuple[float, float, float], angles: list[float]
) -> tuple[float, float]:
    """Return the half axes of the ellipse whose corners fill a face of a box [m].

    Angles are turned by a random phase first, in place: else a corner is at the end of an axis.
    """
    phase = 2.0 * math.pi * u[2]
    angles[:] = [angle + phase for angle in angles]
    cosines, sines = [math.cos(a) for a in angles], [math.sin(a) for a in angles]
    out = int(3.0 * u[0])  # the edge that points along the road
    long, short = edges[out - 2], edges[out - 1]
    return long / (max(cosines) - min(cosines)), short / (max(sines) - min(sines))


def _area(u: float, least: float, greatest: float, power: float) -> float:
    """Return the area whose share u of a truncated power law is above it [m2]."""
    if power < 1e-9:
        return least * (greatest / least) ** u
    low, high = least**-power, greatest**-power
    return (high + u * (low - high)) ** (-1.0 / power)


def _lift(corners: list[Point], ground: Line) -> float:
    """Return how far a block must be lifted to rest on the ground [m]."""
    xs, ys = ground
    first = bisect_right(xs, min(corners)[0])
    last = bisect_right(xs, max(corners)[0])
    lift = -math.inf
    for i in range(first, last + 1):  # each piece of the ground that is below it
        (x, y), (end, low) = (xs[i - 1], ys[i - 1]), (xs[i], ys[i])
        if end > x:
            rise = (low - y) / (end - x)
            pieces = [y + rise * (a - x) - b for a, b in corners if x <= a <= end]
            lift = max(lift, max(pieces, default=lift))
        if i < last:  # and each corner of it
            lift = max(lift, low - min(_crossings(corners, end)))
    return lift


def _lift_off(corners: list[Point], placed: list[list[Point]]) -> float:
    """Return how far a block must be lifted to rest on the highest of those placed before [m]."""
    left, right = min(corners)[0], max(corners)[0]
    lift = -math.inf
    for other in placed:
        if max(other)[0] <= left or min(other)[0] >= right:
            continue
        for x in [x for x, _ in (*corners, *other)]:
            below = list(_crossings(other, x))
            above = list(_crossings(corners, x))
            if below and above:
                lift = max(lift, max(below) - min(above))
    return lift


def _crossings(corners: list[Point], x: float) -> Iterator[float]:
    """Yield the elevations at which the edges of a polygon cross a chainage [m]."""
    ax, ay = corners[-1]
    for bx, by in corners:
        if min(ax, bx) <= x <= max(ax, bx):
            yield ay if ax == bx else ay + (by - ay) * (x - ax) / (bx - ax)
        ax, ay = bx, by
