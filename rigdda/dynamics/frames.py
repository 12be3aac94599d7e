"""Frames of a run: positions and velocities of all bodies at one time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.records import Bodies
from rigdda.kernel import kernel

PIECE = 64
"""Maximum number of frames per call of the kernels; a progress bar is updated after each call."""


@kernel
def keep_frame(bodies: Bodies, frame: NDArray) -> None:
    """Write x, y, theta, vx, vy, omega of every body into a frame, (M, 6) [m, rad, m/s, rad/s]."""
    for i in range(len(bodies)):
        frame[i, 0], frame[i, 1], frame[i, 2] = bodies[i].x, bodies[i].y, bodies[i].theta
        frame[i, 3], frame[i, 4], frame[i, 5] = bodies[i].vx, bodies[i].vy, bodies[i].omega


def frame_of(bodies: Bodies) -> NDArray[np.float64]:
    """Return the frame of the current state, (M, 6), see `keep_frame`."""
    plain = bodies.view(np.ndarray)
    return np.stack([plain[name] for name in ("x", "y", "theta", "vx", "vy", "omega")], axis=1)


def no_frames(bodies: Bodies) -> NDArray[np.float64]:
    """Return an empty array of frames."""
    return np.empty((0, len(bodies), 6))


def pieces(steps: int, stride: int) -> list[tuple[int, int]]:
    """Divide `steps` into calls with a frame after every `stride` steps and one at the end.

    Each call is a pair: its number of frames, at most `PIECE`, and the number of steps per frame.
    """
    whole, rest = divmod(steps, stride)
    parts = [(min(PIECE, whole - done), stride) for done in range(0, whole, PIECE)]
    return parts + [(1, rest)] * (rest > 0)


def tracked(parts: list[tuple[int, int]], progress: bool) -> Iterable[tuple[int, int]]:
    """Return the pieces, wrapped in a progress bar if requested."""
    if not progress:
        return parts
    from rich.progress import track

    return track(parts, description="simulating")
