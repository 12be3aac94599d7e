"""The ground under the bodies, and its motion."""

from __future__ import annotations

import numpy as np

from rigdda.dynamics.arrays import Ground
from rigdda.dynamics.records import SEGMENT, SHAKING, Floats, Shaking
from rigdda.model.scene import Scene, Terrain


def pack_ground(ground: Terrain | None, names: list[str]) -> Ground:
    """Return the terrain segments and the bins that find them by x."""
    if ground is None:
        none, start = np.zeros(1, dtype=SEGMENT), np.zeros(1, dtype=np.int64)
        return Ground(none.view(np.recarray), start, start[:0], 0.0, 1.0)
    points = ground.points
    step = np.diff(points, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    tangent = step / length[:, None]
    turn = np.zeros(len(points))
    turn[1:-1] = np.arctan2(
        tangent[:-1, 0] * tangent[1:, 1] - tangent[:-1, 1] * tangent[1:, 0],
        (tangent[:-1] * tangent[1:]).sum(axis=1),
    )
    turn[np.abs(turn) < 1e-12] = 0.0
    extent = np.sort(np.stack([points[:-1], points[1:]]), axis=0)
    (left, bottom), (right, top) = (corner.T for corner in extent)
    origin, bins = left.min(), max(1, min(2 * len(step), 4096))
    width = max((right.max() - origin) / bins, 1e-9)
    first, last = (np.minimum((x - origin) / width, bins - 1).astype(int) for x in (left, right))
    items: list[list[int]] = [[] for _ in range(bins)]
    for s in range(len(step)):
        for cell in range(first[s], last[s] + 1):
            items[cell].append(s)
    segment = np.zeros(len(points), dtype=SEGMENT)
    segment["x"], segment["y"], segment["turn"] = *points.T, turn
    columns = {
        "normal_x": -tangent[:, 1],
        "normal_y": tangent[:, 0],
        "length": length,
        "surface": [names.index(s) for s in ground.surfaces],
        "left": left,
        "right": right,
        "bottom": bottom,
        "top": top,
        "bin": first,
    }
    for name, values in columns.items():
        segment[name][:-1] = values
    return Ground(
        segment.view(np.recarray),
        np.cumsum([0, *(len(i) for i in items)]).astype(np.int64),
        np.array([s for cell in items for s in cell], dtype=np.int64),
        float(origin),
        float(width),
    )


def pack_shaking(scene: Scene) -> Shaking:
    """Return the motion of the ground with its integrals over time."""
    history = np.zeros((0, 3)) if scene.base_motion is None else scene.base_motion
    shaking = np.zeros(len(history), dtype=SHAKING)
    shaking["time"], shaking["x"], shaking["y"] = t, x, y = history.T
    if len(t):
        shaking["sum_x"][1:], shaking["sum_y"][1:] = cumulative(t, x), cumulative(t, y)
    return shaking.view(np.recarray)


def cumulative(t: Floats, a: Floats) -> Floats:
    """Return the integral of a polygon up to each of its corners but the first."""
    return np.cumsum(0.5 * (a[1:] + a[:-1]) * np.diff(t))
