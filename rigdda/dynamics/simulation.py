"""Simulation of one scene, and of many scenes in parallel."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.dynamics.constants import PLAIN
from rigdda.dynamics.frames import frame_of, no_frames, pieces, tracked
from rigdda.dynamics.loop import Loop
from rigdda.dynamics.monitors import chainages
from rigdda.dynamics.packing import Arrays, pack
from rigdda.dynamics.readings import (
    Diagnostics,
    Energy,
    compression,
    contact_table,
    diagnosed,
    elastic_energy,
    energies,
    support_forces,
)
from rigdda.dynamics.run import Run
from rigdda.dynamics.template import Template
from rigdda.errors import BadInput, Diverged, SoftContacts
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings

MOST_STEPS, STEPS_PER_CALL = 1e9, 10_000
"""Maximum number of steps of a run, which take a day or more for a single block, and maximum number
of steps between which a run cannot be interrupted."""

SOFT = 5e-3
"""Compression of a contact at rest over block size above which a run warns [-]. A stack of n blocks
buckles at a compression of 1.96/n^2 of the block size: at this value, with 20 blocks."""


class Simulation:
    """A scene and its state of motion.

    Parameters
    ----------
    scene : Scene
        The scene to simulate.
    settings : Settings, optional
        Settings of the computation.
    stations : sequence of float
        Chainages whose first crossing by each block is recorded as an event [m].
    watch : (float, float), optional
        Interval of x in which the largest energy of each block is recorded [m].
    leave : float, optional
        End a run early, as soon as every block is at rest or moves downhill beyond this chainage
        [m]. With None, a run lasts its full duration.
    template : Template, optional
        Arrays packed for the same stations, interval, chainage and settings, and for a scene that
        differs from this one only in its rock. The simulation uses these arrays.

    Attributes
    ----------
    loop : Loop
        The arrays of the scene and the step loop over them.

    Raises
    ------
    BadInput
        If stations are not ascending, the watched interval is empty, or the step is too long for
        the size of the blocks.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings | None = None,
        stations: Sequence[float] = (),
        watch: tuple[float, float] | None = None,
        leave: float | None = None,
        template: Template | None = None,
    ):
        if not isinstance(scene, Scene):
            raise BadInput("scene", scene, "give a rigdda.Scene")
        if not isinstance(settings, Settings | None):
            raise BadInput("settings", settings, "give rigdda.Settings or None")
        self.scene = scene
        self.settings = settings or Settings()
        arrays = template.write(scene) if template else self._packed(stations, watch, leave)
        self.loop = Loop(scene, arrays, self.settings.dt)
        self._no_frames = no_frames(arrays.bodies)
        self._elastic_at_start = elastic_energy(arrays, self.loop.contacts)
        self._barrier_start = scene.barrier_poses

    def _packed(
        self, stations: Sequence[float], watch: tuple[float, float] | None, leave: float | None
    ) -> Arrays:
        lines = chainages(stations)
        low, high = (math.inf, -math.inf) if watch is None else check.vector("watch", watch)
        if watch is not None and not low < high:
            raise BadInput("watch", watch, "give an interval (low, high)")
        end = -math.inf if leave is None else check.number("leave", leave)
        return pack(self.scene, self.settings, lines, (low, high), end)

    @property
    def time(self) -> float:
        """Simulated time [s], a whole number of steps."""
        return self.loop.time

    @property
    def poses(self) -> NDArray[np.float64]:
        """Copy of x, y, theta of the centroids, (N, 3) [m, m, rad]."""
        b, n = self.loop.arrays.bodies, len(self.scene.blocks)
        return np.stack([b["x"][:n], b["y"][:n], b["theta"][:n]], axis=1)

    @property
    def barrier_poses(self) -> NDArray[np.float64]:
        """Copy of x, y, theta of the centroids of the barriers' outlines, (B, 3) [m, m, rad].

        Only gravity walls and fences move.
        """
        out = self._barrier_start.copy()
        b, n = self.loop.arrays.bodies, len(self.scene.blocks)
        out[list(self.scene.bodies)] = np.stack([b["x"][n:], b["y"][n:], b["theta"][n:]], axis=1)
        return out

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Copy of vx, vy, omega of the blocks, (N, 3) [m/s, m/s, rad/s]."""
        b, n = self.loop.arrays.bodies, len(self.scene.blocks)
        return np.stack([b["vx"][:n], b["vy"][:n], b["omega"][:n]], axis=1)

    def vertices(self, block: int) -> NDArray[np.float64]:
        """Return the current corners of a block, (n, 2) [m]."""
        n = self.loop.arrays.bodies["count"][block]
        corner = self.loop.arrays.outlines.corner[block, :n]
        return np.stack([corner["x"], corner["y"]], axis=1)

    def contacts(self) -> NDArray[np.void]:
        """Return the contacts of the last step as a structured array, see `CONTACT_TABLE`."""
        return contact_table(self.scene, self.loop.contacts)

    def supports(self) -> NDArray[np.float64]:
        """Return the force of each support on its (first) block, (S, 2) [N].

        For bolts it is the force at the end of the last step. For pins it is the mean over the last
        step, or over its last substep if the step was divided.
        """
        return support_forces(self.loop.arrays, self.loop.contacts)

    def energy(self) -> Energy:
        """Return the current energies of all free bodies and the work done on them so far."""
        before = self._elastic_at_start
        return energies(self.scene, self.loop.arrays, self.loop.contacts, self.loop.ledger, before)

    @property
    def diagnostics(self) -> Diagnostics:
        """Cost and accuracy of the computation so far."""
        deepest = float(self.loop.deepest[0])
        return diagnosed(
            self.loop.arrays, self.loop.contacts, self.loop.counters, deepest, self.loop.seconds
        )

    def step(self, n: int = 1) -> None:
        """Take `n` steps.

        Raises
        ------
        BadInput
            If `n` is not a whole number from 0 to 1e9.
        Diverged
            If the velocity of a block is not finite or exceeds that of any rockfall.
        """
        for done in range(0, check.integer("n", n, 0, int(MOST_STEPS)), STEPS_PER_CALL):
            self.loop.advance(min(n - done, STEPS_PER_CALL), self._no_frames)

    def run(self, duration: float, every: float = 0.05, progress: bool = False) -> Run:
        """Simulate `duration` seconds and record frames at regular intervals, including the start.

        Parameters
        ----------
        duration, every : float
            Simulated time and interval of frames [s], rounded to whole steps.
        progress : bool
            Show a progress bar.

        Raises
        ------
        BadInput
            If a time is not positive, or the duration exceeds 1e9 steps.
        Diverged
            If the simulation diverges; the `run` attribute of the error holds the frames so far.

        Warns
        -----
        SoftContacts
            If contacts at rest at the end are too soft for their load, because of
            `Settings.penetration` or of the uniform stiffness of plain contacts.
        """
        most = MOST_STEPS * self.settings.dt
        check.number("duration", duration, 0.0, most, open_low=True)
        check.number("every", every, 0.0, open_low=True)
        check.boolean("progress", progress)
        stride = max(1, round(every / self.settings.dt))
        steps = max(1, round(duration / self.settings.dt))
        start, bodies = self.loop.steps, self.loop.arrays.bodies
        kept, at = [frame_of(bodies)[None]], [0]
        for count, apart in tracked(pieces(steps, stride), progress):
            kept.append(np.empty((count, len(bodies), 6)))
            at += range(at[-1] + apart, at[-1] + (count + 1) * apart, apart)
            try:
                if self.loop.advance(count * apart, kept[-1]):
                    last = self.loop.steps - start
                    at = [mark for mark in at if mark < last]
                    kept = [np.concatenate(kept)[: len(at)], frame_of(bodies)[None]]
                    at.append(last)
                    break
            except Diverged as error:
                at = [mark for mark in at if start + mark < self.loop.steps]
                error.run = self._record(kept, start + np.array(at))
                raise
        # by default the stiffness follows from the load and needs no check
        plain = bool((self.loop.contacts["kind"] == PLAIN).any())
        stated = plain or self.settings.penetration is not None
        give = compression(self.loop.arrays, self.loop.contacts) if stated else 0.0
        if give > SOFT:
            warnings.warn(
                f"contacts at rest give way by {give:.2g} of a block: what stands "
                "or falls may hang on it; give Settings a smaller penetration",
                SoftContacts,
                stacklevel=2,
            )
        return self._record(kept, start + np.array(at))

    def _record(self, kept: list[NDArray], steps: NDArray) -> Run:
        """Return a run of the first recorded frames, which were taken at these steps."""
        frames, n = np.concatenate(kept)[: len(steps)], len(self.scene.blocks)
        barrier_poses = np.repeat(self._barrier_start[None], len(steps), axis=0)
        barrier_poses[:, list(self.scene.bodies)] = frames[:, n:, :3]
        monitors = self.loop.arrays.monitors
        rock, target = monitors.rock.view(np.ndarray), monitors.target.view(np.ndarray)
        return Run(
            self.scene,
            steps * self.settings.dt,
            frames[:, :n, :3].copy(),
            frames[:, :n, 3:].copy(),
            self.loop.events(),
            target["absorbed"].copy(),
            target["thrust"].copy(),
            rock["energy"].copy(),
            np.stack([rock["low"], rock["high"]], axis=1),
            barrier_poses,
        )


def simulate_many(
    scenes: Sequence[Scene],
    settings: Settings | None = None,
    duration: float = 25.0,
    every: float = 0.05,
    stations: Sequence[float] = (),
    watch: tuple[float, float] | None = None,
) -> list[Run]:
    """Run independent scenes in threads on all cores, with the same results as one by one.

    Raises
    ------
    BadInput, Diverged
        As `Simulation` and `Simulation.run` do.
    """
    lines = tuple(chainages(stations))

    def one(scene: Scene) -> Run:
        return Simulation(scene, settings, lines, watch).run(duration, every)

    each = check.sequence("scenes", scenes, Scene, "rigdda.Scene")
    with ThreadPoolExecutor() as pool:
        return list(pool.map(one, each))
