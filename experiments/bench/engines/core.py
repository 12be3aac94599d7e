"""The core of `rigdda`, with many steps per call."""

from __future__ import annotations

from typing import Any

import numpy as np

import rigdda

NAME = "rigdda"

OPTIONS: tuple[dict, ...] = ({},)
"""Options tried with each step: only the defaults."""


class Engine:
    """A scene in this core.

    Parameters
    ----------
    scene : rigdda.Scene
        The scene.
    dt : float
        Step [s].
    sleeping : bool
        Whether blocks at rest may sleep.
    settings
        Further settings.
    """

    def __init__(self, scene: rigdda.Scene, dt: float, sleeping: bool, **settings: Any):
        self._sim = rigdda.Simulation(scene, rigdda.Settings(dt=dt, sleeping=sleeping, **settings))

    def advance(self, steps: int) -> None:
        """Take steps."""
        self._sim.step(steps)

    def poses(self) -> np.ndarray:
        """Return x, y of the centroids [m] and rotation since the start [rad], (N, 3)."""
        return self._sim.poses

    def velocities(self) -> np.ndarray:
        """Return velocities of the centroids [m/s] and rates of rotation [rad/s], (N, 3)."""
        return self._sim.velocities
