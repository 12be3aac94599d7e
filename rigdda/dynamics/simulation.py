"""The facade: a scene in motion."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.dynamics.constants import (
    ASLEEP,
    AWAKE,
    BAD_STATE,
    BOLT,
    CONTACTS_FULL,
    ENDED,
    EVENTS_FULL,
    FIXED,
    GROUND_MOVED,
    MARGIN_RATIO,
    OPEN,
    PIN,
    PLAIN,
    QUIET_SPEED,
    REST,
    SOFT,
    TERRAIN,
)
from rigdda.dynamics.contact.links import pull_of_bolts
from rigdda.dynamics.frames import frame_of, no_frames, pieces
from rigdda.dynamics.monitors import FAILED
from rigdda.dynamics.pack import Arrays, pack
from rigdda.dynamics.pack.again import Template
from rigdda.dynamics.pack.ground import pack_ground
from rigdda.dynamics.pack.space import empty_contacts, empty_system, empty_work
from rigdda.dynamics.records import (
    BROAD_PHASE,
    CONTACT_TOTAL,
    CONTACTS,
    COUNTERS,
    EVENTS,
    ITERATIONS,
    LEDGER,
    RELAXED,
    SOLVER_ITERATIONS,
    SOLVES,
    STEPS,
    SWEEPS,
)
from rigdda.dynamics.run import EVENT, Run
from rigdda.dynamics.step import advance
from rigdda.errors import BadInput, Diverged, SoftContacts
from rigdda.kernel import Direct
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings

CONTACT = np.dtype(
    [
        ("block_a", "i4"),
        ("block_b", "i4"),
        ("x", "f8"),
        ("y", "f8"),
        ("nx", "f8"),
        ("ny", "f8"),
        ("normal_force", "f8"),
        ("shear_force", "f8"),
        ("state", "U5"),
        ("penetration", "f8"),
    ]
)
"""One contact. block_b: -1 terrain, N + i barrier i; block_a may be one, a gravity wall. The
normal points from b to a; shear is positive along the normal turned by +90 degrees. Forces act on a
[N]; penetration [m]."""

PHASES = ("broad phase", "narrow phase", "open-close", "motion")
"""Phases of a step: pairs of bodies that may touch; their contacts and the law of each; open-close
iteration, solution and relaxation; islands, movement and monitors."""

STATES = np.array(["open", "stick", "slip"])


class Energy(NamedTuple):
    """Energies of all blocks and gravity walls now, and work done on them so far [J].

    `elastic` is stored in bolts and plain contacts. `friction`, `damping` and `impact` are what
    shear forces, damping and the normal forces of contacts did, less what springs store: negative
    where they took energy. The kinetic energy of a block that leaves the site counts as taken by
    impact. `external` is the work of loads and of the motion of the ground.
    kinetic + potential + elastic grows by the sum of the four.
    """

    kinetic: float
    potential: float
    elastic: float
    friction: float
    damping: float
    impact: float
    external: float


advance_directly = Direct(advance)
"""The step loop; the types of its arrays are the same for every scene."""

MOST_STEPS = 1e9
"""Most steps of a run: a day or more of computing for a single block."""


class Diagnostics(NamedTuple):
    """What the computation took so far.

    `penetration` is the greatest depth of a vertex inside another polygon or the terrain [m];
    `relaxed` counts islands whose contact forces were relaxed, since they move or their open-close
    iteration did not settle. `compression` is how far contacts at rest give way now: their median,
    of plain ones the greatest, over the mean block size [-].
    `seconds` is the processor time by phase [s], nothing without `Settings.timing`.
    """

    steps: int
    open_close_iterations: int
    relaxed: int
    sweeps: int
    solves: int
    solver_iterations: int
    contacts: int
    penetration: float
    compression: float
    seconds: dict[str, float]


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
        self._elastic_at_start = self._elastic()
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

    def contacts(self) -> NDArray[np.void]:
        """Return the contacts of the last step as a structured array, see `CONTACT`."""
        c, n = self._now, self._counters[CONTACTS]
        c = c[:n]
        c = c[(c["kind"] != BOLT) & (c["kind"] != PIN)]
        out = np.zeros(len(c), dtype=CONTACT)
        blocks = len(self.scene.blocks)
        number = np.array([*range(blocks), *(blocks + i for i in self.scene.bodies), -1])
        out["block_a"], out["block_b"] = number[c["a"]], number[c["b"]]
        for name in ("x", "y", "nx", "ny"):
            out[name] = c[name]
        closed = c["state"] != OPEN
        out["normal_force"] = np.where(closed, c["normal"], 0.0)
        out["shear_force"] = np.where(closed, c["shear"], 0.0)
        out["state"] = STATES[c["state"]]
        out["penetration"] = np.maximum(-c["gap"], 0.0)
        return out

    def supports(self) -> NDArray[np.float64]:
        """Return the force of each support on its (first) block, (S, 2) [N].

        Of bolts the one at the end of the last step, of pins the mean over it; if it was taken in
        parts, over the last one.
        """
        c = self._now[: self._counters[CONTACTS]]
        c = c[c["kind"] == PIN]
        out = self._pull_of_bolts()
        fx = c["normal"] * c["nx"] - c["shear"] * c["ny"]
        fy = c["normal"] * c["ny"] + c["shear"] * c["nx"]
        out[-1 - c["key"]] = np.stack([fx, fy], axis=1)
        return out[np.argsort(self._arrays.links["number"])]

    def _pull_of_bolts(self) -> NDArray[np.float64]:
        """Return the force of each bolt, 0 for pins, in the order of the links, (S, 2) [N]."""
        out = np.zeros((len(self._arrays.links), 2))
        pull_of_bolts(self._arrays.bodies, self._arrays.links, out)
        return out

    def _elastic(self) -> float:
        """Return the energy stored in bolts and plain contacts now [J]."""
        links = self._arrays.links
        if len(links) + self._counters[CONTACTS] == 0:
            return 0.0
        bolts = links["kind"] == BOLT
        pull = self._pull_of_bolts()[bolts]
        total = 0.5 * ((pull**2).sum(axis=1) / links["stiffness"][bolts]).sum()
        c = self._now[: self._counters[CONTACTS]]
        c = c[(c["kind"] == PLAIN) & (c["state"] != OPEN)]
        return float(total + 0.5 * (c["stiffness"] * np.minimum(c["gap"], 0.0) ** 2).sum())

    def energy(self) -> Energy:
        """Return the energies of what is free to move now and the work done on it so far."""
        b, n = self._arrays.bodies, self._arrays.parameters[0].blocks
        free = b["status"][:n] != FIXED
        speed = b["vx"][:n] ** 2 + b["vy"][:n] ** 2
        kinetic = 0.5 * (b["mass"][:n] * speed + b["inertia"][:n] * b["omega"][:n] ** 2)
        gx, gy = self.scene.gravity_vector
        potential = -b["mass"][:n] * (gx * b["x"][:n] + gy * b["y"][:n])
        work = dict(zip(LEDGER, self._ledger.tolist(), strict=True))
        elastic = self._elastic()
        return Energy(
            float(kinetic[free].sum()),
            float(potential[free].sum()),
            elastic,
            work["friction"],
            work["damping"],
            work["impact"] + work["links"] + elastic - self._elastic_at_start,
            work["external"],
        )

    @property
    def diagnostics(self) -> Diagnostics:
        """What the computation took so far."""
        count = self._counters
        return Diagnostics(
            int(count[STEPS]),
            int(count[ITERATIONS]),
            int(count[RELAXED]),
            int(count[SWEEPS]),
            int(count[SOLVES]),
            int(count[SOLVER_ITERATIONS]),
            int(count[CONTACT_TOTAL]),
            float(self._deepest[0]),
            self._compression(),
            self._seconds_by_phase(),
        )

    def _seconds_by_phase(self) -> dict[str, float]:
        """Return the time spent in each phase [s], in proportion to its cycles."""
        cycles = self._counters[BROAD_PHASE:].astype(float)
        total = cycles.sum()
        share = cycles / total if total > 0.0 else cycles
        return dict(zip(PHASES, (self._seconds * share).tolist(), strict=True))

    def _compression(self) -> float:
        """Return how far contacts at rest give way now, over the mean block size [-].

        The median, since a blow loads one or another for a step; the greatest of plain contacts,
        all of one stiffness.
        """
        c, b = self._now[: self._counters[CONTACTS]], self._arrays.bodies
        quiet = np.hypot(b["vx"], b["vy"]) + np.abs(b["omega"]) * b["radius"] < QUIET_SPEED
        c = c[(c["state"] != OPEN) & quiet[c["a"]]]
        rest, plain = (c[c["kind"] == kind] for kind in (REST, PLAIN))
        rest, plain = (some["normal"] / some["stiffness"] for some in (rest, plain))
        typical = float(np.median(rest)) if len(rest) else 0.0
        size = self._arrays.parameters[0].margin / MARGIN_RATIO
        return max(typical, float(plain.max(initial=0.0))) / size

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
                raise Diverged(self._divergence(block))
            elif reason == ENDED:
                return True
        return False

    def _divergence(self, block: int) -> str:
        """Return what is known of a block that moves too fast, and of the contact that did it."""
        body = self._arrays.bodies[block]
        speed = ", ".join(f"{body[name]:g}" for name in ("vx", "vy", "omega"))
        told = f"step {self._counters[STEPS]} ({self.time:g} s): block {block} moves at ({speed})"
        contacts = self.contacts()
        touching = contacts[(contacts["block_a"] == block) | (contacts["block_b"] == block)]
        if len(touching):
            c = touching[np.argmax(np.abs(touching["normal_force"]))]
            other = c["block_b"] if c["block_a"] == block else c["block_a"]
            told += f", pressed with {c['normal_force']:g} N at ({c['x']:g}, {c['y']:g})"
            told += f" by {'the terrain' if other < 0 else f'block {other}'}"
        return f"{told}; use a smaller dt"

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
        contacts = self._now.view(np.ndarray)[: self._counters[CONTACTS]]
        chosen = self.settings.penetration is not None or bool((contacts["kind"] == PLAIN).any())
        if chosen and self._compression() > SOFT:
            warnings.warn(
                f"contacts at rest give way by {self._compression():.2g} of a block: what stands "
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


def simulate_many(
    scenes: Sequence[Scene],
    settings: Settings | None = None,
    duration: float = 25.0,
    every: float = 0.05,
    stations: Sequence[float] = (),
    watch: tuple[float, float] | None = None,
) -> list[Run]:
    """Run independent scenes over all cores, in threads; each gives what running it alone gives.

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


def chainages(stations: Sequence[float]) -> NDArray[np.float64]:
    """Return stations as an array.

    Raises
    ------
    BadInput
        If they are not finite numbers in ascending order.
    """
    try:
        lines = np.array([check.number("stations", x) for x in stations], dtype=np.float64)
    except TypeError:
        raise BadInput("stations", stations, "give a sequence of chainages") from None
    if (np.diff(lines) <= 0.0).any():
        raise BadInput("stations", lines.tolist(), "give them in ascending order")
    return lines


def _track(parts: list[tuple[int, int]], progress: bool) -> Iterable[tuple[int, int]]:
    if not progress:
        return parts
    from rich.progress import track

    return track(parts, description="simulating")
