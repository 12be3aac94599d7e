"""Frames of a run: where the bodies are and how fast they move."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.records import Bodies
from rigdda.kernel import kernel

PIECE = 64
"""Frames that are kept between two calls of the kernels; what a progress bar waits for."""


@kernel
def keep_frame(bodies: Bodies, frame: NDArray) -> None:
    """Write x, y, theta, vx, vy, omega of every body into a frame, (M, 6) [m, rad, m/s, rad/s]."""
    for i in range(len(bodies)):
        frame[i, 0], frame[i, 1], frame[i, 2] = bodies[i].x, bodies[i].y, bodies[i].theta
        frame[i, 3], frame[i, 4], frame[i, 5] = bodies[i].vx, bodies[i].vy, bodies[i].omega


def frame_of(bodies: Bodies) -> NDArray[np.float64]:
    """Return the frame of the present state, (M, 6), see `keep_frame`."""
    plain = bodies.view(np.ndarray)
    return np.stack([plain[name] for name in ("x", "y", "theta", "vx", "vy", "omega")], axis=1)


def no_frames(bodies: Bodies) -> NDArray[np.float64]:
    """Return room for no frame."""
    return np.empty((0, len(bodies), 6))


def pieces(steps: int, stride: int) -> list[tuple[int, int]]:
    """Return how to take so many steps with a frame after each `stride` of them and in the end.

    Pairs of a number of frames, at most `PIECE`, and of steps from one to the next.
    """
    whole, rest = divmod(steps, stride)
    parts = [(min(PIECE, whole - done), stride) for done in range(0, whole, PIECE)]
    return parts + [(1, rest)] * (rest > 0)


def tracked(parts: list[tuple[int, int]], progress: bool) -> Iterable[tuple[int, int]]:
    """Return the pieces, with a progress bar over them if it is asked for."""
    if not progress:
        return parts
    from rich.progress import track

    return track(parts, description="simulating")
