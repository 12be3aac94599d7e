"""The core of `rigdda` with any settings, as an engine of the bench."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigdda import Scene, Settings, Simulation

NAME = "rigdda"


class Engine:
    """A scene in this core.

    Parameters
    ----------
    scene : Scene
        The scene.
    dt : float
        Step [s].
    sleeping : bool
        Whether blocks at rest may sleep.
    settings
        Settings beside these.
    """

    def __init__(self, scene: Scene, dt: float, sleeping: bool, **settings: Any):
        self._sim = Simulation(scene, Settings(dt=dt, sleeping=sleeping, **settings))

    def advance(self, steps: int) -> None:
        """Take steps."""
        self._sim.step(steps)

    def poses(self) -> np.ndarray:
        """Return x, y of the centroids [m] and rotation since the start [rad], (N, 3)."""
        return self._sim.poses
