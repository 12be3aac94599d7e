"""Grading: cutting the ground down to a line, or filling it up to a line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda.errors import BadInput
from rigdda.ground.terrain import Terrain
from rigdda.rounding import chainage

Floats = NDArray[np.float64]

LEAST_SLOPE, FLATTEST_SLOPE = 0.02, 5.0
"""Steepest and flattest side of an earthwork, run over rise [-]."""

SAME_CORNER = 1e-6
"""Distance within which two corners are merged [m]."""


def span(field: str, ground: Terrain, start: float, end: float) -> Floats:
    """Return the corners of the ground between two chainages, with both ends, (n, 2).

    Raises
    ------
    BadInput
        If the ground does not reach that far, or has a vertical face or an overhang there.
    """
    first, last = _segments(field, ground, start, end)
    piece = ground.points[first : last + 2]
    x = np.array([start, *piece[(piece[:, 0] > start) & (piece[:, 0] < end), 0], end])
    return np.column_stack([x, np.interp(x, *piece.T)])


def regrade(
    field: str, ground: Terrain, line: Floats, pick: Any, surface: str | None
) -> tuple[Floats, Terrain]:
    """Cut the ground down to a line, or fill it up to a line.

    Parameters
    ----------
    field : str
        Name of the field in error messages.
    ground : Terrain
        The ground.
    line : (k, 2) array
        Corners of the line, x ascending [m].
    pick : ufunc
        `np.minimum` to cut, `np.maximum` to fill.
    surface : str or None
        Name of the surface of a fill; None: the existing surfaces are kept.

    Returns
    -------
    outline : (n, 2) array
        Polygon of the cut or fill [m]; separate parts are connected by pieces of zero thickness.
    ground : Terrain
        The new ground.

    Raises
    ------
    BadInput
        If nothing changes, or the ground there is not single-valued.
    """
    start, end = line[0, 0], line[-1, 0]
    old = span(field, ground, start, end)
    x = _corners(old, line)
    before, new = np.interp(x, *old.T), pick(np.interp(x, *old.T), np.interp(x, *line.T))
    moved = 0.5 * (np.abs(new - before)[1:] + np.abs(new - before)[:-1])
    if moved @ np.diff(x) < SAME_CORNER:
        raise BadInput(field, float(start), "move it or make it larger: it changes nothing here")
    outline = np.concatenate([np.column_stack([x, new]), np.column_stack([x, before])[-2:0:-1]])
    first, last = _segments(field, ground, start, end)
    middle = 0.5 * (x[1:] + x[:-1])
    own = first + np.searchsorted(ground.points[first + 1 : last + 1, 0], middle)
    names = [
        surface if surface is not None and change > SAME_CORNER else ground.surfaces[s]
        for s, change in zip(own, moved, strict=True)
    ]
    return outline, _insert(ground, first, last, np.column_stack([x, new]), names)


def _segments(field: str, ground: Terrain, start: float, end: float) -> tuple[int, int]:
    """Return the indices of the first and last segment between two chainages."""
    x = ground.points[:, 0]
    if start < x.min() or end > x.max():
        told = f"stay on the terrain, {chainage(x.min())} to {chainage(x.max())} m"
        raise BadInput(field, start, told)
    low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
    over = np.flatnonzero((low < end) & (high > start))
    if (np.diff(x)[over] <= 0.0).any() or (np.diff(over) != 1).any():
        raise BadInput(field, start, "put it where the ground has no vertical face or overhang")
    return int(over[0]), int(over[-1])


def _corners(old: Floats, line: Floats) -> Floats:
    """Return the chainages of the corners of two lines and of their crossings."""
    x = np.union1d(old[:, 0], line[:, 0])
    over = np.interp(x, *line.T) - np.interp(x, *old.T)
    k = np.flatnonzero(over[:-1] * over[1:] < 0.0)
    crossing = x[k] + (x[k + 1] - x[k]) * over[k] / (over[k] - over[k + 1])
    x = np.union1d(x, crossing)
    inner = x[1:-1][(np.diff(x)[:-1] > SAME_CORNER) & (x[-1] - x[1:-1] > SAME_CORNER)]
    return np.array([x[0], *inner, x[-1]])


def _insert(ground: Terrain, first: int, last: int, piece: Floats, names: list[str]) -> Terrain:
    """Return the ground with the part within segments `first` to `last` replaced by a piece."""
    kept = [0]  # corners within a straight segment are dropped
    for k in range(1, len(piece) - 1):
        (ax, ay), (bx, by), (cx, cy) = piece[kept[-1]], piece[k], piece[k + 1]
        bend = abs((bx - ax) * (cy - by) - (by - ay) * (cx - bx))
        if names[k] != names[k - 1] or bend > SAME_CORNER * SAME_CORNER * (1.0 + (cx - ax) ** 2):
            kept.append(k)
    kept.append(len(piece) - 1)
    points = [*ground.points[: first + 1], *piece[kept], *ground.points[last + 1 :]]
    surfaces = [
        *ground.surfaces[: first + 1],
        *(names[k] for k in kept[:-1]),
        *ground.surfaces[last:],
    ]
    at = first + len(kept)  # index of the last corner of the piece
    for joint, segment in ((at, at), (first, first)):
        if np.hypot(*(points[joint + 1] - points[joint])) < SAME_CORNER:
            # the piece begins or ends at a corner of the ground
            del points[joint + 1 if joint == at else joint], surfaces[segment]
    return Terrain(np.array(points), surfaces)
