"""The facade: a scene in motion."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.dynamics.constants import (
    ASLEEP,
    AWAKE,
    BAD_STATE,
    CONTACTS_FULL,
    ENDED,
    EVENTS_FULL,
    GROUND_MOVED,
    OPEN,
    PLAIN,
    SOFT,
    TERRAIN,
)
from rigdda.dynamics.frames import frame_of, no_frames, pieces
from rigdda.dynamics.monitors import FAILED
from rigdda.dynamics.pack import Arrays, pack
from rigdda.dynamics.pack.again import Template
from rigdda.dynamics.pack.ground import pack_ground
from rigdda.dynamics.pack.space import empty_contacts, empty_system, empty_work
from rigdda.dynamics.readings import (
    Diagnostics,
    Energy,
    compression,
    contact_table,
    diagnosed,
    divergence,
    elastic_energy,
    energies,
    support_forces,
)
from rigdda.dynamics.records import (
    CONTACTS,
    COUNTERS,
    EVENTS,
    LEDGER,
    STEPS,
    Contacts,
)
from rigdda.dynamics.run import EVENT, Run
from rigdda.dynamics.stations import chainages
from rigdda.dynamics.step import advance
from rigdda.errors import BadInput, Diverged, SoftContacts
from rigdda.kernel import Direct
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings

advance_directly = Direct(advance)
"""The step loop; the types of its arrays are the same for every scene."""

MOST_STEPS = 1e9
"""Most steps of a run: a day or more of computing for a single block."""


class Simulation:
    """A scene in motion.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    settings : Settings, optional
        How to compute it.
    stations : sequence of float
        Chainages whose first crossing by each block is recorded as an event [m].
    watch : (float, float), optional
        Interval of x in which the largest energy of each block is kept [m].
    leave : float, optional
        End a run as soon as nothing moves any more, or only downhill beyond this chainage [m];
        None: it lasts as long as is asked for.
    template : Template, optional
        Arrays packed for the same stations, interval, chainage and settings, and a scene from which
        this one differs in its rock: it is started in them.

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
        if template is None:
            self._arrays = self._pack(stations, watch, leave)
        else:
            self._arrays = template.write(scene)
        self._start()

    def _pack(
        self, stations: Sequence[float], watch: tuple[float, float] | None, leave: float | None
    ) -> Arrays:
        lines = chainages(stations)
        low, high = (math.inf, -math.inf) if watch is None else check.vector("watch", watch)
        if watch is not None and not low < high:
            raise BadInput("watch", watch, "give an interval (low, high)")
        end = -math.inf if leave is None else check.number("leave", leave)
        return pack(self.scene, self.settings, lines, (low, high), end)

    def _start(self) -> None:
        """Set what is counted and kept to what it is before the first step."""
        scene = self.scene
        self._now, self._before = self._arrays.now, self._arrays.before
        self._counters = np.zeros(COUNTERS, dtype=np.int64)
        self._ledger = np.zeros(len(LEDGER))
        self._deepest = np.zeros(1)
        self._seconds = 0.0
        self._no_frames = no_frames(self._arrays.bodies)
        self._elastic_at_start = elastic_energy(self._arrays, self._contacts)
        self._barrier_start = scene.barrier_poses
        self._events: list[NDArray[np.void]] = []

    @property
    def time(self) -> float:
        """Simulated time [s], counted in whole steps."""
        return float(self._counters[STEPS] * self.settings.dt)

    @property
    def poses(self) -> NDArray[np.float64]:
        """Copy of x, y, theta of the centroids, (N, 3) [m, m, rad]."""
        b, n = self._arrays.bodies, len(self.scene.blocks)
        return np.stack([b["x"][:n], b["y"][:n], b["theta"][:n]], axis=1)

    @property
    def barrier_poses(self) -> NDArray[np.float64]:
        """Copy of x, y, theta of the centroids of the barriers' outlines, (B, 3) [m, m, rad].

        Only gravity walls move.
        """
        out = self._barrier_start.copy()
        b, n = self._arrays.bodies, len(self.scene.blocks)
        out[list(self.scene.bodies)] = np.stack([b["x"][n:], b["y"][n:], b["theta"][n:]], axis=1)
        return out

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Copy of vx, vy, omega of the blocks, (N, 3) [m/s, m/s, rad/s]."""
        b, n = self._arrays.bodies, len(self.scene.blocks)
        return np.stack([b["vx"][:n], b["vy"][:n], b["omega"][:n]], axis=1)

    def vertices(self, block: int) -> NDArray[np.float64]:
        """Return the corners of a block now, (n, 2) [m]."""
        n = self._arrays.bodies["count"][block]
        corner = self._arrays.outlines.corner[block, :n]
        return np.stack([corner["x"], corner["y"]], axis=1)

    @property
    def _contacts(self) -> Contacts:
        """The contacts of the last step."""
        return self._now.view(np.ndarray)[: self._counters[CONTACTS]]

    def contacts(self) -> NDArray[np.void]:
        """Return the contacts of the last step as a structured array, see `CONTACT_TABLE`."""
        return contact_table(self.scene, self._contacts)

    def supports(self) -> NDArray[np.float64]:
        """Return the force of each support on its (first) block, (S, 2) [N].

        Of bolts the one at the end of the last step, of pins the mean over it; if it was taken in
        parts, over the last one.
        """
        return support_forces(self._arrays, self._contacts)

    def energy(self) -> Energy:
        """Return the energies of what is free to move now and the work done on it so far."""
        before = self._elastic_at_start
        return energies(self.scene, self._arrays, self._contacts, self._ledger, before)

    @property
    def diagnostics(self) -> Diagnostics:
        """What the computation took so far."""
        deepest = float(self._deepest[0])
        return diagnosed(self._arrays, self._contacts, self._counters, deepest, self._seconds)

    def step(self, n: int = 1) -> None:
        """Take `n` steps.

        Raises
        ------
        Diverged
            If a block's velocity is no longer finite or beyond any rockfall.
        """
        self._advance(check.integer("n", n, 0), self._no_frames)

    def _advance(self, steps: int, frames: NDArray[np.float64]) -> bool:
        """Take steps, as many from each of the frames to be kept to the next.

        Returns whether the run is over before that, see `leave`.
        """
        target, timing = self._counters[STEPS] + steps, self.settings.timing
        stride = steps // max(len(frames), 1)
        while self._counters[STEPS] < target:
            a, before = self._arrays, time.thread_time() if timing else 0.0
            reason, block, swapped = advance_directly.call(
                a.bodies,
                a.outlines,
                a.ground,
                a.interfaces,
                a.links,
                a.shaking,
                self._now,
                self._before,
                a.system,
                a.work,
                a.monitors,
                a.parameters,
                self._counters,
                self._ledger,
                self._deepest,
                target - self._counters[STEPS],
                frames,
                stride,
            )
            if timing:
                self._seconds += time.thread_time() - before
            if swapped:
                self._now, self._before = self._before, self._now
            if reason == EVENTS_FULL:
                self._drain_events()
            elif reason == CONTACTS_FULL:
                self._grow()
            elif reason == GROUND_MOVED:
                self._move_ground()
            elif reason == BAD_STATE:
                when = f"step {self._counters[STEPS]} ({self.time:g} s)"
                raise Diverged(divergence(self._arrays, self.contacts(), block, when))
            elif reason == ENDED:
                return True
        return False

    def run(self, duration: float, every: float = 0.05, progress: bool = False) -> Run:
        """Simulate `duration` seconds and record a frame `every` so often, the start included.

        Parameters
        ----------
        duration, every : float
            Simulated time and interval of frames [s], rounded to whole steps.
        progress : bool
            Show a progress bar.

        Raises
        ------
        BadInput
            If a time is not positive, or the duration of more than 1e9 steps.
        Diverged
            If the simulation diverges; its `run` keeps the frames up to then.

        Warns
        -----
        SoftContacts
            If contacts at rest in the end are too soft for their load, by `Settings.penetration`
            or by the one stiffness of plain contacts.
        """
        most = MOST_STEPS * self.settings.dt
        check.number("duration", duration, 0.0, most, open_low=True)
        check.number("every", every, 0.0, open_low=True)
        check.boolean("progress", progress)
        stride = max(1, round(every / self.settings.dt))
        steps = max(1, round(duration / self.settings.dt))
        start, bodies = self._counters[STEPS], self._arrays.bodies
        kept, at = [frame_of(bodies)[None]], [0]
        for count, apart in _track(pieces(steps, stride), progress):
            kept.append(np.empty((count, len(bodies), 6)))
            at += range(at[-1] + apart, at[-1] + (count + 1) * apart, apart)
            try:
                if self._advance(count * apart, kept[-1]):
                    last = self._counters[STEPS] - start
                    at = [mark for mark in at if mark < last]
                    kept = [np.concatenate(kept)[: len(at)], frame_of(bodies)[None]]
                    at.append(last)
                    break
            except Diverged as error:
                at = [mark for mark in at if start + mark < self._counters[STEPS]]
                error.run = self._record(kept, start + np.array(at))
                raise
        # what follows from the load by default is as stiff as it should be
        plain = bool((self._contacts["kind"] == PLAIN).any())
        give = compression(self._arrays, self._contacts)
        if (plain or self.settings.penetration is not None) and give > SOFT:
            warnings.warn(
                f"contacts at rest give way by {give:.2g} of a block: what stands "
                "or falls may hang on it; give Settings a smaller penetration",
                SoftContacts,
                stacklevel=2,
            )
        return self._record(kept, start + np.array(at))

    def _record(self, kept: list[NDArray], steps: NDArray) -> Run:
        """Return a run of the first frames that were kept, which were reached in such steps."""
        self._drain_events()
        frames, n = np.concatenate(kept)[: len(steps)], len(self.scene.blocks)
        barrier_poses = np.repeat(self._barrier_start[None], len(steps), axis=0)
        barrier_poses[:, list(self.scene.bodies)] = frames[:, n:, :3]
        events = np.concatenate([np.zeros(0, dtype=EVENT), *self._events])
        monitors = self._arrays.monitors
        rock, target = monitors.rock.view(np.ndarray), monitors.target.view(np.ndarray)
        return Run(
            self.scene,
            steps * self.settings.dt,
            frames[:, :n, :3].copy(),
            frames[:, :n, 3:].copy(),
            events,
            target["absorbed"].copy(),
            target["thrust"].copy(),
            rock["energy"].copy(),
            np.stack([rock["low"], rock["high"]], axis=1),
            barrier_poses,
        )

    def _drain_events(self) -> None:
        n = self._counters[EVENTS]
        self._events.append(self._arrays.monitors.event.view(np.ndarray)[:n].copy())
        self._counters[EVENTS] = 0

    def _move_ground(self) -> None:
        """Take the embankments that were pushed away off the ground, and wake what sleeps."""
        self._drain_events()
        failed = np.concatenate(self._events)
        gone = failed["target"][failed["kind"] == FAILED]
        ground = pack_ground(self.scene.ground_without(gone), list(self.scene.surfaces))
        self._arrays = self._arrays._replace(ground=ground)
        bodies, contacts = self._arrays.bodies, self._now
        bodies["quiet"][bodies["status"] == ASLEEP] = 0.0
        bodies["status"][bodies["status"] == ASLEEP] = AWAKE
        # its corners have other numbers now
        contacts["state"][(contacts["b"] == TERRAIN) & (contacts["owner"] == 0)] = OPEN

    def _grow(self) -> None:
        room, bodies = 2 * len(self._now), self._arrays.bodies
        blocks = self._arrays.parameters[0].blocks
        grown = empty_contacts(room)
        grown[: len(self._now)] = self._now
        self._now, self._before = grown, empty_contacts(room)
        work, before = empty_work(len(bodies), blocks, room), self._arrays.work
        work.boxes.row[:], work.begin[:] = before.boxes.row, before.begin
        self._arrays = self._arrays._replace(system=empty_system(blocks, room), work=work)


def _track(parts: list[tuple[int, int]], progress: bool) -> Iterable[tuple[int, int]]:
    if not progress:
        return parts
    from rich.progress import track

    return track(parts, description="simulating")
