"""Loose blocks of a band: random convex polygons that rest on the ground and on each other.

The corners of a block lie on an ellipse, which makes it convex, at angles that vary at random
within `JITTER`. The outline of a measured block fills a face of its box. Natural blocks with given
edges have half to two thirds of the mass of a full box, as have these outlines in a cube. The mass
of a flat block is too large, because its length along the road is the root of its cross-section.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from rigdda.kernel import Direct, kernel, short_kernel
from rigdda.model.block import Block
from rigdda.model.site_tables import Event
from rigdda.model.source import Point, Source

JITTER = 0.35
"""Maximum shift of a corner relative to the mean angle between corners [-]. With four corners the
widest gap is 153 deg, so that the centre remains inside."""

INITIAL_GAP = 0.01
"""Initial gap between a block and what it rests on [m], larger than rounding errors."""

EVEN = 1e-9
"""Exponent of a power law of areas below which it is treated as 0, which makes the law logarithmic
[-]."""

AREA, CORNERS, ASPECT, TURN, PLACE, SPEED, SPIN = 0, 1, 2, 3, 4, 5, 6
"""Indices of the random numbers in [0, 1) of a block. For a measured block the first one selects
the face, and the third one rotates the corners on it."""

RANDOM_NUMBERS = 7
"""Number of these random numbers; those for the angles of the corners follow."""


class ShapeLaw(NamedTuple):
    """Distribution of the outlines of the blocks of an event."""

    least_corners: int
    """Range of the number of corners."""
    most_corners: int
    least_area: float
    """Range of the areas of blocks that were not measured [m2]."""
    greatest_area: float
    power: float
    """Exponent of the power law: the number of blocks larger than an area is proportional to the
    area to the power of -`power` [-]."""
    least_aspect: float
    """Range of length over breadth of such blocks [-]."""
    greatest_aspect: float
    long: float
    """Edges of the box around a measured block [m]."""
    middle: float
    short: float
    measured: bool
    """Whether blocks were measured."""


@short_kernel
def write_shapes(
    numbers: NDArray, law: ShapeLaw, corners: NDArray, count: NDArray, area: NDArray
) -> None:
    """Write the outlines of blocks about the origin, anticlockwise.

    Parameters
    ----------
    numbers : (N, RANDOM_NUMBERS + most_corners) array
        Random numbers of each block, in [0, 1).
    law : ShapeLaw
        Distribution of the outlines.
    corners : (N, most_corners, 2) array
        Output: corners [m].
    count : (N,) array of int
        Output: number of corners.
    area : (N,) array
        Output: areas [m2].
    """
    for i in range(len(numbers)):
        u, corner = numbers[i], corners[i]
        n = law.least_corners + int(u[CORNERS] * (law.most_corners - law.least_corners + 1))
        gap = 2.0 * math.pi / n
        for k in range(n):
            corner[k, 0] = gap * (k + JITTER * (2.0 * u[RANDOM_NUMBERS + k] - 1.0))
        double = math.sin(corner[0, 0] - corner[n - 1, 0])  # twice the area on a circle of radius 1
        for k in range(1, n):
            double += math.sin(corner[k, 0] - corner[k - 1, 0])
        if law.measured:
            half_long, half_short = _face(u, law.long, law.middle, law.short, corner, n)
        else:
            size = truncated_power(u[AREA], law.least_area, law.greatest_area, law.power)
            aspect = law.least_aspect + u[ASPECT] * (law.greatest_aspect - law.least_aspect)
            root = math.sqrt(2.0 * size / double)
            half_long, half_short = root * math.sqrt(aspect), root / math.sqrt(aspect)
        turn = 2.0 * math.pi * u[TURN]
        cos, sin = math.cos(turn), math.sin(turn)
        for k in range(n):
            angle = corner[k, 0]
            a, b = half_long * math.cos(angle), half_short * math.sin(angle)
            corner[k, 0], corner[k, 1] = cos * a - sin * b, sin * a + cos * b
        count[i], area[i] = n, 0.5 * half_long * half_short * double


write_shapes_directly = Direct(write_shapes)


@kernel
def _face(
    u: NDArray, long: float, middle: float, short: float, corner: NDArray, n: int
) -> tuple[float, float]:
    """Return the half axes of the ellipse whose corners fill a face of a box [m].

    The angles, the first column of `corner`, are first rotated by a random phase; otherwise a
    corner would always be near the end of an axis.
    """
    phase = 2.0 * math.pi * u[ASPECT]
    left, right, low, high = math.inf, -math.inf, math.inf, -math.inf
    for k in range(n):
        angle = corner[k, 0] + phase
        corner[k, 0] = angle
        left, right = min(left, math.cos(angle)), max(right, math.cos(angle))
        low, high = min(low, math.sin(angle)), max(high, math.sin(angle))
    out = int(3.0 * u[AREA])  # the edge that points along the road
    first = middle if out == 0 else (short if out == 1 else long)
    second = short if out == 0 else (long if out == 1 else middle)
    return first / (right - left), second / (high - low)


@kernel
def truncated_power(u: float, least: float, greatest: float, power: float) -> float:
    """Return the area that a share `u` of a truncated power law exceeds [m2]."""
    if power < EVEN:
        return least * (greatest / least) ** u
    low, high = least**-power, greatest**-power
    return (high + u * (low - high)) ** (-1.0 / power)


@short_kernel
def lay_blocks(
    numbers: NDArray, start: float, end: float, row: int, ground: NDArray, corners: NDArray,
    count: NDArray,
) -> None:  # fmt: skip
    """Move blocks to their places in a band one after another, just above what they rest on.

    Parameters
    ----------
    numbers : (N, ...) array
        Random numbers of each block, in [0, 1).
    start, end : float
        Chainages of the band [m].
    row : int
        Number of blocks side by side.
    ground : (m, 2) array
        Corners of the ground, which has no overhangs [m].
    corners : (N, P, 2) array
        Corners of the blocks about the origin; replaced by their final positions [m].
    count : (N,) array of int
        Number of corners of each block.
    """
    for i in range(len(count)):
        x = start + (end - start) * (i % row + numbers[i, PLACE]) / row
        mine = corners[i, : count[i]]
        for k in range(len(mine)):
            mine[k, 0] = x + mine[k, 0]
        lift = _lift(mine, ground)
        for j in range(i):
            lift = max(lift, _lift_off(mine, corners[j, : count[j]]))
        lift = INITIAL_GAP + lift
        for k in range(len(mine)):
            mine[k, 1] += lift


lay_blocks_directly = Direct(lay_blocks)


@kernel
def _extent(corners: NDArray) -> tuple[float, float]:
    """Return the least and the greatest chainage of a polygon [m]."""
    left, right = corners[0, 0], corners[0, 0]
    for k in range(1, len(corners)):
        left, right = min(left, corners[k, 0]), max(right, corners[k, 0])
    return left, right


@kernel
def _lift(corners: NDArray, ground: NDArray) -> float:
    """Return the distance by which a block must be lifted to rest on the ground [m]."""
    left, right = _extent(corners)
    lift = -math.inf
    for s in range(len(ground) - 1):  # segments of the ground below the block
        x, y, end, low = ground[s, 0], ground[s, 1], ground[s + 1, 0], ground[s + 1, 1]
        if end <= left or x > right:
            continue
        if end > x:
            rise = (low - y) / (end - x)
            for k in range(len(corners)):
                if x <= corners[k, 0] <= end:
                    lift = max(lift, y + rise * (corners[k, 0] - x) - corners[k, 1])
        if end <= right:  # corners of the ground below the block
            lift = max(lift, low - _cut_at(corners, end)[0])
    return lift


@kernel
def _lift_off(corners: NDArray, other: NDArray) -> float:
    """Return the distance by which a block must be lifted to rest on another [m].

    It is -inf if the block is not above the other.
    """
    left, right = _extent(corners)
    its_left, its_right = _extent(other)
    lift = -math.inf
    if its_right <= left or its_left >= right:
        return lift
    for k in range(len(corners) + len(other)):
        x = corners[k, 0] if k < len(corners) else other[k - len(corners), 0]
        lift = max(lift, _cut_at(other, x)[1] - _cut_at(corners, x)[0])
    return lift


@kernel
def _cut_at(corners: NDArray, x: float) -> tuple[float, float]:
    """Return the least and the greatest elevation of a polygon at a chainage [m].

    They are inf and -inf if the polygon does not extend to it.
    """
    low, high = math.inf, -math.inf
    last = len(corners) - 1
    ax, ay = corners[last, 0], corners[last, 1]
    for k in range(len(corners)):
        bx, by = corners[k, 0], corners[k, 1]
        if min(ax, bx) <= x <= max(ax, bx):
            y = ay if ax == bx else ay + (by - ay) * (x - ax) / (bx - ax)
            low, high = min(low, y), max(high, y)
        ax, ay = bx, by
    return low, high


def logarithmic_shares(event: Event, shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shares of the logarithmic law that give the volumes of another law of an event.

    Parameters
    ----------
    event : Event
        An event with lognormal or surveyed volumes.
    shares : (N,) array
        Shares of blocks that are smaller [-].

    Returns
    -------
    (N,) array
        Positions of the volumes between the logarithms of the least and the greatest, 0 to 1 [-].
    """
    limits = event.volume_limits
    assert limits is not None
    low, high = np.log(limits)
    if event.volumes and event.volume_shares:
        found = np.interp(shares, event.volume_shares, np.log(event.volumes))
    else:
        assert event.volume_median is not None and event.volume_spread is not None
        middle, spread = math.log(event.volume_median), event.volume_spread
        first, last = ndtr((low - middle) / spread), ndtr((high - middle) / spread)
        found = middle + spread * ndtri(first + shares * (last - first))
    at: NDArray[np.float64] = np.clip((found - low) / max(high - low, 1e-300), 0.0, 1.0)
    return at


