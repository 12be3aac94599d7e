"""History of a release: the state of its blocks after every step."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.frames import frame_of
from rigdda.dynamics.loop import Loop
from rigdda.dynamics.run import Run
from rigdda.dynamics.simulation import Simulation

MEMORY = 64e6
"""Greatest size of the states of a release [bytes]. Large masses are recorded at longer
intervals."""


class History:
    """The states of the blocks of a release after every step, or at equal intervals.

    A history can be used again; its arrays are then overwritten.

    Attributes
    ----------
    frames : (n, N, 6) array
        x, y, theta, vx, vy, omega of the N blocks at the start, at equal intervals and at the end
        [m, m, rad, m/s, m/s, rad/s].
    times : (n,) array
        Times of the states [s].
    stride : int
        Number of steps between two states.
    loop : Loop
        The loop that was followed, at the end.
    """

    frames: NDArray[np.float64]
    times: NDArray[np.float64]
    stride: int
    loop: Loop

    def __init__(self) -> None:
        self._room = np.empty((0, 0, 6))

    def follow(self, loop: Loop, steps: int) -> None:
        """Take up to `steps` steps with the scene of a single block, and record each.

        Raises
        ------
        Diverged
            If the simulation diverges.
        """
        start = frame_of(loop.arrays.bodies)
        if self._room.shape[0] <= steps or self._room.shape[1] != len(start):
            self._room = np.empty((steps + 1, *start.shape))
        self._room[0] = start
        loop.advance(steps, self._room[1 : steps + 1])
        self.frames, self.stride, self.loop = self._room[: loop.steps + 1, :1], 1, loop
        self.times = np.arange(len(self.frames)) * loop.arrays.parameters["dt"][0]

    def run(self, simulation: Simulation, duration: float, every: float) -> Run:
        """Run a simulation from its start and record it; return what `Simulation.run` returns.

        Raises
        ------
        Diverged
            If the simulation diverges.
        """
        dt, blocks = simulation.settings.dt, len(simulation.scene.blocks)
        steps, apart = max(1, round(duration / dt)), max(1, round(every / dt))
        most = max(1.0, MEMORY / (48.0 * blocks))
        fits = (s for s in range(1, apart) if apart % s == 0 and steps / s <= most)
        self.stride, self.loop = next(fits, apart), simulation.loop
        run = simulation.run(duration, self.stride * dt)
        self.frames, self.times = np.concatenate([run.poses, run.velocities], axis=2), run.times
        kept = np.append(np.arange(0, len(run.times) - 1, apart // self.stride), len(run.times) - 1)
        return dataclasses.replace(
            run,
            times=run.times[kept],
            poses=run.poses[kept],
            velocities=run.velocities[kept],
            barrier_poses=run.barrier_poses[kept],
        )
