"""The core of `rigdda`: many steps a call."""

from __future__ import annotations

from typing import Any

import numpy as np

import rigdda

NAME = "rigdda"

OPTIONS: tuple[dict, ...] = ({},)
"""What is swept beside the step: nothing, its defaults."""


class Engine:
    """A scene in this core. It takes many steps a call.

    Parameters
    ----------
    scene : rigdda.Scene
        The scene.
    dt : float
        Step [s].
    sleeping : bool
        Whether blocks at rest may sleep.
    settings
        Settings beside these.
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