NEIGHBOUR_SPACING = 1.1
"""Spacing of neighbours in a group relative to their mean length [-]. Blocks that do not fit side
by side in the band lie in a layer above."""


def draw(
    rng: np.random.Generator, source: Source, event: Event, ground: NDArray[np.float64]
) -> tuple[list[float], list[Block]]:
    """Return the areas [m2] and blocks of an event of a band, without overlaps.

    `ground` has the corners of the ground, (m, 2) [m].
    """
    assert source.band is not None
    low, high = event.number
    count = low if low == high else low + int(rng.random() * (high - low + 1))
    most_corners = source.corners[1]
    numbers = rng.random((count, RANDOM_NUMBERS + most_corners))
    corners = np.empty((count, most_corners, 2))
    number, area = np.empty(count, dtype=np.int64), np.empty(count)
    least_area, greatest_area = event.area or (0.0, 0.0)
    power = 1.5 * event.exponent  # volume = area ** 1.5
    if event.volumes or event.volume_median is not None:
        numbers[:, AREA], power = logarithmic_shares(event, numbers[:, AREA]), 0.0
    long, middle, short = source.edges or (0.0, 0.0, 0.0)
    law = ShapeLaw(
        int(source.corners[0]),
        int(most_corners),
        float(least_area),
        float(greatest_area),
        float(power),
        float(source.aspect[0]),
        float(source.aspect[1]),
        float(long),
        float(middle),
        float(short),
        source.edges is not None,
    )
    write_shapes_directly.call(numbers, law, corners, number, area)
    areas: list[float] = area.tolist()
    start, end = source.band
    row = 1  # number of blocks side by side
    if count > 1:
        length = NEIGHBOUR_SPACING * math.sqrt(sum(areas) / count * source.aspect[1])
        row = min(max(1, int((end - start) / length)), count)
    lay_blocks_directly.call(numbers, float(start), float(end), row, ground, corners, number)
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
    """Return the greatest distance of a corner of a block from its centre [m]."""
    if source.edges is not None:
        return max(source.edges)
    if event.area is None:
        return 0.0
    corners = source.corners[0]
    gap = 2.0 * math.pi / corners
    narrow, wide = (1.0 - 2.0 * JITTER) * gap, (1.0 + 2.0 * JITTER) * gap
    least = 0.25 * corners * (math.sin(narrow) + math.sin(wide))  # area on a circle of radius 1
    return math.sqrt(event.area[1] / least * source.aspect[1])


def line(points: tuple[Point, ...]) -> NDArray[np.float64]:
    """Return the corners of the ground as an array, (m, 2) [m]."""
    return np.array(points, dtype=np.float64)
