"""The compiled step loop over the arrays of a scene, with growing room for contacts and events."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Totals, World
from rigdda.dynamics.constants import (
    ASLEEP,
    AWAKE,
    BAD_STATE,
    CONTACTS_FULL,
    ENDED,
    EVENTS_FULL,
    GROUND_MOVED,
    OPEN,
    TERRAIN,
)
from rigdda.dynamics.monitors import FAILED
from rigdda.dynamics.packing import Arrays, empty_contacts, empty_work, pack_ground
from rigdda.dynamics.readings import contact_table, divergence
from rigdda.dynamics.records import CONTACTS, COUNTERS, EVENTS, LEDGER, STEPS, Contacts
from rigdda.dynamics.step import advance
from rigdda.errors import Diverged
from rigdda.kernel import Direct
from rigdda.model.scene import Scene

advance_directly = Direct(advance)
"""The step loop without type dispatch: the types of its arrays are the same for every scene."""


class Loop:
    """A packed scene with its step loop, its counters and its recorded events.

    Parameters
    ----------
    scene : Scene
        The scene that was packed.
    arrays : Arrays
        Arrays of the scene before the first step.
    dt : float
        Step [s].

    Attributes
    ----------
    arrays : Arrays
        Arrays of the scene in its current state.
    now, before : (C,) array of CONTACT
        Contacts of the current and the last step, with spare room.
    counters : (COUNTERS,) array of int
        Counters, numbered in `records`.
    ledger : (5,) array
        Work done on the blocks so far, see `records.LEDGER` [J].
    deepest : (1,) array
        Greatest penetration so far [m].
    seconds : float
        Processor time so far [s].
    """

    def __init__(self, scene: Scene, arrays: Arrays, dt: float):
        self._scene, self._dt = scene, dt
        self.counters = np.zeros(COUNTERS, dtype=np.int64)
        self.ledger = np.zeros(len(LEDGER))
        self.deepest = np.zeros(1)
        self.start(arrays)

    def start(self, arrays: Arrays) -> None:
        """Restart with arrays in their state before the first step."""
        self.arrays = arrays
        self.now, self.before = arrays.now, arrays.before
        self.counters[:], self.ledger[:], self.deepest[:] = 0, 0.0, 0.0
        self.seconds = 0.0
        self._events: list[NDArray[np.void]] = []

    @property
    def steps(self) -> int:
        """Number of steps so far."""
        return int(self.counters[STEPS])

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.steps * self._dt

    @property
    def contacts(self) -> Contacts:
        """The contacts of the last step."""
        return self.now.view(np.ndarray)[: self.counters[CONTACTS]]

    def advance(self, steps: int, frames: NDArray[np.float64]) -> bool:
        """Take a number of steps and record frames at equal intervals.

        Parameters
        ----------
        steps : int
            Number of steps.
        frames : (F, M, 6) array
            Filled with the frames, see `frames.keep_frame`; F divides the number of steps, or is 0.

        Returns
        -------
        bool
            Whether the run ended before that, see `leave` of `Simulation`.

        Raises
        ------
        Diverged
            If the velocity of a block is not finite or exceeds that of any rockfall.
        """
        target = self.counters[STEPS] + steps
        stride = steps // max(len(frames), 1)
        totals = Totals(self.counters, self.ledger, self.deepest)
        while self.counters[STEPS] < target:
            a, before = self.arrays, time.thread_time()
            reason, block, swapped = advance_directly.call(
                World(a.bodies, a.outlines, a.ground, a.interfaces, a.links, a.shaking, a.stems),
                self.now,
                self.before,
                a.work,
                a.monitors,
                a.parameters,
                totals,
                target - self.counters[STEPS],
                frames,
                stride,
            )
            self.seconds += time.thread_time() - before
            if swapped:
                self.now, self.before = self.before, self.now
            if reason == EVENTS_FULL:
                self._drain_events()
            elif reason == CONTACTS_FULL:
                self._grow()
            elif reason == GROUND_MOVED:
                self._move_ground()
            elif reason == BAD_STATE:
                when = f"step {self.steps} ({self.time:g} s)"
                table = contact_table(self._scene, self.contacts)
                raise Diverged(divergence(a, table, block, when))
            elif reason == ENDED:
                return True
        return False

    def events(self) -> NDArray[np.void]:
        """Return the events so far, an array of EVENT."""
        self._drain_events()
        return self._events[0] if len(self._events) == 1 else np.concatenate(self._events)

    def _drain_events(self) -> None:
        """Store the events that the kernels wrote, and empty their buffer."""
        n = self.counters[EVENTS]
        self._events.append(self.arrays.monitors.event.view(np.ndarray)[:n].copy())
        self.counters[EVENTS] = 0

    def _move_ground(self) -> None:
        """Remove embankments that were pushed away from the ground, and wake all bodies."""
        failed = self.events()
        gone = failed["target"][failed["kind"] == FAILED]
        left = self._scene.ground_without(gone)
        ground = pack_ground(left, list(self._scene.surfaces))
        self.arrays = self.arrays._replace(ground=ground)
        bodies, contacts = self.arrays.bodies, self.now
        bodies["quiet"][bodies["status"] == ASLEEP] = 0.0
        bodies["status"][bodies["status"] == ASLEEP] = AWAKE
        # the corners of the new ground are numbered differently
        contacts["state"][(contacts["b"] == TERRAIN) & (contacts["owner"] == 0)] = OPEN

    def _grow(self) -> None:
        """Double the room for contacts."""
        room, bodies = 2 * len(self.now), self.arrays.bodies
        blocks = self.arrays.parameters[0].blocks
        grown = empty_contacts(room)
        grown[: len(self.now)] = self.now
        self.now, self.before = grown, empty_contacts(room)
        work, before = empty_work(len(bodies), blocks, room), self.arrays.work
        work.boxes.row[:], work.begin[:] = before.boxes.row, before.begin
        self.arrays = self.arrays._replace(work=work)
